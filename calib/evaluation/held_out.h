#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "calib/calibration/alignment.h"
#include "calib/evaluation/candidate.h"
#include "calib/evaluation/comparison.h"
#include "calib/evaluation/folds.h"
#include "calib/evaluation/held_out_job.h"

namespace fieldtrue::evaluation {

/// One candidate fitted to all rows it may see, and scored on those it was not fitted to.
struct CandidateScores {
  std::optional<std::string> skipped;  ///< Why it cannot be used; then nothing else is set.
  std::vector<RowScore> held_out;      ///< One per row of HeldOutJob::scored.
  Validation validated;                ///< What it was scored with: not the job's where a fit is costly.
  bool tuned_inside = true;            ///< Nothing that its fits chose from the data came from the rows scored.
  int n_folds = 0;
  bool closed_form = false;
  double coefficients_a_place = 0.0;  ///< @see FitFreedom
  double own_variance = 0.0;          ///< @see HoldOutFits
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
/// to all rows; a tuned method only where places are left out one by one, and it then keeps what all rows chose. A
/// costly method is refitted over ten folds at most.
/// @error kTooFewNodes, kDegenerate, kBadInput of the alignment; kCancelled
Result<HeldOutScores> scoreHeldOut(const HeldOutJob& job, const RunControl& control);

}  // namespace fieldtrue::evaluation
