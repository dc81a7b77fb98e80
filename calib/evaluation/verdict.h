#pragma once

#include <span>

#include "calib/evaluation/comparison.h"

namespace fieldtrue::evaluation {

/// What is left after correction cannot be this many times smaller than what noise and jig make at every place: a
/// larger floor is overstated.
constexpr double kOverstatedFloor = 3.0;

/// Differences of the last bits are not a win: a millionth of a millimetre or of a degree.
constexpr double kTie = 1e-6;

/// A smaller gain is not worth a correction.
constexpr double kNeededGain = 0.10;

/// Whether a method may be called best: scored as the comparison says, and not tuned by the places it is judged at.
bool isRanked(const MethodScore& score, const Comparison& comparison);

/// What the gain of a position correction says of it.
void judgePosition(Verdict& verdict, const GainTest& test);

/// Fills in each method's RMS minus that of the best, with the interval over the same places.
/// @param of_best the best one's errors of the places, mm or deg
void tellDistanceTo(const std::vector<double>& of_best, std::vector<MethodScore>& scores);

/// Picks the best of the ranked methods that do not fold back by held-out RMS (nothing wins unless it beats the error
/// before), tests their gain, and tells how far the others are from the best.
void pickBest(Comparison& comparison);

/// What is to be noted where the floor is above what is left, or what was there before.
void noteFloors(Comparison& comparison);

/// Nothing is applied where more than a quarter of the grid's cells fold back (of places without a grid: of those), or
/// where a sensor's readings are a mirror image of its places: the axes or the places of the readings are wrong then,
/// and a correction that hides it must not be believed. No position is corrected where the correction alone folds back
/// at more than a quarter of the points between the places.
/// @param nodes rows that count
void refuseInsideOut(Comparison& comparison, std::span<const Node> nodes);

/// Puts the verdict into one sentence.
void writeVerdictText(Comparison& comparison);

}  // namespace fieldtrue::evaluation
