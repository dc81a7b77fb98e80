#include "tests/bench/square_roots.h"

#include <cmath>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace fieldtrue::bench {
namespace {

double plainSum(const double* values, std::size_t count, double offset) {
  double sum = 0.0;
  for (std::size_t j = 0; j < count; ++j) sum += std::sqrt(offset + values[j]);
  return sum;
}

#if defined(__x86_64__)
__attribute__((target("avx512f"))) double sum512(const double* values, std::size_t count, double offset) {
  const __m512d shift = _mm512_set1_pd(offset);
  __m512d sum = _mm512_setzero_pd();
  std::size_t j = 0;
  for (; j + 8 <= count; j += 8)
    sum = _mm512_add_pd(sum, _mm512_sqrt_pd(_mm512_add_pd(shift, _mm512_loadu_pd(values + j))));
  return _mm512_reduce_add_pd(sum) + plainSum(values + j, count - j, offset);
}

__attribute__((target("avx2"))) double sum256(const double* values, std::size_t count, double offset) {
  const __m256d shift = _mm256_set1_pd(offset);
  __m256d sum = _mm256_setzero_pd();
  std::size_t j = 0;
  for (; j + 4 <= count; j += 4)
    sum = _mm256_add_pd(sum, _mm256_sqrt_pd(_mm256_add_pd(shift, _mm256_loadu_pd(values + j))));
  double lanes[4];
  _mm256_storeu_pd(lanes, sum);
  return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + plainSum(values + j, count - j, offset);
}
#endif

}  // namespace

double sumOfRoots(const double* values, std::size_t count, double offset) {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f")) return sum512(values, count, offset);
  if (__builtin_cpu_supports("avx2")) return sum256(values, count, offset);
#endif
  return plainSum(values, count, offset);
}

}  // namespace fieldtrue::bench
