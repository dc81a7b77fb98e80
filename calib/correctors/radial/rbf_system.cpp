#include "calib/correctors/radial/rbf_system.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "calib/correctors/numerics/dense_solver.h"

namespace fieldtrue::correctors {
namespace {

/// Below this ratio of a column's part that the columns before leave over, the tail is rounding and noise.
constexpr double kRankThreshold = 1e-6;

Eigen::MatrixXd withZerosAbove(const Eigen::MatrixXd& lower, Eigen::Index n_zeros) {
  Eigen::MatrixXd padded(n_zeros + lower.rows(), lower.cols());
  padded.topRows(n_zeros).setZero();
  padded.bottomRows(lower.rows()) = lower;
  return padded;
}

/// (I - V S V^T) A (I - V S^T V^T) by one rank-2k update, lower triangle.
void turnBothSides(const Eigen::MatrixXd& v, const Eigen::MatrixXd& s, Eigen::MatrixXd& a) {
  const Eigen::MatrixXd w = symmetricTimes(a, v) * s.transpose();
  const Eigen::MatrixXd z = w - 0.5 * v * (s * (v.transpose() * w));
  subtractSymmetricProduct(a, v, z);
}

Eigen::MatrixXd withoutRows(const Eigen::MatrixXd& values, std::span<const std::size_t> out) {
  Eigen::MatrixXd kept(values.rows() - static_cast<Eigen::Index>(out.size()), values.cols());
  std::size_t next = 0;
  Eigen::Index row = 0;
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    if (next < out.size() && static_cast<Eigen::Index>(out[next]) == i)
      ++next;
    else
      kept.row(row++) = values.row(i);
  }
  return kept;
}

}  // namespace

std::optional<TailProjection> TailProjection::of(const Eigen::MatrixXd& tail) {
  const Eigen::Index k = tail.cols();
  if (tail.rows() <= k || !tail.allFinite()) return std::nullopt;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(tail);
  TailProjection projection;
  projection.r_ = qr.matrixQR().topRows(k).triangularView<Eigen::Upper>();
  for (Eigen::Index j = 0; j < k; ++j)
    if (!(std::abs(projection.r_(j, j)) > kRankThreshold * tail.col(j).norm())) return std::nullopt;
  projection.v_ = qr.matrixQR().triangularView<Eigen::UnitLower>();
  projection.t_ = Eigen::MatrixXd::Zero(k, k);
  for (Eigen::Index j = 0; j < k; ++j) {
    const double tau = qr.hCoeffs()[j];
    projection.t_(j, j) = tau;
    if (j > 0)
      projection.t_.col(j).head(j) =
          -tau * (projection.t_.topLeftCorner(j, j) * (projection.v_.leftCols(j).transpose() * projection.v_.col(j)));
  }
  return projection;
}

Eigen::MatrixXd TailProjection::projected(const Eigen::MatrixXd& a) const {
  Eigen::MatrixXd turned = a;
  turnBothSides(v_, t_.transpose(), turned);
  const Eigen::Index m = rows() - tailSize();
  return turned.bottomRightCorner(m, m);
}

Eigen::MatrixXd TailProjection::lifted(const Eigen::MatrixXd& g) const {
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(rows(), rows());
  a.bottomRightCorner(g.rows(), g.cols()) = g;
  turnBothSides(v_, t_, a);
  return a;
}

Eigen::MatrixXd TailProjection::toComplement(const Eigen::MatrixXd& values) const {
  return (values - v_ * (t_.transpose() * (v_.transpose() * values))).bottomRows(rows() - tailSize());
}

Eigen::MatrixXd TailProjection::fromComplement(const Eigen::MatrixXd& values) const {
  const Eigen::MatrixXd padded = withZerosAbove(values, tailSize());
  return padded - v_ * (t_ * (v_.transpose() * padded));
}

Eigen::MatrixXd TailProjection::toTail(const Eigen::MatrixXd& values) const {
  return values.topRows(tailSize()) - v_.topRows(tailSize()) * (t_.transpose() * (v_.transpose() * values));
}

Eigen::MatrixXd TailProjection::tailOf(const Eigen::MatrixXd& values) const {
  return r_.triangularView<Eigen::Upper>().solve(toTail(values));
}

Eigen::VectorXd TailProjection::tailCoordinates(const Eigen::VectorXd& h) const {
  return r_.transpose().triangularView<Eigen::Lower>().solve(h);
}

Eigen::MatrixXd TailProjection::tailBasis() const {
  const Eigen::MatrixXd first = Eigen::MatrixXd::Identity(rows(), tailSize());
  return first - v_ * (t_ * v_.topRows(tailSize()).transpose());
}

Eigen::VectorXd TailProjection::weightsOf(const Eigen::VectorXd& h) const { return tailBasis() * tailCoordinates(h); }

std::optional<RadialSolution> solveRadial(const TailProjection& projection, const Eigen::MatrixXd& a,
                                          const Eigen::MatrixXd& y, Eigen::MatrixXd* factor) {
  Eigen::MatrixXd projected = projection.projected(a);
  if (!choleskyInPlace(projected)) return std::nullopt;
  Eigen::MatrixXd z = projection.toComplement(y);
  choleskySolve(projected, z);
  RadialSolution solution;
  solution.coefficients = projection.fromComplement(z);
  solution.tail = projection.tailOf(y - symmetricTimes(a, solution.coefficients));
  if (!solution.coefficients.allFinite() || !solution.tail.allFinite()) return std::nullopt;
  if (factor != nullptr) *factor = std::move(projected);
  return solution;
}

