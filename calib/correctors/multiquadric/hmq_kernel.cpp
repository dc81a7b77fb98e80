#include "calib/correctors/multiquadric/hmq_kernel.h"

#include <cmath>

#include "calib/core/clones.h"

namespace fieldtrue::correctors {

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
void multiquadricSums(const MultiquadricArrays& centers, const double* const alpha[3], const double* p_m, double* f) {
  const double* __restrict x_m = centers.x_m;
  const double* __restrict y_m = centers.y_m;
  const double* __restrict z_m = centers.z_m;
  const double* __restrict alpha_x = alpha[0];
  const double* __restrict alpha_y = alpha[1];
  const double* __restrict alpha_z = alpha[2];
  const double px = p_m[0], py = p_m[1], pz = p_m[2], r2 = centers.r2_m2;
  const std::size_t count = centers.count;
  double fx = 0.0, fy = 0.0, fz = 0.0;
  for (std::size_t j = 0; j < count; ++j) {
    const double dx = px - x_m[j], dy = py - y_m[j], dz = pz - z_m[j];
    const double w = std::sqrt(dx * dx + dy * dy + dz * dz + r2);
    fx += alpha_x[j] * w;
    fy += alpha_y[j] * w;
    fz += alpha_z[j] * w;
  }
  f[0] = fx;
  f[1] = fy;
  f[2] = fz;
}

FIELDTRUE_CLONES
double dotProduct(const double* a, const double* b, std::size_t count) {
  double sum = 0.0;
  for (std::size_t j = 0; j < count; ++j) sum += a[j] * b[j];
  return sum;
}

}  // namespace fieldtrue::correctors
