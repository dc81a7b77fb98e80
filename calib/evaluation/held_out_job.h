#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "calib/evaluation/candidate.h"
#include "calib/evaluation/comparison.h"
#include "calib/evaluation/folds.h"

namespace fieldtrue::evaluation {

/// What is to be scored by fits that do not see it; fixed before anything runs.
struct HeldOutJob {
  std::vector<Node> nodes;  ///< Rows that count.
  TableMetadata metadata;
  calibration::AlignMode align = calibration::AlignMode::kRigid;
  Validation validation;
  std::uint64_t seed = 1;
  std::vector<Fold> folds;
  std::vector<std::size_t> fitted;  ///< Rows that a fit may see when nothing is held out.
  std::vector<std::size_t> scored;  ///< Rows that the folds score, ascending.
  std::vector<Candidate> candidates;
  bool has_orientation = false;
  bool separate_sensors = false;   ///< @see ComparisonOptions
  std::vector<std::string> notes;  ///< On the rows.
};

/// @param nodes rows that count
/// @param table for its metadata and the default validation
/// @error kTooFewNodes, kBadInput as makeFolds and the candidates' settings
Result<HeldOutJob> makeJob(const CalibrationTable& table, const ComparisonOptions& options);

std::vector<Node> rowsOf(const HeldOutJob& job, std::span<const std::size_t> rows);

/// The rigid part of these rows, where the job fits one.
Result<calibration::Alignment> alignmentOf(const HeldOutJob& job, std::span<const Node> nodes);

std::vector<RowScore> scoreRows(std::span<const Node> nodes, const calibration::Alignment& alignment,
                                const std::function<RowScore(const Node&, const calibration::Alignment&)>& score);

}  // namespace fieldtrue::evaluation
