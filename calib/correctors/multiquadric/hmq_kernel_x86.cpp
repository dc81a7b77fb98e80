// The multiquadric's sums for AVX-512 and for AVX2 with fused multiply-add, chosen while the program runs.
#include "calib/correctors/multiquadric/hmq_kernel_plain.h"

#if defined(__x86_64__) && (defined(__GNUC__) || defined(__clang__))

#include <immintrin.h>

#define FIELDTRUE_AVX512 __attribute__((target("avx512f,avx512vl,avx512dq,avx512bw,avx2,fma")))
#define FIELDTRUE_AVX512_INLINE FIELDTRUE_AVX512 FIELDTRUE_INLINE
#define FIELDTRUE_AVX2 __attribute__((target("avx2,fma")))
#define FIELDTRUE_AVX2_INLINE FIELDTRUE_AVX2 FIELDTRUE_INLINE

namespace fieldtrue::correctors::hmq_kernel {
namespace {

// With y0 = s^-1/2 (1 + e) estimated by the processor and h = 1 - s y0^2,
// s^1/2 = s y0 (1 - h)^-1/2 = s y0 (1 + h/2 + 3 h^2/8 + 5 h^3/16 + 35 h^4/128 + ...).

/// s^1/2 without the divider, to about one unit in the last place: e is below 2^-14, so h^4 is below 2^-52.
FIELDTRUE_AVX512_INLINE __m512d rootBySeries(__m512d s) {
  const __m512d y0 = _mm512_rsqrt14_pd(s);
  const __m512d t = _mm512_mul_pd(s, y0);
  const __m512d h = _mm512_fnmadd_pd(t, y0, _mm512_set1_pd(1.0));
  __m512d series = _mm512_fmadd_pd(h, _mm512_set1_pd(0.3125), _mm512_set1_pd(0.375));
  series = _mm512_fmadd_pd(h, series, _mm512_set1_pd(0.5));
  return _mm512_fmadd_pd(t, _mm512_mul_pd(series, h), t);
}

/// The same from a single-precision estimate, e below 1.5 2^-12: one more term, and s must be a normal float.
FIELDTRUE_AVX2_INLINE __m256d rootBySeries(__m256d s) {
  const __m256d y0 = _mm256_cvtps_pd(_mm_rsqrt_ps(_mm256_cvtpd_ps(s)));
  const __m256d t = _mm256_mul_pd(s, y0);
  const __m256d h = _mm256_fnmadd_pd(t, y0, _mm256_set1_pd(1.0));
  __m256d series = _mm256_fmadd_pd(h, _mm256_set1_pd(35.0 / 128.0), _mm256_set1_pd(0.3125));
  series = _mm256_fmadd_pd(h, series, _mm256_set1_pd(0.375));
  series = _mm256_fmadd_pd(h, series, _mm256_set1_pd(0.5));
  return _mm256_fmadd_pd(t, _mm256_mul_pd(series, h), t);
}

/// Eight centres' worth of one coordinate, or of coefficients; lanes beyond `count` are zero.
FIELDTRUE_AVX512_INLINE __m512d load(const double* values, std::size_t count) {
  return count >= 8 ? _mm512_loadu_pd(values)
                    : _mm512_maskz_loadu_pd(static_cast<__mmask8>((1U << count) - 1U), values);
}

FIELDTRUE_AVX512_INLINE __m512 load(const float* values, std::size_t count) {
  return count >= 16 ? _mm512_loadu_ps(values)
                     : _mm512_maskz_loadu_ps(static_cast<__mmask16>((1U << count) - 1U), values);
}

/// The sums at one point, eight centres in a register.
struct Sums512 {
  const MultiquadricArrays& centers;
  const double* alpha_x;
  const double* alpha_y;
  const double* alpha_z;
  __m512d px, py, pz, r2, fx, fy, fz;

