#pragma once

#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"

namespace fieldtrue::calibration {

/// Rows with one true position are one place, whatever their numbers: held out apart, a repeated reading would be
/// foretold by its own repetition. Gives such rows the lowest of their numbers.
/// @param nodes true positions within a thousandth of their extent count as one
/// @return a sentence naming the places that were joined; empty when none were
std::string joinCoincidentPlaces(std::vector<Node>& nodes);

/// Of each place those at which another sensor stood where one of its own did, as on a bar whose sensors are a pitch
/// apart: its error there would foretell this one's. Places without any are not in it.
std::map<int, std::set<int>> placesSharedBySensors(std::span<const Node> nodes);

/// How many true positions a place stands for, in the mean: 1, and less where one position is a row of several places,
/// which then share it.
double positionsAPlace(std::span<const Node> nodes);

}  // namespace fieldtrue::calibration
