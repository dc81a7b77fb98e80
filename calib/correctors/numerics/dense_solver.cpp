#include "calib/correctors/numerics/dense_solver.h"

#include <cblas.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "calib/core/error.h"

// LAPACK's own symbols, which OpenBLAS carries: Debian's single-threaded OpenBLAS package ships no LAPACKE header.
extern "C" {
void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info);
void dpotrs_(const char* uplo, const int* n, const int* nrhs, const double* a, const int* lda, double* b,
             const int* ldb, int* info);
void dtrti2_(const char* uplo, const char* diag, const int* n, double* a, const int* lda, int* info);
void dlauum_(const char* uplo, const int* n, double* a, const int* lda, int* info);
void dsyevd_(const char* jobz, const char* uplo, const int* n, double* a, const int* lda, double* w, double* work,
             const int* lwork, int* iwork, const int* liwork, int* info);
}

namespace fieldtrue::correctors {
namespace {

constexpr char kLower = 'L';
constexpr char kWithDiagonal = 'N';

void useOneThread() {
  // calib starts no thread; where OpenBLAS is built with threads it must be told, once.
  static const bool told = [] {
    openblas_set_num_threads(1);
    return true;
  }();
  static_cast<void>(told);
}

int sizeOf(const Eigen::MatrixXd& matrix) {
  FT_CHECK(matrix.rows() == matrix.cols());
  return static_cast<int>(matrix.rows());
}

/// A B or A^T B. @param rows of the product
Eigen::MatrixXd product(CBLAS_TRANSPOSE transpose, const Eigen::MatrixXd& a, const Eigen::MatrixXd& b,
                        Eigen::Index rows) {
  useOneThread();
  Eigen::MatrixXd product = Eigen::MatrixXd::Zero(rows, b.cols());
  if (product.size() > 0 && b.rows() > 0)
    cblas_dgemm(CblasColMajor, transpose, CblasNoTrans, static_cast<int>(rows), static_cast<int>(b.cols()),
                static_cast<int>(b.rows()), 1.0, a.data(), static_cast<int>(a.rows()), b.data(),
                static_cast<int>(b.rows()), 0.0, product.data(), static_cast<int>(rows));
  return product;
}

/// The inverse of a lower triangular matrix in its place, by halves: OpenBLAS' own dtrtri goes through blocks of a
/// quarter of the matrix a column at a time, which takes three times as long at 567 rows.
/// @param l first element; columns are `stride` apart
void invertLower(double* l, int n, int stride) {
  constexpr int kByColumns = 32;
  if (n <= kByColumns) {
    int info = 0;
    dtrti2_(&kLower, &kWithDiagonal, &n, l, &stride, &info);
    return;
  }
  const int n_top = n / 2, n_bottom = n - n_top;
  double* const below = l + n_top;
  double* const corner = below + static_cast<std::ptrdiff_t>(n_top) * stride;
  cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasNoTrans, CblasNonUnit, n_bottom, n_top, -1.0, l, stride,
              below, stride);
  cblas_dtrsm(CblasColMajor, CblasLeft, CblasLower, CblasNoTrans, CblasNonUnit, n_bottom, n_top, 1.0, corner, stride,
              below, stride);
  invertLower(l, n_top, stride);
  invertLower(corner, n_bottom, stride);
}

}  // namespace

bool choleskyInPlace(Eigen::MatrixXd& matrix) {
  useOneThread();
  const int n = sizeOf(matrix);
  int info = 0;
  if (n > 0) dpotrf_(&kLower, &n, matrix.data(), &n, &info);
  // LAPACK lets a NaN pass.
  return info == 0 && matrix.diagonal().allFinite();
}

void choleskySolve(const Eigen::MatrixXd& factor, Eigen::MatrixXd& right) {
  const int n = sizeOf(factor);
  const int columns = static_cast<int>(right.cols());
  FT_CHECK(right.rows() == factor.rows());
  int info = 0;
  if (n > 0) dpotrs_(&kLower, &n, &columns, factor.data(), &n, right.data(), &n, &info);
  FT_CHECK(info == 0);
}

void choleskyForward(const Eigen::MatrixXd& factor, Eigen::VectorXd& right) {
  const int n = sizeOf(factor);
  FT_CHECK(right.size() == factor.rows());
  if (n > 0) cblas_dtrsv(CblasColMajor, CblasLower, CblasNoTrans, CblasNonUnit, n, factor.data(), n, right.data(), 1);
}

