#include "calib/correctors/polynomial/polynomial_hold_out.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "calib/correctors/base/hold_out_rows.h"

namespace fieldtrue::correctors {
namespace {

/// Where less than this of a direction is seen by the other rows, the closed form divides by rounding.
constexpr double kLeastSeen = 1e-6;

/// Eigenvectors and values of the hat matrix of rows, Q_B Q_B^T.
struct Leverage {
  Eigen::MatrixXd directions;
  Eigen::VectorXd seen_by_others;  ///< One less the eigenvalue.
};

Leverage leverageOf(const Eigen::MatrixXd& base) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(base * base.transpose());
  return {eigen.eigenvectors(), (1.0 - eigen.eigenvalues().array()).matrix()};
}

Eigen::MatrixXd stacked(std::span<const Eigen::Vector3d> vectors) {
  Eigen::MatrixXd matrix(static_cast<Eigen::Index>(vectors.size()), 3);
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) matrix.row(i) = vectors[static_cast<std::size_t>(i)].transpose();
  return matrix;
}

/// value' = [of_value, of_position] [value; p] + constant.
Eigen::Matrix<double, 3, 6> jointly(const ValueChange& change) {
  Eigen::Matrix<double, 3, 6> joint;
  joint << change.of_value, change.of_position;
  return joint;
}

}  // namespace

Result<PolynomialHoldOut> PolynomialHoldOut::make(const PolynomialProblem& problem, Places places) {
  FT_TRY(auto field, PolynomialField::fit(problem));
  PolynomialHoldOut fits(std::move(field));
  fits.places_ = std::move(places);
  fits.name_ = problem.name;
  fits.p_m_.assign(problem.p_m.begin(), problem.p_m.end());
  fits.value_.assign(problem.value.begin(), problem.value.end());
  const Eigen::MatrixXd design = fits.field_.designMatrix(fits.p_m_);
  const Eigen::MatrixXd positions = stacked(fits.p_m_);
  fits.base_ = design * fits.field_.inverse_root_;
  fits.position_coefficients_ = fits.field_.inverse_root_ * (fits.base_.transpose() * positions);
  fits.residuals_.resize(design.rows(), 6);
  fits.residuals_.leftCols<3>() = stacked(fits.value_) - design * fits.field_.coefficients_;
  fits.residuals_.rightCols<3>() = positions - design * fits.position_coefficients_;
  fits.residual_squares_ = fits.residuals_.transpose() * fits.residuals_;
  return fits;
}

Eigen::MatrixXd PolynomialHoldOut::baseOf(std::span<const std::size_t> rows) const {
  Eigen::MatrixXd base(static_cast<Eigen::Index>(rows.size()), base_.cols());
  for (Eigen::Index i = 0; i < base.rows(); ++i)
    base.row(i) = base_.row(static_cast<Eigen::Index>(rows[static_cast<std::size_t>(i)]));
  return base;
}

Result<PolynomialField> PolynomialHoldOut::refit(std::span<const std::size_t> rows, const ValueChange& change) const {
  std::vector<Eigen::Vector3d> p_m;
  std::vector<Eigen::Vector3d> values;
  for (const std::size_t row : rowsWithout(p_m_.size(), rows)) {
    p_m.push_back(p_m_[row]);
    values.emplace_back(change.of_value * value_[row] + change.of_position * p_m_[row] + change.constant);
  }
  return PolynomialField::fit({name_, p_m, values, field_.degree_, field_.dimension_, placesLeft(places_, rows)});
}

Result<PolynomialField> PolynomialHoldOut::without(std::span<const std::size_t> rows, const ValueChange& change) const {
  const Eigen::Index n_terms = base_.cols();
  const auto n_left = static_cast<Eigen::Index>(p_m_.size() - rows.size());
  // With many rows left out their hat matrix costs more than fitting the rest.
  const bool is_large_fold = static_cast<Eigen::Index>(rows.size()) > n_terms;
  const bool is_too_few = placesLeft(places_, rows) < static_cast<std::size_t>(n_terms);
  if (rows.empty() || is_large_fold || is_too_few) return refit(rows, change);
  const Eigen::MatrixXd base = baseOf(rows);
  const Leverage leverage = leverageOf(base);
  if (leverage.seen_by_others.minCoeff() < kLeastSeen) return refit(rows, change);

  const Eigen::Matrix<double, 3, 6> joint = jointly(change);
  Eigen::MatrixXd residuals(base.rows(), 3);
  for (Eigen::Index i = 0; i < base.rows(); ++i)
    residuals.row(i) = residuals_.row(static_cast<Eigen::Index>(rows[static_cast<std::size_t>(i)])) * joint.transpose();
  const Eigen::MatrixXd turned = leverage.directions.transpose() * residuals;
  const Eigen::MatrixXd held_out = leverage.seen_by_others.cwiseInverse().asDiagonal() * turned;
  const Eigen::MatrixXd reach = leverage.directions.transpose() * base;  // U^T Q_B

  PolynomialField field = field_;
  field.coefficients_ =
      field_.coefficients_ * change.of_value.transpose() + position_coefficients_ * change.of_position.transpose();
  field.coefficients_.row(0) += change.constant.transpose();  // The constant is the first monomial.
  field.coefficients_ -= field_.inverse_root_ * (reach.transpose() * held_out);
  // (I - Q_B^T Q_B)^(-1/2) = I + sum of u u^T (1/sqrt(1 - h) - 1)/h over the directions, u = Q_B^T times direction.
  const Eigen::ArrayXd root = leverage.seen_by_others.array().sqrt();
  const Eigen::VectorXd widening = (1.0 / (root * (1.0 + root))).matrix();
  field.inverse_root_ += (field_.inverse_root_ * reach.transpose()) * widening.asDiagonal() * reach;
  const double all_squares = (joint * residual_squares_ * joint.transpose()).trace();
  const double squares = std::max(0.0, all_squares - turned.cwiseProduct(held_out).sum());
  field.residual_sd_ = n_left > n_terms ? std::sqrt(squares / static_cast<double>(n_left - n_terms)) : -1.0;
  return field;
}

std::optional<std::vector<double>> PolynomialHoldOut::leaveOneOutSquares() const {
  std::vector<double> squares;
  squares.reserve(places_.size());
  for (const std::vector<std::size_t>& rows : places_.rows) {
    const Leverage leverage = leverageOf(baseOf(rows));
    if (leverage.seen_by_others.minCoeff() < kLeastSeen) return std::nullopt;
    Eigen::MatrixXd residuals(static_cast<Eigen::Index>(rows.size()), 3);
    for (Eigen::Index i = 0; i < residuals.rows(); ++i)
      residuals.row(i) = residuals_.row(static_cast<Eigen::Index>(rows[static_cast<std::size_t>(i)])).leftCols<3>();
    const Eigen::MatrixXd held_out =
        leverage.seen_by_others.cwiseInverse().asDiagonal() * (leverage.directions.transpose() * residuals);
    squares.push_back(held_out.squaredNorm() / static_cast<double>(rows.size()));
  }
  return squares;
}

}  // namespace fieldtrue::correctors
