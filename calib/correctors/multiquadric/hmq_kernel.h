#pragma once

#include <cstddef>

namespace fieldtrue::correctors {

/// Centres of a multiquadric as plain arrays, one array a coordinate, so that the loops vectorise.
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

/// Three sums at one point, f_k(p) = sum_j alpha_kj w_j(p), eq. 16, to a few units in the last place of each term.
/// @param alpha three arrays of length centers.count
/// @param p_m x y z
/// @param f out, three numbers
void multiquadricSums(const MultiquadricArrays& centers, const double* const alpha[3], const double* p_m, double* f);

/// sum_j a_j b_j
double dotProduct(const double* a, const double* b, std::size_t count);

}  // namespace fieldtrue::correctors