  FIELDTRUE_AVX512_INLINE void start(const double* p_m) {
    px = _mm512_set1_pd(p_m[0]);
    py = _mm512_set1_pd(p_m[1]);
    pz = _mm512_set1_pd(p_m[2]);
    r2 = _mm512_set1_pd(centers.r2_m2);
    fx = fy = fz = _mm512_setzero_pd();
  }
  FIELDTRUE_AVX512_INLINE __m512d squaredWeight(std::size_t j, std::size_t lanes) const {
    const __m512d dx = _mm512_sub_pd(px, load(centers.x_m + j, lanes));
    const __m512d dy = _mm512_sub_pd(py, load(centers.y_m + j, lanes));
    const __m512d dz = _mm512_sub_pd(pz, load(centers.z_m + j, lanes));
    return _mm512_fmadd_pd(dx, dx, _mm512_fmadd_pd(dy, dy, _mm512_fmadd_pd(dz, dz, r2)));
  }
  FIELDTRUE_AVX512_INLINE void add(std::size_t j, std::size_t lanes, __m512d w) {
    fx = _mm512_fmadd_pd(load(alpha_x + j, lanes), w, fx);
    fy = _mm512_fmadd_pd(load(alpha_y + j, lanes), w, fy);
    fz = _mm512_fmadd_pd(load(alpha_z + j, lanes), w, fz);
  }
  FIELDTRUE_AVX512_INLINE void addRoots(std::size_t j) {
    for (; j < centers.count; j += 8) add(j, centers.count - j, _mm512_sqrt_pd(squaredWeight(j, centers.count - j)));
  }
  FIELDTRUE_AVX512_INLINE void finish(double* f) const {
    f[0] = _mm512_reduce_add_pd(fx);
    f[1] = _mm512_reduce_add_pd(fy);
    f[2] = _mm512_reduce_add_pd(fz);
  }
};

/// The divider alone takes 0.277 us for the exact roots of 512 centres while the multipliers idle. Here every other
/// eight roots come from the multipliers: 0.19 us.
FIELDTRUE_AVX512 void sums512(const MultiquadricArrays& centers, const double* alpha_x, const double* alpha_y,
                              const double* alpha_z, const double* p_m, std::size_t n_points, double* f) {
  Sums512 sum{centers, alpha_x, alpha_y, alpha_z, {}, {}, {}, {}, {}, {}, {}};
  for (std::size_t i = 0; i < n_points; ++i) {
    sum.start(p_m + 3 * i);
    std::size_t j = 0;
    for (; j + 32 <= centers.count; j += 32) {
      const __m512d w0 = _mm512_sqrt_pd(sum.squaredWeight(j, 8));
      const __m512d w1 = rootBySeries(sum.squaredWeight(j + 8, 8));
      const __m512d w2 = _mm512_sqrt_pd(sum.squaredWeight(j + 16, 8));
      const __m512d w3 = rootBySeries(sum.squaredWeight(j + 24, 8));
      sum.add(j, 8, w0);
      sum.add(j + 8, 8, w1);
      sum.add(j + 16, 8, w2);
      sum.add(j + 24, 8, w3);
    }
    sum.addRoots(j);
    sum.finish(f + 3 * i);
  }
}

FIELDTRUE_AVX512 void rootSums512(const MultiquadricArrays& centers, const double* alpha_x, const double* alpha_y,
                                  const double* alpha_z, const double* p_m, std::size_t n_points, double* f) {
  Sums512 sum{centers, alpha_x, alpha_y, alpha_z, {}, {}, {}, {}, {}, {}, {}};
  for (std::size_t i = 0; i < n_points; ++i) {
    sum.start(p_m + 3 * i);
    sum.addRoots(0);
    sum.finish(f + 3 * i);
  }
}

FIELDTRUE_AVX512 void singleSums512(const MultiquadricArraysSingle& terms, const float* p_m, std::size_t n_points,
                                    float* f) {
  const __m512 r2 = _mm512_set1_ps(terms.r2_m2);
  for (std::size_t i = 0; i < n_points; ++i) {
    const __m512 px = _mm512_set1_ps(p_m[3 * i]);
    const __m512 py = _mm512_set1_ps(p_m[3 * i + 1]);
    const __m512 pz = _mm512_set1_ps(p_m[3 * i + 2]);
    __m512 fx = _mm512_setzero_ps(), fy = fx, fz = fx;
    for (std::size_t j = 0; j < terms.count; j += 16) {
      const std::size_t lanes = terms.count - j;
      const __m512 dx = _mm512_sub_ps(px, load(terms.x_m + j, lanes));
      const __m512 dy = _mm512_sub_ps(py, load(terms.y_m + j, lanes));
      const __m512 dz = _mm512_sub_ps(pz, load(terms.z_m + j, lanes));
      const __m512 w = _mm512_sqrt_ps(_mm512_fmadd_ps(dx, dx, _mm512_fmadd_ps(dy, dy, _mm512_fmadd_ps(dz, dz, r2))));
      fx = _mm512_fmadd_ps(load(terms.alpha_x + j, lanes), w, fx);
      fy = _mm512_fmadd_ps(load(terms.alpha_y + j, lanes), w, fy);
      fz = _mm512_fmadd_ps(load(terms.alpha_z + j, lanes), w, fz);
    }
    f[3 * i] = _mm512_reduce_add_ps(fx);
    f[3 * i + 1] = _mm512_reduce_add_ps(fy);
    f[3 * i + 2] = _mm512_reduce_add_ps(fz);
  }
}

FIELDTRUE_AVX512 void weights512(const MultiquadricArrays& centers, const double* p_m, double* w_m) {
  plainWeights(centers, p_m, w_m);
}

FIELDTRUE_AVX512 double dot512(const double* a, const double* b, std::size_t count) { return plainDot(a, b, count); }

/// The sums at one point, four centres in a register.
struct Sums256 {
  const MultiquadricArrays& centers;
  const double* alpha_x;
  const double* alpha_y;
  const double* alpha_z;
  __m256d px, py, pz, r2, fx, fy, fz;

