#pragma once

#include <cmath>
#include <cstddef>

#include "calib/correctors/multiquadric/hmq_kernel.h"

/// The loops as plain C++, compiled anew for the instruction set of each function that they are inlined into.
#define FIELDTRUE_INLINE __attribute__((always_inline)) inline

namespace fieldtrue::correctors::hmq_kernel {

FIELDTRUE_INLINE void plainWeights(const MultiquadricArrays& centers, const double* p_m, double* __restrict w_m) {
  const double* __restrict x_m = centers.x_m;
  const double* __restrict y_m = centers.y_m;
  const double* __restrict z_m = centers.z_m;
  const double px = p_m[0], py = p_m[1], pz = p_m[2], r2 = centers.r2_m2;
  const std::size_t count = centers.count;
  for (std::size_t j = 0; j < count; ++j) {
    const double dx = px - x_m[j], dy = py - y_m[j], dz = pz - z_m[j];
    w_m[j] = std::sqrt(dx * dx + dy * dy + dz * dz + r2);
  }
}

template <class Real>
FIELDTRUE_INLINE void plainSums(const Real* __restrict x_m, const Real* __restrict y_m, const Real* __restrict z_m,
                                std::size_t count, Real r2, const Real* __restrict alpha_x,
                                const Real* __restrict alpha_y, const Real* __restrict alpha_z,
                                const Real* __restrict p_m, std::size_t n_points, Real* __restrict f) {
  for (std::size_t i = 0; i < n_points; ++i) {
    const Real px = p_m[3 * i], py = p_m[3 * i + 1], pz = p_m[3 * i + 2];
    Real fx = 0, fy = 0, fz = 0;
    for (std::size_t j = 0; j < count; ++j) {
      const Real dx = px - x_m[j], dy = py - y_m[j], dz = pz - z_m[j];
      const Real w = std::sqrt(dx * dx + dy * dy + dz * dz + r2);
      fx += alpha_x[j] * w;
      fy += alpha_y[j] * w;
      fz += alpha_z[j] * w;
    }
    f[3 * i] = fx;
    f[3 * i + 1] = fy;
    f[3 * i + 2] = fz;
  }
}

FIELDTRUE_INLINE double plainDot(const double* __restrict a, const double* __restrict b, std::size_t count) {
  double sum = 0.0;
  for (std::size_t j = 0; j < count; ++j) sum += a[j] * b[j];
  return sum;
}

/// The kernels of x86-64 beyond the baseline, fastest first, that this processor can run; none elsewhere.
std::size_t x86Kernels(MultiquadricKernel* kernels);
inline constexpr std::size_t kMostX86Kernels = 2;

}  // namespace fieldtrue::correctors::hmq_kernel