void choleskyInverseInPlace(Eigen::MatrixXd& factor) {
  const int n = sizeOf(factor);
  int info = 0;
  if (n == 0) return;
  invertLower(factor.data(), n, n);
  dlauum_(&kLower, &n, factor.data(), &n, &info);  // L^-T L^-1
  FT_CHECK(info == 0);
}

void lowerInverseInPlace(Eigen::MatrixXd& factor) {
  const int n = sizeOf(factor);
  if (n > 0) invertLower(factor.data(), n, n);
}

void lowerTimesInPlace(const Eigen::MatrixXd& lower, Eigen::MatrixXd& right) {
  const int n = sizeOf(lower);
  FT_CHECK(right.rows() == lower.rows());
  if (right.size() > 0)
    cblas_dtrmm(CblasColMajor, CblasLeft, CblasLower, CblasNoTrans, CblasNonUnit, n, static_cast<int>(right.cols()),
                1.0, lower.data(), n, right.data(), n);
}

double choleskyLogDeterminant(const Eigen::MatrixXd& factor) { return 2.0 * factor.diagonal().array().log().sum(); }

bool symmetricEigenInPlace(Eigen::MatrixXd& matrix, Eigen::VectorXd& eigenvalues) {
  useOneThread();
  const int n = sizeOf(matrix);
  eigenvalues.resize(n);
  if (n == 0) return true;
  const char vectors = 'V';
  int info = 0;
  int length = -1, integer_length = -1, integer_wanted = 0;
  double wanted = 0.0;
  dsyevd_(&vectors, &kLower, &n, matrix.data(), &n, eigenvalues.data(), &wanted, &length, &integer_wanted,
          &integer_length, &info);
  length = static_cast<int>(wanted);
  integer_length = integer_wanted;
  std::vector<double> work(static_cast<std::size_t>(length));
  std::vector<int> integer_work(static_cast<std::size_t>(integer_length));
  dsyevd_(&vectors, &kLower, &n, matrix.data(), &n, eigenvalues.data(), work.data(), &length, integer_work.data(),
          &integer_length, &info);
  return info == 0 && eigenvalues.allFinite();
}

void subtractSymmetricProduct(Eigen::MatrixXd& a, const Eigen::MatrixXd& x, const Eigen::MatrixXd& y) {
  useOneThread();
  const int n = sizeOf(a);
  FT_CHECK(x.rows() == a.rows() && y.rows() == a.rows() && x.cols() == y.cols());
  if (n == 0 || x.cols() == 0) return;
  cblas_dsyr2k(CblasColMajor, CblasLower, CblasNoTrans, n, static_cast<int>(x.cols()), -1.0, x.data(), n, y.data(), n,
               1.0, a.data(), n);
}

Eigen::MatrixXd timesOwnTranspose(const Eigen::MatrixXd& a) {
  useOneThread();
  const int n = static_cast<int>(a.rows());
  Eigen::MatrixXd product = Eigen::MatrixXd::Zero(n, n);
  if (a.size() > 0)
    cblas_dsyrk(CblasColMajor, CblasLower, CblasNoTrans, n, static_cast<int>(a.cols()), 1.0, a.data(), n, 0.0,
                product.data(), n);
  return product;
}

Eigen::MatrixXd times(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  FT_CHECK(a.cols() == b.rows());
  return product(CblasNoTrans, a, b, a.rows());
}

Eigen::MatrixXd transposedTimes(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  FT_CHECK(a.rows() == b.rows());
  return product(CblasTrans, a, b, a.cols());
}

Eigen::MatrixXd symmetricTimes(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  useOneThread();
  const int n = sizeOf(a);
  const int columns = static_cast<int>(b.cols());
  FT_CHECK(b.rows() == a.rows());
  Eigen::MatrixXd product(b.rows(), b.cols());
  if (n > 0 && columns > 0)
    cblas_dsymm(CblasColMajor, CblasLeft, CblasLower, n, columns, 1.0, a.data(), n, b.data(), n, 0.0, product.data(),
                n);
  return product;
}

void completeSymmetric(Eigen::MatrixXd& matrix) {
  // In tiles: going down a column and along a row at once misses the cache at every step.
  constexpr Eigen::Index kTile = 32;
  const Eigen::Index n = matrix.rows();
  for (Eigen::Index left = 0; left < n; left += kTile)
    for (Eigen::Index top = left; top < n; top += kTile)
      for (Eigen::Index j = left; j < std::min(left + kTile, n); ++j)
        for (Eigen::Index i = std::max(top, j + 1); i < std::min(top + kTile, n); ++i) matrix(j, i) = matrix(i, j);
}

}  // namespace fieldtrue::correctors
