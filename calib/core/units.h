#pragma once

#include <numbers>

namespace fieldtrue {

constexpr double kPi = std::numbers::pi;
constexpr double kDegPerRad = 180.0 / kPi;
constexpr double kRadPerDeg = kPi / 180.0;
constexpr double kMPerMm = 1e-3;
constexpr double kMmPerM = 1e3;
constexpr double kFoot_m = 0.3048;
constexpr double kInch_m = 0.0254;

/// Of a normal law, the SD for each median absolute deviation from the median.
constexpr double kSdPerMad = 1.4826;

}  // namespace fieldtrue
