#pragma once

namespace fieldtrue {

/// Of the sum of the squares of three standard normal numbers.
constexpr double kMedianOfChiSquare3 = 2.3660;

}  // namespace fieldtrue
