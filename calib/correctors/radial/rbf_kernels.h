#pragma once

#include <cstddef>

namespace fieldtrue::correctors {

/// Radial kernels of the squared distance q = r^2, signed so that each is conditionally positive definite of order two
/// at most: with a linear tail its matrix is positive definite on what the tail leaves.
enum class RadialKernel {
  kMultiquadric,         ///< -sqrt(q + c^2)
  kInverseMultiquadric,  ///< 1 / sqrt(q + c^2)
  kCubic,                ///< q^(3/2)
  kThinPlate,            ///< q log(q) / 2, which is r^2 log r
  kMatern32,             ///< (1 + sqrt(3 q)) exp(-sqrt(3 q))
  kMatern52              ///< (1 + sqrt(5 q) + 5 q / 3) exp(-sqrt(5 q))
};

/// Centres as plain arrays, one array a coordinate, so that the loops vectorise.
struct RadialArrays {
  const double* x = nullptr;
  const double* y = nullptr;
  const double* z = nullptr;
  std::size_t count = 0;
};

/// q_j = |u - u_j|^2. @param u one point, x y z; @param q out, length centers.count
void squaredDistances(const RadialArrays& centers, const double* u, double* q);

/// phi(q_j). @param c2 shape c^2 of the multiquadrics, ignored by the others; @param values out, may be q itself
void radialValues(RadialKernel kernel, double c2, const double* q, std::size_t count, double* values);

/// 2 dphi/dq = phi'(r)/r, so that the gradient is slope * (u - u_j); 0 stands for the thin plate's at q = 0, where the
/// gradient is 0.
/// @param slopes out, may be q itself
void radialSlopes(RadialKernel kernel, double c2, const double* q, std::size_t count, double* slopes);

}  // namespace fieldtrue::correctors
