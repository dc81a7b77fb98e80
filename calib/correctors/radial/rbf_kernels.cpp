#include "calib/correctors/radial/rbf_kernels.h"

#include <bit>
#include <cmath>
#include <cstdint>

#include "calib/core/clones.h"

namespace fieldtrue::correctors {
namespace {

constexpr double kSqrt3 = 1.7320508075688772;
constexpr double kSqrt5 = 2.2360679774997897;

/// exp(x) for x <= 0 without a branch or a call, so that a loop over it vectorises: x = k log 2 + f, Taylor's series of
/// exp(f) to degree 13, whose next term is below 5e-18, and k added to the exponent. Below -700 it stays at exp(-700),
/// 1e-304.
FIELDTRUE_INLINE double expOfNegative(double x) {
  constexpr double kLog2E = 1.4426950408889634, kLog2High = 0x1.62e42fee00000p-1, kLog2Low = 0x1.a39ef35793c76p-33;
  constexpr double kRounder = 0x1.8p52;  // Adding it leaves the nearest integer in the lowest bits.
  x = x > -700.0 ? x : -700.0;
  const double shifted = x * kLog2E + kRounder;
  const double k = shifted - kRounder;
  const double f = (x - k * kLog2High) - k * kLog2Low;
  double series = 1.0 / 6227020800.0;
  series = series * f + 1.0 / 479001600.0;
  series = series * f + 1.0 / 39916800.0;
  series = series * f + 1.0 / 3628800.0;
  series = series * f + 1.0 / 362880.0;
  series = series * f + 1.0 / 40320.0;
  series = series * f + 1.0 / 5040.0;
  series = series * f + 1.0 / 720.0;
  series = series * f + 1.0 / 120.0;
  series = series * f + 1.0 / 24.0;
  series = series * f + 1.0 / 6.0;
  series = series * f + 0.5;
  series = series * f + 1.0;
  series = series * f + 1.0;
  const std::uint64_t exponent = std::bit_cast<std::uint64_t>(shifted) << 52U;
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(series) + exponent);
}

/// log(x) for normal x > 0, likewise: x = 2^e m with m in [sqrt(1/2), sqrt 2], and log m = 2 artanh((m - 1) / (m + 1))
/// to the 21st power, whose next term is below 1e-18.
FIELDTRUE_INLINE double logOfPositive(double x) {
  constexpr std::uint64_t kMantissa = 0x000fffffffffffffULL, kOne = 0x3ff0000000000000ULL;
  constexpr std::uint64_t kTwoTo52 = 0x4330000000000000ULL;
  constexpr double kLog2High = 0x1.62e42fee00000p-1, kLog2Low = 0x1.a39ef35793c76p-33;
  const std::uint64_t bits = std::bit_cast<std::uint64_t>(x);
  double m = std::bit_cast<double>((bits & kMantissa) | kOne);
  double e = std::bit_cast<double>((bits >> 52U) | kTwoTo52) - 0x1p52 - 1023.0;
  const bool upper = m > 1.4142135623730951;
  m = upper ? 0.5 * m : m;
  e = upper ? e + 1.0 : e;
  const double s = (m - 1.0) / (m + 1.0);
  const double s2 = s * s;
  double series = 1.0 / 21.0;
  series = series * s2 + 1.0 / 19.0;
  series = series * s2 + 1.0 / 17.0;
  series = series * s2 + 1.0 / 15.0;
  series = series * s2 + 1.0 / 13.0;
  series = series * s2 + 1.0 / 11.0;
  series = series * s2 + 1.0 / 9.0;
  series = series * s2 + 1.0 / 7.0;
  series = series * s2 + 1.0 / 5.0;
  series = series * s2 + 1.0 / 3.0;
  return e * kLog2High + (2.0 * s + (2.0 * s * s2 * series + e * kLog2Low));
}

/// Keeps the logarithm's argument normal; q log q is 0 there to 300 digits.
constexpr double kTiny = 1e-300;

template <class Function>
FIELDTRUE_INLINE void apply(const double* q, std::size_t count, double* out, Function function) {
  for (std::size_t j = 0; j < count; ++j) out[j] = function(q[j]);
}

FIELDTRUE_CLONES void multiquadricValues(const double* q, std::size_t count, double* out, double c2) {
  apply(q, count, out, [c2](double v) { return -std::sqrt(v + c2); });
}
FIELDTRUE_CLONES void multiquadricSlopes(const double* q, std::size_t count, double* out, double c2) {
  apply(q, count, out, [c2](double v) { return -1.0 / std::sqrt(v + c2); });
}
FIELDTRUE_CLONES void inverseValues(const double* q, std::size_t count, double* out, double c2) {
  apply(q, count, out, [c2](double v) { return 1.0 / std::sqrt(v + c2); });
}
FIELDTRUE_CLONES void inverseSlopes(const double* q, std::size_t count, double* out, double c2) {
  apply(q, count, out, [c2](double v) { return -1.0 / ((v + c2) * std::sqrt(v + c2)); });
}
FIELDTRUE_CLONES void cubicValues(const double* q, std::size_t count, double* out) {
  apply(q, count, out, [](double v) { return v * std::sqrt(v); });
}
FIELDTRUE_CLONES void cubicSlopes(const double* q, std::size_t count, double* out) {
  apply(q, count, out, [](double v) { return 3.0 * std::sqrt(v); });
}
FIELDTRUE_CLONES void thinPlateValues(const double* q, std::size_t count, double* out) {
  apply(q, count, out, [](double v) { return 0.5 * v * logOfPositive(v > kTiny ? v : kTiny); });
}
FIELDTRUE_CLONES void thinPlateSlopes(const double* q, std::size_t count, double* out) {
  apply(q, count, out, [](double v) {
    const double slope = logOfPositive(v > kTiny ? v : kTiny) + 1.0;
    return v > kTiny ? slope : 0.0;
  });
}
FIELDTRUE_CLONES void matern32Values(const double* q, std::size_t count, double* out) {
  apply(q, count, out, [](double v) {
    const double t = kSqrt3 * std::sqrt(v);
    return (1.0 + t) * expOfNegative(-t);
  });
}
FIELDTRUE_CLONES void matern32Slopes(const double* q, std::size_t count, double* out) {
  apply(q, count, out, [](double v) { return -3.0 * expOfNegative(-kSqrt3 * std::sqrt(v)); });
}
FIELDTRUE_CLONES void matern52Values(const double* q, std::size_t count, double* out) {
  apply(q, count, out, [](double v) {
    const double t = kSqrt5 * std::sqrt(v);
    return (1.0 + t + t * t / 3.0) * expOfNegative(-t);
  });
}
FIELDTRUE_CLONES void matern52Slopes(const double* q, std::size_t count, double* out) {
  apply(q, count, out, [](double v) {
    const double t = kSqrt5 * std::sqrt(v);
    return -(5.0 / 3.0) * (1.0 + t) * expOfNegative(-t);
  });
}

}  // namespace

