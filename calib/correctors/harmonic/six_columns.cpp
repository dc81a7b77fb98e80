#include "calib/correctors/harmonic/six_columns.h"

#include "calib/core/clones.h"

namespace fieldtrue::correctors {
namespace {

FIELDTRUE_INLINE void oneColumn(const double* __restrict a, const double* __restrict b, std::size_t rows,
                                double* __restrict products) {
  double s0 = 0.0, s1 = 0.0, s2 = 0.0, s3 = 0.0, s4 = 0.0, s5 = 0.0;
  for (std::size_t i = 0; i < rows; ++i) {
    s0 += a[i] * b[i];
    s1 += a[rows + i] * b[i];
    s2 += a[2 * rows + i] * b[i];
    s3 += a[3 * rows + i] * b[i];
    s4 += a[4 * rows + i] * b[i];
    s5 += a[5 * rows + i] * b[i];
  }
  products[0] = s0;
  products[1] = s1;
  products[2] = s2;
  products[3] = s3;
  products[4] = s4;
  products[5] = s5;
}

/// Two at once: half as many loads of A.
FIELDTRUE_INLINE void twoColumns(const double* __restrict a, const double* __restrict b, std::size_t rows,
                                 double* __restrict products) {
  const double* __restrict c = b + rows;
  double s0 = 0.0, s1 = 0.0, s2 = 0.0, s3 = 0.0, s4 = 0.0, s5 = 0.0;
  double t0 = 0.0, t1 = 0.0, t2 = 0.0, t3 = 0.0, t4 = 0.0, t5 = 0.0;
  for (std::size_t i = 0; i < rows; ++i) {
    s0 += a[i] * b[i];
    t0 += a[i] * c[i];
    s1 += a[rows + i] * b[i];
    t1 += a[rows + i] * c[i];
    s2 += a[2 * rows + i] * b[i];
    t2 += a[2 * rows + i] * c[i];
    s3 += a[3 * rows + i] * b[i];
    t3 += a[3 * rows + i] * c[i];
    s4 += a[4 * rows + i] * b[i];
    t4 += a[4 * rows + i] * c[i];
    s5 += a[5 * rows + i] * b[i];
    t5 += a[5 * rows + i] * c[i];
  }
  const double sums[12] = {s0, s1, s2, s3, s4, s5, t0, t1, t2, t3, t4, t5};
  for (std::size_t k = 0; k < 12; ++k) products[k] = sums[k];
}

}  // namespace

FIELDTRUE_CLONES
void sixColumnsTimes(const double* six, const double* wide, std::size_t rows, std::size_t count, double* products) {
  std::size_t j = 0;
  for (; j + 1 < count; j += 2) twoColumns(six, wide + rows * j, rows, products + 6 * j);
  if (j < count) oneColumn(six, wide + rows * j, rows, products + 6 * j);
}

}  // namespace fieldtrue::correctors
