#pragma once

#include <cstdint>

#include "calib/evaluation/comparison.h"

namespace fieldtrue {

/// Picks the best methods by held-out RMS (nothing wins unless it beats the error before), tests their gain, and tells
/// how far the others are from the best.
void pickBest(Comparison& comparison, std::uint64_t seed, const RunControl& control = {});

/// Puts the verdict into one sentence.
void writeVerdictText(Comparison& comparison);

}  // namespace fieldtrue
