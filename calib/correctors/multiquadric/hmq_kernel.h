#pragma once

#include <cstddef>
#include <span>

namespace fieldtrue::correctors {

/// Multiquadric sums as plain arrays, one array a coordinate, so that the loops vectorise. Lengths are `count`; arrays
/// that start at a multiple of 64 bytes are read fastest.
struct MultiquadricArrays {
  const double* x_m = nullptr;
  const double* y_m = nullptr;
  const double* z_m = nullptr;
  std::size_t count = 0;
  double r2_m2 = 0.0;
};

/// The same in single precision, with the coefficients. Positions count from an origin near the centres, so that few
/// digits are lost to it.
struct MultiquadricArraysSingle {
  const float* x_m = nullptr;
  const float* y_m = nullptr;
  const float* z_m = nullptr;
  const float* alpha_x = nullptr;
  const float* alpha_y = nullptr;
  const float* alpha_z = nullptr;
  std::size_t count = 0;
  float r2_m2 = 0.0F;
};

/// w_j(p) = sqrt(|p - p_j|^2 + R^2), eq. 17 [m].
/// @param p_m one point, x y z
/// @param w_m out, length centers.count
void multiquadricWeights(const MultiquadricArrays& centers, const double* p_m, double* w_m);

/// Sums of three outputs at many points: f_k(p) = sum_j alpha_kj w_j(p), eq. 16, to a few units in the last place of
/// each term.
/// @param alpha_x, alpha_y, alpha_z length centers.count each
/// @param p_m points one after the other, x y z
/// @param f out, three numbers a point; not the memory of p_m
void multiquadricSums(const MultiquadricArrays& centers, const double* alpha_x, const double* alpha_y,
                      const double* alpha_z, const double* p_m, std::size_t n_points, double* f);

/// The same in single precision.
/// @param p_m points from the arrays' origin
void multiquadricSumsSingle(const MultiquadricArraysSingle& terms, const float* p_m, std::size_t n_points, float* f);

/// sum_j a_j b_j
double dotProduct(const double* a, const double* b, std::size_t count);

/// One way to compute the above, for one instruction set. The functions above use the fastest that the processor has.
struct MultiquadricKernel {
  const char* name = "";
  void (*weights)(const MultiquadricArrays&, const double*, double*) = nullptr;
  /// Square roots partly by series from the reciprocal square root's estimate, where that is faster.
  void (*sums)(const MultiquadricArrays&, const double*, const double*, const double*, const double*, std::size_t,
               double*) = nullptr;
  /// Every square root by the processor's square-root instruction.
  void (*sums_by_roots)(const MultiquadricArrays&, const double*, const double*, const double*, const double*,
                        std::size_t, double*) = nullptr;
  void (*sums_single)(const MultiquadricArraysSingle&, const float*, std::size_t, float*) = nullptr;
  double (*dot)(const double*, const double*, std::size_t) = nullptr;
};

/// Those that this processor can run, fastest first; the last one, `plain`, runs everywhere.
std::span<const MultiquadricKernel> multiquadricKernels();

}  // namespace fieldtrue::correctors
