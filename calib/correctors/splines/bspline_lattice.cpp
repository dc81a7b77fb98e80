#include "calib/correctors/splines/bspline_lattice.h"

#include <algorithm>
#include <cmath>

#include "calib/core/json_reader.h"

namespace fieldtrue::correctors {
namespace {

using Matrix = Eigen::MatrixXd;

/// The four cubic B-splines over one span, or their slopes times the span's length, at t in [0, 1].
std::array<double, 4> cubicWeights(double t, int order) {
  const double s = 1.0 - t;
  if (order == 0)
    return {s * s * s / 6.0, (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0, (3.0 * s * s * s - 6.0 * s * s + 4.0) / 6.0,
            t * t * t / 6.0};
  return {-0.5 * s * s, 1.5 * t * t - 2.0 * t, 2.0 * s - 1.5 * s * s, 0.5 * t * t};
}

/// D^T D of first or second differences of n numbers; zero where there are too few.
Matrix differencePenalty(Eigen::Index n, int order) {
  Matrix penalty = Matrix::Zero(n, n);
  for (Eigen::Index i = 0; i + order < n; ++i) {
    Eigen::VectorXd row = Eigen::VectorXd::Zero(n);
    if (order == 1)
      row.segment<2>(i) << -1.0, 1.0;
    else
      row.segment<3>(i) << 1.0, -2.0, 1.0;
    penalty += row * row.transpose();
  }
  return penalty;
}

/// sum += factor * A (x) B (x) C for banded A, B, C.
void addProduct(const Matrix& a, const Matrix& b, const Matrix& c, double factor, Matrix& sum) {
  const Eigen::Index nb = b.rows(), nc = c.rows();
  for (Eigen::Index i = 0; i < a.rows(); ++i)
    for (Eigen::Index j = 0; j < a.rows(); ++j) {
      if (a(i, j) == 0.0) continue;
      for (Eigen::Index k = 0; k < nb; ++k)
        for (Eigen::Index l = 0; l < nb; ++l)
          if (b(k, l) != 0.0) sum.block((i * nb + k) * nc, (j * nb + l) * nc, nc, nc) += factor * a(i, j) * b(k, l) * c;
    }
}

}  // namespace

SplineLattice SplineLattice::around(std::span<const Eigen::Vector3d> p_m, const FieldFrame& frame, double span_m) {
  FT_CHECK(!p_m.empty() && span_m > 0.0);
  SplineLattice lattice;
  lattice.frame_ = frame;
  lattice.low_m_.setConstant(HUGE_VAL);
  lattice.high_m_.setConstant(-HUGE_VAL);
  for (const Eigen::Vector3d& place_m : p_m) {
    const Eigen::Vector3d u_m = frame.local(place_m);
    lattice.low_m_ = lattice.low_m_.cwiseMin(u_m);
    lattice.high_m_ = lattice.high_m_.cwiseMax(u_m);
  }
  for (int axis = 0; axis < 3; ++axis) {
    const double extent_m = lattice.high_m_[axis] - lattice.low_m_[axis];
    const bool is_used = axis < frame.dimension;
    lattice.spans_[static_cast<std::size_t>(axis)] =
        is_used ? std::max(1, static_cast<int>(std::lround(extent_m / span_m))) : 0;
    if (!(extent_m > 0.0)) lattice.high_m_[axis] = lattice.low_m_[axis] + 1.0;
  }
  return lattice;
}

Eigen::Index SplineLattice::functionsAlong(int axis) const {
  const int spans = spans_[static_cast<std::size_t>(axis)];
  return spans == 0 ? 1 : spans + 3;
}

double SplineLattice::span_m(int axis) const {
  return (high_m_[axis] - low_m_[axis]) / std::max(1, spans_[static_cast<std::size_t>(axis)]);
}

Eigen::Index SplineLattice::size() const { return functionsAlong(0) * functionsAlong(1) * functionsAlong(2); }

SplineWeights SplineLattice::weights(const Eigen::Vector3d& u_m, const std::array<int, 3>& order) const {
  std::array<std::array<double, 4>, 3> along{};
  std::array<Eigen::Index, 3> first{};
  std::array<int, 3> count{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    if (spans_[a] == 0) {
      along[a][0] = order[a] == 0 ? 1.0 : 0.0;
      count[a] = 1;
      continue;
    }
    const double position = (u_m[axis] - low_m_[axis]) / span_m(axis);
    const double span = std::clamp(std::floor(position), 0.0, static_cast<double>(spans_[a] - 1));
    along[a] = cubicWeights(position - span, order[a]);
    if (order[a] == 1)
      for (double& weight : along[a]) weight /= span_m(axis);
    first[a] = static_cast<Eigen::Index>(span);
    count[a] = 4;
  }
  SplineWeights weights;
  for (int i = 0; i < count[0]; ++i)
    for (int j = 0; j < count[1]; ++j)
      for (int k = 0; k < count[2]; ++k) {
        const auto next = static_cast<std::size_t>(weights.count++);
        weights.index[next] = ((first[0] + i) * functionsAlong(1) + first[1] + j) * functionsAlong(2) + first[2] + k;
        weights.value[next] = along[0][static_cast<std::size_t>(i)] * along[1][static_cast<std::size_t>(j)] *
                              along[2][static_cast<std::size_t>(k)];
      }
  return weights;
}

Eigen::MatrixXd SplineLattice::bendingPenalty() const {
  Matrix penalty = Matrix::Zero(size(), size());
  for (int a = 0; a < 3; ++a)
    for (int b = a; b < 3; ++b) {
      std::array<Matrix, 3> factors;
      double scale = 1.0;
      for (int axis = 0; axis < 3; ++axis) {
        const int order = (axis == a ? 1 : 0) + (axis == b ? 1 : 0);
        const Eigen::Index n = functionsAlong(axis);
        factors[static_cast<std::size_t>(axis)] =
            order == 0 ? Matrix(Matrix::Identity(n, n)) : differencePenalty(n, order);
        scale /= std::pow(span_m(axis), 2 * order);
      }
      addProduct(factors[0], factors[1], factors[2], (a == b ? 1.0 : 2.0) * scale, penalty);
    }
  return penalty;
}

nlohmann::json SplineLattice::toJson() const {
  return {{"frame", frame_.toJson()}, {"low_m", jsonOf(low_m_)}, {"high_m", jsonOf(high_m_)}, {"spans", spans_}};
}

SplineLattice SplineLattice::fromJson(const JsonReader& json) {
  constexpr int kMostSpans = 1000;
  SplineLattice lattice;
  lattice.frame_ = FieldFrame::fromJson(json["frame"]);
  lattice.low_m_ = json["low_m"].vector3();
  lattice.high_m_ = json["high_m"].vector3();
  lattice.spans_ = json["spans"].integers3();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int least = static_cast<int>(axis) < lattice.frame_.dimension ? 1 : 0;
    const auto a = static_cast<int>(axis);
    if (lattice.spans_[axis] < least || lattice.spans_[axis] > kMostSpans || !(lattice.high_m_[a] > lattice.low_m_[a]))
      json.fail("needs a box with at least one span along every axis.");
  }
  return lattice;
}

SplineField::SplineField(SplineLattice lattice, const Eigen::MatrixXd& coefficients, const Eigen::MatrixXd& trend)
    : lattice_(std::move(lattice)) {
  FT_CHECK(coefficients.rows() == lattice_.size() && coefficients.cols() == 3);
  FT_CHECK(trend.rows() == 1 + lattice_.frame().dimension && trend.cols() == 3);
  coefficients_ = coefficients.transpose();
  trend_.setZero();
  trend_.topRows(trend.rows()) = trend;
}

Eigen::Vector3d SplineField::sum(const Eigen::Vector3d& u_m, const std::array<int, 3>& order) const {
  const SplineWeights weights = lattice_.weights(u_m, order);
  Eigen::Vector3d total = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < static_cast<std::size_t>(weights.count); ++k)
    total += weights.value[k] * coefficients_.col(weights.index[k]);
  return total;
}

