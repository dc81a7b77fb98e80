#pragma once

#include <cstddef>

namespace fieldtrue {

/// Multiquadric sums as plain arrays, one array a coordinate, so that the loops vectorise. Lengths are `count`.
struct MultiquadricArrays {
  const double* x_m = nullptr;
  const double* y_m = nullptr;
  const double* z_m = nullptr;
  std::size_t count = 0;
  double r2_m2 = 0.0;
};

/// w_j(p) = sqrt(|p - p_j|^2 + R^2), eq. 17 [m].
/// @param p_m one point, x y z
/// @param w_m out, length centers.count
void multiquadricWeights(const MultiquadricArrays& centers, const double* p_m, double* w_m);

/// Sums of three outputs at many points: f_k(p) = sum_j alpha_kj w_j(p), eq. 16.
/// @param alpha_x, alpha_y, alpha_z length centers.count each
/// @param p_m points one after the other, x y z
/// @param f out, three numbers a point; not the memory of p_m
void multiquadricSums(const MultiquadricArrays& centers, const double* alpha_x, const double* alpha_y,
                      const double* alpha_z, const double* p_m, std::size_t n_points, double* f);

/// sum_j a_j b_j
double dotProduct(const double* a, const double* b, std::size_t count);

}  // namespace fieldtrue
