#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calib/evaluation/held_out.h"
#include "calib/evaluation/held_out_job.h"

namespace fieldtrue::evaluation {

/// Which of the places the fits may not see on all sides: those less than half a spacing inside the hull of the places
/// fitted, or outside it.
/// @param fitted rows that a fit may see
/// @param places node numbers; each has a row in `nodes`
std::vector<bool> outermostPlaces(std::span<const Node> fitted, std::span<const Node> nodes,
                                  const std::vector<int>& places);

/// Fills in where the recommended correction errs: inside, near the edge, worst. The verdict must have been made.
void judgePlaces(Comparison& comparison);

/// Held-out RMS [mm] of the best position method fitted to half of the places; none without one or where a fit is
/// costly.
/// @error kCancelled
Result<std::optional<double>> rmsWithHalf_mm(const Comparison& comparison, const HeldOutJob& job,
                                             const RunControl& control);

/// One phrase, by evidence: what keeps the error of what the verdict recommends from being smaller.
std::string limitedBy(const Comparison& comparison, const HeldOutJob& job, std::optional<double> with_half_mm);

}  // namespace fieldtrue::evaluation