Eigen::Vector3d SplineField::value(const Eigen::Vector3d& p_m) const {
  const Eigen::Vector3d u_m = lattice_.frame().local(p_m);
  const Eigen::Vector3d inside_m = lattice_.clamped(u_m);
  Eigen::Vector3d total = trend_.row(0).transpose() + trend_.bottomRows<3>().transpose() * u_m + sum(inside_m, {});
  for (int axis = 0; axis < lattice_.frame().dimension; ++axis) {
    const double beyond_m = u_m[axis] - inside_m[axis];
    if (beyond_m == 0.0) continue;
    std::array<int, 3> order{};
    order[static_cast<std::size_t>(axis)] = 1;
    total += beyond_m * sum(inside_m, order);
  }
  return total;
}

Eigen::Matrix3d SplineField::gradient(const Eigen::Vector3d& p_m) const {
  const Eigen::Vector3d u_m = lattice_.frame().local(p_m);
  const Eigen::Vector3d inside_m = lattice_.clamped(u_m);
  Eigen::Matrix3d local_gradient = trend_.bottomRows<3>().transpose();
  for (int axis = 0; axis < lattice_.frame().dimension; ++axis) {
    std::array<int, 3> order{};
    order[static_cast<std::size_t>(axis)] = 1;
    local_gradient.col(axis) += sum(inside_m, order);
    // Along an axis that has not left the box, the slopes of those that have still change.
    if (u_m[axis] != inside_m[axis]) continue;
    for (int other = 0; other < lattice_.frame().dimension; ++other) {
      const double beyond_m = u_m[other] - inside_m[other];
      if (other == axis || beyond_m == 0.0) continue;
      std::array<int, 3> mixed = order;
      mixed[static_cast<std::size_t>(other)] = 1;
      local_gradient.col(axis) += beyond_m * sum(inside_m, mixed);
    }
  }
  return local_gradient * lattice_.frame().per_m.asDiagonal() * lattice_.frame().axes.transpose();
}

nlohmann::json SplineField::toJson() const {
  nlohmann::json json = lattice_.toJson();
  json["coefficients"] = jsonOf(Matrix(coefficients_.transpose()));
  json["trend"] = jsonOf(Matrix(trend_.topRows(1 + lattice_.frame().dimension)));
  return json;
}

SplineField SplineField::fromJson(const JsonReader& json) {
  SplineLattice lattice = SplineLattice::fromJson(json);
  const Matrix coefficients = json["coefficients"].matrix(3);
  const Matrix trend = json["trend"].matrix(3);
  if (coefficients.rows() != lattice.size() || trend.rows() != 1 + lattice.frame().dimension)
    json.fail("needs one coefficient for each function of the lattice and a trend of the frame's dimension.");
  return SplineField(std::move(lattice), coefficients, trend);
}

}  // namespace fieldtrue::correctors
