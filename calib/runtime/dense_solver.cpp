#include "calib/correctors/numerics/dense_solver.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "calib/core/error.h"

/// The runtime's own definitions of the dense factorisations, by Eigen: a program that applies a calibration shall not
/// have to bring LAPACK, nor its threads, for the one that an uncertainty needs when the file is read. They agree with
/// LAPACK's to rounding.
namespace fieldtrue::correctors {

bool choleskyInPlace(Eigen::MatrixXd& matrix) {
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(matrix);
  return factor.info() == Eigen::Success && matrix.diagonal().allFinite();
}

void choleskySolve(const Eigen::MatrixXd& factor, Eigen::MatrixXd& right) {
  factor.triangularView<Eigen::Lower>().solveInPlace(right);
  factor.triangularView<Eigen::Lower>().adjoint().solveInPlace(right);
}

void choleskyForward(const Eigen::MatrixXd& factor, Eigen::VectorXd& right) {
  factor.triangularView<Eigen::Lower>().solveInPlace(right);
}

void choleskyInverseInPlace(Eigen::MatrixXd& factor) {
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(factor.rows(), factor.cols());
  choleskySolve(factor, inverse);
  factor.triangularView<Eigen::Lower>() = inverse;
}

void lowerInverseInPlace(Eigen::MatrixXd& factor) {
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(factor.rows(), factor.cols());
  factor.triangularView<Eigen::Lower>().solveInPlace(inverse);
  factor.triangularView<Eigen::Lower>() = inverse;
}

void lowerTimesInPlace(const Eigen::MatrixXd& lower, Eigen::MatrixXd& right) {
  right = lower.triangularView<Eigen::Lower>() * right;
}

double choleskyLogDeterminant(const Eigen::MatrixXd& factor) { return 2.0 * factor.diagonal().array().log().sum(); }

bool symmetricEigenInPlace(Eigen::MatrixXd& matrix, Eigen::VectorXd& eigenvalues) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  eigenvalues = solver.eigenvalues();
  matrix = solver.eigenvectors();
  return solver.info() == Eigen::Success && eigenvalues.allFinite();
}

void subtractSymmetricProduct(Eigen::MatrixXd& a, const Eigen::MatrixXd& x, const Eigen::MatrixXd& y) {
  for (Eigen::Index i = 0; i < x.cols(); ++i) a.selfadjointView<Eigen::Lower>().rankUpdate(x.col(i), y.col(i), -1.0);
}

Eigen::MatrixXd timesOwnTranspose(const Eigen::MatrixXd& a) { return a * a.transpose(); }

Eigen::MatrixXd times(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) { return a * b; }

Eigen::MatrixXd transposedTimes(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) { return a.transpose() * b; }

Eigen::MatrixXd symmetricTimes(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.selfadjointView<Eigen::Lower>() * b;
}

void completeSymmetric(Eigen::MatrixXd& matrix) { matrix.triangularView<Eigen::StrictlyUpper>() = matrix.transpose(); }

}  // namespace fieldtrue::correctors
