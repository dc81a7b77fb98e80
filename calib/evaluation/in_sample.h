#pragma once

#include "calib/evaluation/held_out.h"

namespace fieldtrue {

/// Fits a candidate once to all rows it may see: whether it can be used, how long it takes, how well it fits. With
/// validation by role that fit is also the one that is scored.
/// @param data of HeldOutJob::fitted
CandidateScores fitInSample(const HeldOutJob& job, const Candidate& candidate, const FitData& data,
                            const Alignment& alignment, const RunControl& control);

}  // namespace fieldtrue
