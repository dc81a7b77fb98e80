#include "calib/correctors/hmq_kernel.h"

#include <cmath>

// The compiler makes one copy of each loop for each instruction set and the loader picks. The resolvers run before
// AddressSanitizer is ready, so that build has the plain copy only.
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__)
#define FIELDTRUE_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define FIELDTRUE_CLONES
#endif

namespace fieldtrue {

FIELDTRUE_CLONES
void multiquadricWeights(const MultiquadricArrays& centers, const double* p_m, double* __restrict w_m) {
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

FIELDTRUE_CLONES
void multiquadricSums(const MultiquadricArrays& centers, const double* __restrict alpha_x,
                      const double* __restrict alpha_y, const double* __restrict alpha_z, const double* __restrict p_m,
                      std::size_t n_points, double* __restrict f) {
  const double* __restrict x_m = centers.x_m;
  const double* __restrict y_m = centers.y_m;
  const double* __restrict z_m = centers.z_m;
  const double r2 = centers.r2_m2;
  const std::size_t count = centers.count;
  for (std::size_t i = 0; i < n_points; ++i) {
    const double px = p_m[3 * i], py = p_m[3 * i + 1], pz = p_m[3 * i + 2];
    double fx = 0.0, fy = 0.0, fz = 0.0;
    for (std::size_t j = 0; j < count; ++j) {
      const double dx = px - x_m[j], dy = py - y_m[j], dz = pz - z_m[j];
      const double w = std::sqrt(dx * dx + dy * dy + dz * dz + r2);
      fx += alpha_x[j] * w;
      fy += alpha_y[j] * w;
      fz += alpha_z[j] * w;
    }
    f[3 * i] = fx;
    f[3 * i + 1] = fy;
    f[3 * i + 2] = fz;
  }
}

FIELDTRUE_CLONES
double dotProduct(const double* __restrict a, const double* __restrict b, std::size_t count) {
  double sum = 0.0;
  for (std::size_t j = 0; j < count; ++j) sum += a[j] * b[j];
  return sum;
}

}  // namespace fieldtrue
