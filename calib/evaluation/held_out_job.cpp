#include "calib/evaluation/held_out_job.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "calib/calibration/alignment.h"
#include "calib/calibration/coincident_places.h"
#include "calib/calibration/missing_orientations.h"
#include "calib/calibration/placed_sensors.h"
#include "calib/evaluation/held_out.h"

namespace fieldtrue::evaluation {
namespace {

Result<std::vector<Candidate>> candidatesOf(const ComparisonOptions& options) {
  FT_TRY(auto position, positionCandidates(options.position_methods));
  FT_TRY(auto orientation, orientationCandidates(options.orientation_methods));
  std::vector<Candidate> candidates = std::move(position);
  std::move(orientation.begin(), orientation.end(), std::back_inserter(candidates));
  return candidates;
}

}  // namespace

Result<HeldOutJob> makeJob(const CalibrationTable& table, const ComparisonOptions& options) {
  HeldOutJob job;
  job.metadata = table.metadata;
  job.seed = options.seed;
  std::copy_if(table.nodes.begin(), table.nodes.end(), std::back_inserter(job.nodes),
               [](const Node& node) { return node.role != NodeRole::kSkipped; });
  if (job.nodes.empty())
    return fail(ErrorCode::kTooFewNodes, table.nodes.empty()
                                             ? "The table has no rows to compare methods on"
                                             : "Every row of the table is skipped; nothing is left to compare");
  job.align = options.align.value_or(calibration::defaultAlignMode(table.metadata));
  calibration::PlacedSensors placed = calibration::placedSensors(job.nodes, job.align);
  job.nodes = std::move(placed.nodes);
  for (std::string& note : std::array{calibration::joinCoincidentPlaces(job.nodes), placed.note(),
                                      calibration::missingOrientationsNote(job.nodes)})
    if (!note.empty()) job.notes.push_back(std::move(note));
  auto candidates = candidatesOf(options);
  if (!candidates) return tl::unexpected(candidates.error());
  job.candidates = *std::move(candidates);
  for (Candidate& candidate : job.candidates)
    if (!options.closed_form) candidate.hold_out = nullptr;
  job.separate_sensors = options.separate_sensors;
  const bool needs_refits = std::any_of(job.candidates.begin(), job.candidates.end(), [](const Candidate& candidate) {
    return candidate.is_tuned || candidate.is_costly;
  });
  job.validation = options.validation.value_or(defaultValidation(table, needs_refits));
  job.has_orientation =
      std::all_of(job.nodes.begin(), job.nodes.end(), [](const Node& node) { return node.has_orientation; });
  auto folds = makeFolds(job.nodes, job.validation, options.seed);
  if (!folds) {
    Error error = folds.error();
    for (const std::string& note : job.notes) error.message += ". " + note;
    return tl::unexpected(error);
  }
  job.folds = *std::move(folds);
  if (job.validation.kind == ValidationKind::kRole) {
    job.fitted = job.folds.front().fitted;
  } else {
    job.fitted.resize(job.nodes.size());
    std::iota(job.fitted.begin(), job.fitted.end(), std::size_t{0});
  }
  for (const Fold& fold : job.folds) job.scored.insert(job.scored.end(), fold.scored.begin(), fold.scored.end());
  std::sort(job.scored.begin(), job.scored.end());
  return job;
}

std::vector<Node> rowsOf(const HeldOutJob& job, std::span<const std::size_t> rows) {
  std::vector<Node> nodes;
  nodes.reserve(rows.size());
  for (const std::size_t row : rows) nodes.push_back(job.nodes[row]);
  return nodes;
}

Result<calibration::Alignment> alignmentOf(const HeldOutJob& job, std::span<const Node> nodes) {
  return job.align == calibration::AlignMode::kRigid ? calibration::fitAlignment(nodes, job.metadata.jig_tolerance_m)
                                                     : Result<calibration::Alignment>(calibration::Alignment{});
}

std::vector<RowScore> scoreRows(std::span<const Node> nodes, const calibration::Alignment& alignment,
                                const std::function<RowScore(const Node&, const calibration::Alignment&)>& score) {
  std::vector<RowScore> scores;
  scores.reserve(nodes.size());
  for (const Node& node : nodes) scores.push_back(score(node, alignment));
  return scores;
}

}  // namespace fieldtrue::evaluation
