#include "calib/correctors/hmq_kernel.h"

#include <cmath>

// Loops come in one copy for each instruction set, and the loader picks. The resolvers run before AddressSanitizer is
// ready, so that build has the plain copy only.
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__)
#define FIELDTRUE_HAS_CLONES
#define FIELDTRUE_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#define FIELDTRUE_TARGET(name) __attribute__((target(name)))
#define FIELDTRUE_AVX512 __attribute__((target("avx512f"), always_inline)) inline
#include <immintrin.h>
#else
#define FIELDTRUE_CLONES
#define FIELDTRUE_TARGET(name)
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

namespace {

/// The sums as a plain loop, compiled anew inside each function that calls it.
__attribute__((always_inline)) inline void plainSums(const MultiquadricArrays& centers,
                                                     const double* __restrict alpha_x, const double* __restrict alpha_y,
                                                     const double* __restrict alpha_z, const double* __restrict p_m,
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

FIELDTRUE_TARGET("default")
void sums(const MultiquadricArrays& centers, const double* alpha_x, const double* alpha_y, const double* alpha_z,
          const double* p_m, std::size_t n_points, double* f) {
  plainSums(centers, alpha_x, alpha_y, alpha_z, p_m, n_points, f);
}

#ifdef FIELDTRUE_HAS_CLONES
FIELDTRUE_TARGET("avx2")
void sums(const MultiquadricArrays& centers, const double* alpha_x, const double* alpha_y, const double* alpha_z,
          const double* p_m, std::size_t n_points, double* f) {
  plainSums(centers, alpha_x, alpha_y, alpha_z, p_m, n_points, f);
}

/// Eight points' worth of one coordinate, or of coefficients; lanes beyond `count` are zero.
FIELDTRUE_AVX512 __m512d load(const double* values, std::size_t count) {
  return count >= 8 ? _mm512_loadu_pd(values)
                    : _mm512_maskz_loadu_pd(static_cast<__mmask8>((1U << count) - 1U), values);
}

/// s^1/2 without the divider, to about one unit in the last place: with y0 = s^-1/2 (1 + e) of 14 bits and h = 1 - s
/// y0^2, s^1/2 = s y0 (1 + h/2 + 3 h^2/8 + 5 h^3/16 + O(h^4)), and h^4 < 2^-52.
FIELDTRUE_AVX512 __m512d rootBySeries(__m512d s) {
  const __m512d y0 = _mm512_rsqrt14_pd(s);
  const __m512d t = _mm512_mul_pd(s, y0);
  const __m512d h = _mm512_fnmadd_pd(t, y0, _mm512_set1_pd(1.0));
  __m512d series = _mm512_fmadd_pd(h, _mm512_set1_pd(0.3125), _mm512_set1_pd(0.375));
  series = _mm512_fmadd_pd(h, series, _mm512_set1_pd(0.5));
  return _mm512_fmadd_pd(t, _mm512_mul_pd(series, h), t);
}

/// The sums at one point, eight centres in a register.
struct Sums512 {
  __m512d px, py, pz, r2, fx, fy, fz;

  FIELDTRUE_AVX512 Sums512(const double* p_m, double r2_m2)
      : px(_mm512_set1_pd(p_m[0])),
        py(_mm512_set1_pd(p_m[1])),
        pz(_mm512_set1_pd(p_m[2])),
        r2(_mm512_set1_pd(r2_m2)),
        fx(_mm512_setzero_pd()),
        fy(_mm512_setzero_pd()),
        fz(_mm512_setzero_pd()) {}

  FIELDTRUE_AVX512 __m512d squaredWeight(const MultiquadricArrays& centers, std::size_t j, std::size_t count) const {
    const __m512d dx = _mm512_sub_pd(px, load(centers.x_m + j, count));
    const __m512d dy = _mm512_sub_pd(py, load(centers.y_m + j, count));
    const __m512d dz = _mm512_sub_pd(pz, load(centers.z_m + j, count));
    return _mm512_fmadd_pd(dx, dx, _mm512_fmadd_pd(dy, dy, _mm512_fmadd_pd(dz, dz, r2)));
  }
};

/// The divider takes 0.28 us for the exact roots of 512 centres, all of the plain loop's time, while the multipliers
/// idle. Here every other eight roots come from the multipliers: 0.21 us.
FIELDTRUE_TARGET("avx512f")
void sums(const MultiquadricArrays& centers, const double* alpha_x, const double* alpha_y, const double* alpha_z,
          const double* p_m, std::size_t n_points, double* f) {
  const std::size_t count = centers.count;
  for (std::size_t i = 0; i < n_points; ++i) {
    Sums512 sum(p_m + 3 * i, centers.r2_m2);
    const auto add = [&](std::size_t j, std::size_t lanes, __m512d w) FIELDTRUE_TARGET("avx512f") {
      sum.fx = _mm512_fmadd_pd(load(alpha_x + j, lanes), w, sum.fx);
      sum.fy = _mm512_fmadd_pd(load(alpha_y + j, lanes), w, sum.fy);
      sum.fz = _mm512_fmadd_pd(load(alpha_z + j, lanes), w, sum.fz);
    };
    std::size_t j = 0;
    for (; j + 16 <= count; j += 16) {
      const __m512d exact = _mm512_sqrt_pd(sum.squaredWeight(centers, j, 8));
      const __m512d by_series = rootBySeries(sum.squaredWeight(centers, j + 8, 8));
      add(j, 8, exact);
      add(j + 8, 8, by_series);
    }
    for (; j < count; j += 8) add(j, count - j, _mm512_sqrt_pd(sum.squaredWeight(centers, j, count - j)));
    f[3 * i] = _mm512_reduce_add_pd(sum.fx);
    f[3 * i + 1] = _mm512_reduce_add_pd(sum.fy);
    f[3 * i + 2] = _mm512_reduce_add_pd(sum.fz);
  }
}
#endif

}  // namespace

// A caller elsewhere sees one function; only where all versions of `sums` are in sight does a call go through the
// loader.
void multiquadricSums(const MultiquadricArrays& centers, const double* alpha_x, const double* alpha_y,
                      const double* alpha_z, const double* p_m, std::size_t n_points, double* f) {
  sums(centers, alpha_x, alpha_y, alpha_z, p_m, n_points, f);
}

FIELDTRUE_CLONES
double dotProduct(const double* __restrict a, const double* __restrict b, std::size_t count) {
  double sum = 0.0;
  for (std::size_t j = 0; j < count; ++j) sum += a[j] * b[j];
  return sum;
}

}  // namespace fieldtrue
