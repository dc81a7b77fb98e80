#pragma once

#include <filesystem>
#include <numeric>
#include <utility>
#include <vector>

#include "calib/evaluation/comparison.h"
#include "calib/evaluation/resampling.h"
#include "calib/importers/registry.h"
#include "tests/studies/rooms.h"

namespace fieldtrue::testing {

/// The conditions of the real recordings in anser_duplo.
inline constexpr std::array<const char*, 6> kAnserConditions = {
    "standard_data_grid", "interpolate_data_grid", "interpolate_data_grid_probe_calibrate",
    "finer_mesh_points",  "finer_mesh_3axis",      "steel_shield"};

inline CalibrationTable readAnser(const std::filesystem::path& nodes_csv, const std::string& condition) {
  const Importer& importer = *orThrow(findImporter("anser"));
  const Settings settings = orThrow(resolveSettings("anser", importer.settings, {{"condition", condition}}));
  return orThrow(importer.read(nodes_csv, std::nullopt, settings)).table.value();
}

/// Only the rows to fit of a recording.
inline CalibrationTable tableToFit(const RoomRecording& recording) {
  return {recording.table.metadata, recording.fit_nodes};
}

/// One row a place: a random half to fit, the rest for validation.
inline CalibrationTable splitInHalves(CalibrationTable table, std::uint64_t seed) {
  std::vector<std::size_t> order(table.nodes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  IndexSource source(seed);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[source.below(i)]);
  for (std::size_t i = 0; i < order.size(); ++i)
    table.nodes[order[i]].role = 2 * i < order.size() ? NodeRole::kFit : NodeRole::kValidation;
  return table;
}

/// The verdict on the positions of a table.
/// @param methods empty = all
inline bool saysApply(const CalibrationTable& table, const std::vector<MethodText>& methods) {
  ComparisonOptions options;
  options.position_methods = methods;
  options.orientation_methods = {{"none", {}}};
  options.with_surroundings = false;
  return orThrow(compareMethods(table, options)).verdict.apply_position;
}

/// What all places say when each is left out in turn: the best that can be known of whether a correction helps.
inline bool helpsByAllPlaces(CalibrationTable table, const std::vector<MethodText>& methods = {}) {
  for (Node& node : table.nodes) node.role = NodeRole::kFit;
  return saysApply(table, methods);
}

}  // namespace fieldtrue::testing
