#pragma once

#include <Eigen/Core>
#include <span>

namespace fieldtrue::acquisition {

/// The largest shift found in a series of readings, and how large one the noise alone may show.
struct Shift {
  double size = 0.0;   ///< Distance between the means before and after the split, same unit as the readings.
  double limit = 0.0;  ///< Larger than this is motion.
  bool moved() const { return size > limit; }
};

/// Compares the centre of the readings before each block boundary with the centre of those after it.
///
/// Centres are mid-means (the outer fifths of each axis left out), so that single wild readings are no motion. The
/// limit adapts to the measured noise and its autocorrelation, modelled as first-order autoregressive with a
/// correlation of at most 0.95. The noise is measured twice, from the differences of close neighbours (blind to drift
/// and to the smooth path of a hand) and from the scatter about the two centres (blind to a step), and the smaller is
/// used.
/// @param values readings at equal steps of time
/// @param block readings in a block, at least 1; fewer than two whole blocks show no shift
/// @param floor a shift up to this is never motion, same unit as the readings
/// @param sigmas standard errors of the difference of the centres (3-D) allowed; widened by 10/n for few readings
Shift largestShift(std::span<const Eigen::Vector3d> values, int block, double floor, double sigmas);

/// How far the readings run along a straight line, first to last, and how far they may by how the means of six equal
/// parts of them scatter about that line.
///
/// What a hand carries at a steady pace is seen here though it trembles: of a few readings largestShift takes tremor
/// for correlated noise, and then allows what the noise of a day might do.
/// @param values readings at equal steps of time; fewer than 6 show nothing
/// @param floor a run up to this is never motion, same unit as the readings
Shift steadyRun(std::span<const Eigen::Vector3d> values, double floor);

}  // namespace fieldtrue::acquisition