  FIELDTRUE_AVX2_INLINE void start(const double* p_m) {
    px = _mm256_set1_pd(p_m[0]);
    py = _mm256_set1_pd(p_m[1]);
    pz = _mm256_set1_pd(p_m[2]);
    r2 = _mm256_set1_pd(centers.r2_m2);
    fx = fy = fz = _mm256_setzero_pd();
  }
  FIELDTRUE_AVX2_INLINE __m256d squaredWeight(std::size_t j) const {
    const __m256d dx = _mm256_sub_pd(px, _mm256_loadu_pd(centers.x_m + j));
    const __m256d dy = _mm256_sub_pd(py, _mm256_loadu_pd(centers.y_m + j));
    const __m256d dz = _mm256_sub_pd(pz, _mm256_loadu_pd(centers.z_m + j));
    return _mm256_fmadd_pd(dx, dx, _mm256_fmadd_pd(dy, dy, _mm256_fmadd_pd(dz, dz, r2)));
  }
  FIELDTRUE_AVX2_INLINE void add(std::size_t j, __m256d w) {
    fx = _mm256_fmadd_pd(_mm256_loadu_pd(alpha_x + j), w, fx);
    fy = _mm256_fmadd_pd(_mm256_loadu_pd(alpha_y + j), w, fy);
    fz = _mm256_fmadd_pd(_mm256_loadu_pd(alpha_z + j), w, fz);
  }
  /// What has been summed, and the terms from j on one by one.
  FIELDTRUE_AVX2_INLINE void finish(std::size_t j, const double* p_m, double* f) const {
    const MultiquadricArrays rest{centers.x_m + j, centers.y_m + j, centers.z_m + j, centers.count - j, centers.r2_m2};
    plainSums(rest.x_m, rest.y_m, rest.z_m, rest.count, rest.r2_m2, alpha_x + j, alpha_y + j, alpha_z + j, p_m, 1, f);
    f[0] += total(fx);
    f[1] += total(fy);
    f[2] += total(fz);
  }
  FIELDTRUE_AVX2_INLINE static double total(__m256d lanes) {
    const __m128d halves = _mm_add_pd(_mm256_castpd256_pd128(lanes), _mm256_extractf128_pd(lanes, 1));
    return _mm_cvtsd_f64(_mm_add_sd(halves, _mm_unpackhi_pd(halves, halves)));
  }
};

/// A third of the roots from the multipliers: 0.24 us for 512 centres, and 0.31 us with the divider alone.
FIELDTRUE_AVX2 void sums256(const MultiquadricArrays& centers, const double* alpha_x, const double* alpha_y,
                            const double* alpha_z, const double* p_m, std::size_t n_points, double* f) {
  Sums256 sum{centers, alpha_x, alpha_y, alpha_z, {}, {}, {}, {}, {}, {}, {}};
  // Squares beyond these bounds leave the range of the single-precision estimate.
  constexpr double kFarthest_m = 1e15;
  constexpr double kSmallest_m2 = 1e-30;
  for (std::size_t i = 0; i < n_points; ++i) {
    const double* p = p_m + 3 * i;
    sum.start(p);
    std::size_t j = 0;
    const bool in_range = centers.r2_m2 > kSmallest_m2 && __builtin_fabs(p[0]) < kFarthest_m &&
                          __builtin_fabs(p[1]) < kFarthest_m && __builtin_fabs(p[2]) < kFarthest_m;
    for (; in_range && j + 12 <= centers.count; j += 12) {
      const __m256d w0 = _mm256_sqrt_pd(sum.squaredWeight(j));
      const __m256d w1 = rootBySeries(sum.squaredWeight(j + 4));
      const __m256d w2 = _mm256_sqrt_pd(sum.squaredWeight(j + 8));
      sum.add(j, w0);
      sum.add(j + 4, w1);
      sum.add(j + 8, w2);
    }
    sum.finish(j, p, f + 3 * i);
  }
}

FIELDTRUE_AVX2 void rootSums256(const MultiquadricArrays& centers, const double* alpha_x, const double* alpha_y,
                                const double* alpha_z, const double* p_m, std::size_t n_points, double* f) {
  plainSums(centers.x_m, centers.y_m, centers.z_m, centers.count, centers.r2_m2, alpha_x, alpha_y, alpha_z, p_m,
            n_points, f);
}

FIELDTRUE_AVX2 void singleSums256(const MultiquadricArraysSingle& terms, const float* p_m, std::size_t n_points,
                                  float* f) {
  plainSums(terms.x_m, terms.y_m, terms.z_m, terms.count, terms.r2_m2, terms.alpha_x, terms.alpha_y, terms.alpha_z, p_m,
            n_points, f);
}

FIELDTRUE_AVX2 void weights256(const MultiquadricArrays& centers, const double* p_m, double* w_m) {
  plainWeights(centers, p_m, w_m);
}

FIELDTRUE_AVX2 double dot256(const double* a, const double* b, std::size_t count) { return plainDot(a, b, count); }

}  // namespace

std::size_t x86Kernels(MultiquadricKernel* kernels) {
  std::size_t count = 0;
  const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (has_avx2 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw"))
    kernels[count++] = {"avx512", weights512, sums512, rootSums512, singleSums512, dot512};
  if (has_avx2) kernels[count++] = {"avx2", weights256, sums256, rootSums256, singleSums256, dot256};
  return count;
}

}  // namespace fieldtrue::correctors::hmq_kernel

#else

namespace fieldtrue::correctors::hmq_kernel {

std::size_t x86Kernels(MultiquadricKernel*) { return 0; }

}  // namespace fieldtrue::correctors::hmq_kernel

#endif