FIELDTRUE_CLONES
void squaredDistances(const RadialArrays& centers, const double* u, double* __restrict q) {
  const double* __restrict x = centers.x;
  const double* __restrict y = centers.y;
  const double* __restrict z = centers.z;
  const double ux = u[0], uy = u[1], uz = u[2];
  const std::size_t count = centers.count;
  for (std::size_t j = 0; j < count; ++j) {
    const double dx = ux - x[j], dy = uy - y[j], dz = uz - z[j];
    q[j] = dx * dx + dy * dy + dz * dz;
  }
}

void radialValues(RadialKernel kernel, double c2, const double* q, std::size_t count, double* values) {
  switch (kernel) {
    case RadialKernel::kMultiquadric:
      return multiquadricValues(q, count, values, c2);
    case RadialKernel::kInverseMultiquadric:
      return inverseValues(q, count, values, c2);
    case RadialKernel::kCubic:
      return cubicValues(q, count, values);
    case RadialKernel::kThinPlate:
      return thinPlateValues(q, count, values);
    case RadialKernel::kMatern32:
      return matern32Values(q, count, values);
    case RadialKernel::kMatern52:
      return matern52Values(q, count, values);
  }
}

void radialSlopes(RadialKernel kernel, double c2, const double* q, std::size_t count, double* slopes) {
  switch (kernel) {
    case RadialKernel::kMultiquadric:
      return multiquadricSlopes(q, count, slopes, c2);
    case RadialKernel::kInverseMultiquadric:
      return inverseSlopes(q, count, slopes, c2);
    case RadialKernel::kCubic:
      return cubicSlopes(q, count, slopes);
    case RadialKernel::kThinPlate:
      return thinPlateSlopes(q, count, slopes);
    case RadialKernel::kMatern32:
      return matern32Slopes(q, count, slopes);
    case RadialKernel::kMatern52:
      return matern52Slopes(q, count, slopes);
  }
}

}  // namespace fieldtrue::correctors
