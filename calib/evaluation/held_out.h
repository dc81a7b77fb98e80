#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "calib/evaluation/candidate.h"
#include "calib/evaluation/comparison.h"
#include "calib/evaluation/folds.h"

namespace fieldtrue {

/// What is to be scored by fits that do not see it; fixed before anything runs.
struct HeldOutJob {
  std::vector<Node> nodes;  ///< Rows that count.
  TableMetadata metadata;
  AlignMode align = AlignMode::kRigid;
  Validation validation;
  std::uint64_t seed = 1;
  std::vector<Fold> folds;
  std::vector<std::size_t> fitted;  ///< Rows that a fit may see when nothing is held out.
  std::vector<std::size_t> scored;  ///< Rows that the folds score, ascending.
  std::vector<Candidate> candidates;
  bool has_orientation = false;
};

/// @param nodes rows that count
/// @param table for its metadata and the default validation
/// @error kTooFewNodes, kBadInput as makeFolds and the candidates' settings
Result<HeldOutJob> makeJob(const CalibrationTable& table, const ComparisonOptions& options);

std::vector<Node> rowsOf(const HeldOutJob& job, std::span<const std::size_t> rows);

/// The rigid part of these rows, where the job fits one.
Result<Alignment> alignmentOf(const HeldOutJob& job, std::span<const Node> nodes);

std::vector<RowScore> scoreRows(std::span<const Node> nodes, const Alignment& alignment,
                                const std::function<RowScore(const Node&, const Alignment&)>& score);

/// One candidate fitted to all rows it may see, and scored on those it was not fitted to.
struct CandidateScores {
  std::optional<std::string> skipped;  ///< Why it cannot be used; then nothing else is set.
  std::vector<RowScore> held_out;      ///< One per row of HeldOutJob::scored.
  int n_folds = 0;
  bool closed_form = false;
  double fit_s = 0.0;
  double eval_ns = 0.0;
  double in_sample_rms = 0.0;
  std::vector<std::string> notes;
};

struct HeldOutScores {
  int dimension = 3;                         ///< Of the true positions of all rows fitted.
  std::vector<RowScore> before_position;     ///< Each of HeldOutJob::scored.
  std::vector<RowScore> before_orientation;  ///< Empty without orientation.
  std::vector<CandidateScores> candidates;
};

/// Fits and scores every candidate. Where a method can leave rows out in closed form the folds are taken off one fit
/// to all rows; a costly method is refitted over fewer, larger folds.
/// @error kTooFewNodes, kDegenerate, kBadInput of the alignment; kCancelled
Result<HeldOutScores> scoreHeldOut(const HeldOutJob& job, const RunControl& control);

}  // namespace fieldtrue
