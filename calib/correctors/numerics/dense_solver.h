#pragma once

#include <Eigen/Core>

namespace fieldtrue::correctors {

/// Dense factorisations by LAPACK, one thread, on matrices that are changed in place. Eigen's own run without the
/// processor's wide registers here, since every Eigen type must be compiled the same way everywhere; OpenBLAS picks its
/// kernels when it starts, and at 567 rows takes 8 ms for a Cholesky inverse.

/// Lower Cholesky factor of a symmetric matrix whose lower triangle is given.
/// @param matrix in: lower triangle; out: the factor in the lower triangle, the rest unchanged
/// @return false when the matrix is not positive definite to rounding
[[nodiscard]] bool choleskyInPlace(Eigen::MatrixXd& matrix);

/// X of L L^T X = B, from what choleskyInPlace left. @param right in: B; out: X
void choleskySolve(const Eigen::MatrixXd& factor, Eigen::MatrixXd& right);

/// v of L v = b. @param right in: b; out: v
void choleskyForward(const Eigen::MatrixXd& factor, Eigen::VectorXd& right);

/// The inverse of L L^T in the lower triangle. @param factor in: what choleskyInPlace left; out: the inverse
void choleskyInverseInPlace(Eigen::MatrixXd& factor);

/// L^-1 in the lower triangle. @param factor in: what choleskyInPlace left; out: the inverse
void lowerInverseInPlace(Eigen::MatrixXd& factor);

/// L B for a lower triangular L. @param right in: B; out: the product
void lowerTimesInPlace(const Eigen::MatrixXd& lower, Eigen::MatrixXd& right);

/// log det(L L^T)
double choleskyLogDeterminant(const Eigen::MatrixXd& factor);

/// Eigenvalues, ascending, and orthonormal eigenvectors of a symmetric matrix whose lower triangle is given.
/// @param matrix in: lower triangle; out: eigenvectors as columns
/// @return false when the iteration does not converge
[[nodiscard]] bool symmetricEigenInPlace(Eigen::MatrixXd& matrix, Eigen::VectorXd& eigenvalues);

/// A - X Y^T - Y X^T in the lower triangle. @param a in and out: lower triangle; X and Y thin
void subtractSymmetricProduct(Eigen::MatrixXd& a, const Eigen::MatrixXd& x, const Eigen::MatrixXd& y);

/// A A^T, in the lower triangle.
Eigen::MatrixXd timesOwnTranspose(const Eigen::MatrixXd& a);

/// A B.
Eigen::MatrixXd times(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// A^T B.
Eigen::MatrixXd transposedTimes(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// A B for symmetric A whose lower triangle is given.
Eigen::MatrixXd symmetricTimes(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// Copies the lower triangle to the upper one.
void completeSymmetric(Eigen::MatrixXd& matrix);

}  // namespace fieldtrue::correctors
