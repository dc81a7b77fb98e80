#pragma once

#include <array>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <utility>
#include <vector>

#include "calib/calibration/alignment.h"
#include "calib/calibration/corrector.h"
#include "calib/evaluation/base/index_source.h"
#include "calib/evaluation/comparison.h"
#include "calib/importers/importer.h"
#include "calib/importers/registry.h"
#include "tests/studies/rooms.h"

namespace fieldtrue::testing {

/// The conditions of the real recordings in anser_duplo.
inline constexpr std::array<const char*, 6> kAnserConditions = {
    "standard_data_grid", "interpolate_data_grid", "interpolate_data_grid_probe_calibrate",
    "finer_mesh_points",  "finer_mesh_3axis",      "steel_shield"};

inline CalibrationTable readAnser(const std::filesystem::path& nodes_csv, const std::string& condition) {
  const importers::Importer& importer = *orThrow(importers::findImporter("anser"));
  const Settings settings = orThrow(resolveSettings("anser", importer.settings, {{"condition", condition}}));
  return orThrow(importer.read(nodes_csv, std::nullopt, settings)).table.value();
}

/// Only the rows to fit of a recording.
inline CalibrationTable tableToFit(const RoomRecording& recording) {
  return {recording.table.metadata, recording.fit_nodes};
}

/// One row a place: a random half to fit, a quarter for the verdict (role validation), and a quarter that neither the
/// fits nor the verdict sees (role skipped).
inline CalibrationTable splitForVerdict(CalibrationTable table, std::uint64_t seed) {
  std::vector<std::size_t> order(table.nodes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  evaluation::IndexSource source(seed);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[source.below(i)]);
  for (std::size_t i = 0; i < order.size(); ++i)
    table.nodes[order[i]].role = 2 * i < order.size()       ? NodeRole::kFit
                                 : 4 * i < 3 * order.size() ? NodeRole::kValidation
                                                            : NodeRole::kSkipped;
  return table;
}

/// What the verdict said of a split table, and what came of it on the places that nothing had seen.
struct VerdictOutcome {
  bool applied = false;   ///< The verdict says "apply".
  bool has_best = false;  ///< Some method beats the error before on the places of the verdict.
  double before_m = 0.0;  ///< RMS over the unseen places, after the alignment alone.
  double after_m = 0.0;   ///< The same with the best method; as before where there is none.
  bool bestIsWorse() const { return has_best && after_m >= before_m; }
  bool isFalse() const { return applied && bestIsWorse(); }
};

/// RMS distance of corrected and true positions over the skipped places of a table [m].
inline double unseenRms_m(const CalibrationTable& split, const calibration::CorrectorChoice& choice,
                          calibration::AlignMode align) {
  std::vector<Node> fitted;
  for (const Node& node : split.nodes)
    if (node.role == NodeRole::kFit) fitted.push_back(node);
  const calibration::Corrector corrector = orThrow(calibration::Corrector::fit(fitted, split.metadata, choice, align));
  double sum_m2 = 0.0;
  int n_unseen = 0;
  for (const Node& node : split.nodes) {
    if (node.role != NodeRole::kSkipped) continue;
    const Eigen::Vector3d corrected_m = corrector.correctPosition_m(node.tracker_from_sensor.position_m);
    sum_m2 += (corrected_m - node.reference_from_sensor.position_m).squaredNorm();
    ++n_unseen;
  }
  return std::sqrt(sum_m2 / n_unseen);
}

/// The verdict on the positions of a table made by splitForVerdict.
/// @param methods empty = all
inline VerdictOutcome verdictOutcome(const CalibrationTable& split, const std::vector<MethodText>& methods) {
  evaluation::ComparisonOptions options;
  options.position_methods = methods;
  options.orientation_methods = {{"none", {}}};
  options.with_surroundings = false;
  const evaluation::Comparison comparison = orThrow(evaluation::compareMethods(split, options));
  VerdictOutcome outcome;
  outcome.applied = comparison.verdict.apply_position;
  outcome.has_best = comparison.best_position_row.has_value();
  outcome.before_m = unseenRms_m(split, {}, comparison.align);
  outcome.after_m = outcome.before_m;
  if (outcome.has_best) {
    const evaluation::MethodScore& best = comparison.position[*comparison.best_position_row];
    calibration::CorrectorChoice choice;
    choice.position_id = best.method;
    choice.position_settings = best.settings;
    outcome.after_m = unseenRms_m(split, choice, comparison.align);
  }
  return outcome;
}

}  // namespace fieldtrue::testing