std::optional<RadialHoldOut> RadialHoldOut::of(const TailProjection& projection, const Eigen::MatrixXd& a,
                                               const Eigen::MatrixXd& y, const Eigen::MatrixXd& x) {
  RadialHoldOut hold_out;
  Eigen::MatrixXd factor;
  Eigen::MatrixXd both(y.rows(), y.cols() + x.cols());
  both << y, x;
  const auto solution = solveRadial(projection, a, both, &factor);
  if (!solution) return std::nullopt;
  hold_out.of_y_ = {solution->coefficients.leftCols(3), solution->tail.leftCols(3)};
  hold_out.of_x_ = {solution->coefficients.rightCols(3), solution->tail.rightCols(3)};
  choleskyInverseInPlace(factor);
  hold_out.inverse_ = projection.lifted(factor);
  completeSymmetric(hold_out.inverse_);
  // t = R^-1 Q1^T (Y - A P Y); P and A are symmetric, so B = (A' - P A A') with A' = Q1 R^-T, column by column.
  const Eigen::Index k = projection.tailSize();
  Eigen::MatrixXd weights(a.rows(), k);
  for (Eigen::Index j = 0; j < k; ++j) weights.col(j) = projection.weightsOf(Eigen::VectorXd::Unit(k, j));
  hold_out.tail_inverse_ = weights - symmetricTimes(hold_out.inverse_, symmetricTimes(a, weights));
  return hold_out;
}

Eigen::MatrixXd RadialHoldOut::leaveOneOutErrors() const {
  return inverse_.diagonal().cwiseInverse().asDiagonal() * of_y_.coefficients;
}

std::optional<RadialSolution> RadialHoldOut::without(std::span<const std::size_t> out,
                                                     const Pose& fold_from_data) const {
  const Eigen::Matrix3d rotation = fold_from_data.orientation.toRotationMatrix();
  const Eigen::Matrix3d turn = rotation - Eigen::Matrix3d::Identity();
  // R q + t - p = R (q - p) + (R - I) p + t, and the tail alone follows t.
  RadialSolution solution;
  solution.coefficients = of_y_.coefficients * rotation.transpose() + of_x_.coefficients * turn.transpose();
  solution.tail = of_y_.tail * rotation.transpose() + of_x_.tail * turn.transpose();
  solution.tail.row(0) += fold_from_data.position_m.transpose();
  if (out.empty()) return solution;
  const auto errors = leftOutErrors(out, solution.coefficients);
  if (!errors) return std::nullopt;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(out[i]);
    solution.coefficients -= inverse_.col(column) * errors->row(static_cast<Eigen::Index>(i));
    solution.tail -= tail_inverse_.row(column).transpose() * errors->row(static_cast<Eigen::Index>(i));
  }
  solution.coefficients = withoutRows(solution.coefficients, out);
  return solution;
}

std::optional<Eigen::MatrixXd> RadialHoldOut::leftOutErrors(std::span<const std::size_t> out) const {
  return leftOutErrors(out, of_y_.coefficients);
}

std::optional<Eigen::MatrixXd> RadialHoldOut::leftOutErrors(std::span<const std::size_t> out,
                                                            const Eigen::MatrixXd& coefficients) const {
  const auto n_out = static_cast<Eigen::Index>(out.size());
  if (n_out + tail_inverse_.cols() > inverse_.rows()) return std::nullopt;
  Eigen::MatrixXd block(n_out, n_out), errors(n_out, 3);
  for (Eigen::Index i = 0; i < n_out; ++i) {
    const auto row = static_cast<Eigen::Index>(out[static_cast<std::size_t>(i)]);
    errors.row(i) = coefficients.row(row);
    for (Eigen::Index j = 0; j < n_out; ++j)
      block(i, j) = inverse_(row, static_cast<Eigen::Index>(out[static_cast<std::size_t>(j)]));
  }
  const Eigen::VectorXd diagonal = block.diagonal();
  const Eigen::LLT<Eigen::MatrixXd> llt(block);
  // A pivot that all but vanishes: the places left out were the only ones to hold up a direction of the tail.
  if (llt.info() != Eigen::Success || (llt.matrixLLT().diagonal().array().square() <= 1e-10 * diagonal.array()).any())
    return std::nullopt;
  return llt.solve(errors).eval();
}

Eigen::MatrixXd displacementMatrix(const Places& places) { return truthMatrix(places) - positionMatrix(places); }

Result<Places> smoothFitPlaces(const FitData& data, const std::string& name) {
  FT_TRY_VOID(checkPositions(data, name));
  Places places = mergePlaces(data);
  FT_TRY_VOID(checkSpread(name, places.size(), data.dimension));
  const auto needed = static_cast<std::size_t>(data.dimension) + 3;
  if (places.size() < needed)
    return fail(ErrorCode::kTooFewNodes, name + " needs at least 6 places" +
                                             (data.dimension == 2 ? ", or 5 that lie in one plane, got " : ", got ") +
                                             std::to_string(places.size()));
  return places;
}

Error degenerateTail(const std::string& name, std::size_t n_places) {
  return {ErrorCode::kDegenerate, name + ": the tracked positions of these " + std::to_string(n_places) +
                                      " places do not determine a linear field; they repeat, or lie in one plane "
                                      "where the true ones span a volume"};
}

}  // namespace fieldtrue::correctors
