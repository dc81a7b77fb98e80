#pragma once

#include "calib/calibration/alignment.h"
#include "calib/evaluation/held_out.h"
#include "calib/evaluation/held_out_job.h"

namespace fieldtrue::evaluation {

/// Fits a candidate once to all rows it may see: whether it can be used, how long it takes, how well it fits. With
/// validation by role that fit is also the one that is scored.
/// @param data of HeldOutJob::fitted
CandidateScores fitInSample(const HeldOutJob& job, const Candidate& candidate, const correctors::FitData& data,
                            const calibration::Alignment& alignment, const RunControl& control);

}  // namespace fieldtrue::evaluation
