#pragma once

#include <cstdint>

#include "calib/evaluation/comparison.h"

namespace fieldtrue {

/// Picks the best methods by held-out RMS (nothing wins unless it beats the error before) and judges them.
void judge(Comparison& comparison, std::uint64_t seed);

}  // namespace fieldtrue
