#include "calib/correctors/gaussian_process/pose_covariance.h"

#include <array>
#include <cmath>

#include "calib/correctors/multiquadric/hmq_kernel.h"
#include "calib/correctors/numerics/dense_solver.h"

namespace fieldtrue::correctors {
namespace {

/// Positions in a frame, as arrays.
struct LocalRows {
  std::array<std::vector<double>, 3> u;

  LocalRows(const FieldFrame& frame, std::span<const Eigen::Vector3d> p_m) {
    for (const Eigen::Vector3d& at_m : p_m) {
      const Eigen::Vector3d local = frame.local(at_m);
      for (std::size_t axis = 0; axis < 3; ++axis) u[axis].push_back(local[static_cast<int>(axis)]);
    }
  }
  /// Squared distances of row j to those after it.
  void squaredDistancesBelow(std::size_t j, double* squares) const {
    const std::array<double, 3> center = {u[0][j], u[1][j], u[2][j]};
    squaredDistances({u[0].data() + j + 1, u[1].data() + j + 1, u[2].data() + j + 1, u[0].size() - j - 1},
                     center.data(), squares);
  }
};

double squared(double value) { return value * value; }

template <class Value>
std::vector<Value> picked(const std::vector<Value>& values, std::span<const std::size_t> rows) {
  std::vector<Value> result;
  result.reserve(rows.size());
  for (const std::size_t row : rows) result.push_back(values[row]);
  return result;
}

}  // namespace

PoseRows PoseRows::without(std::span<const std::size_t> out) const {
  return {withoutPlaces(p_m, out), withoutPlaces(q, out), withoutPlaces(place, out), withoutPlaces(noise_m2, out),
          placing_m2};
}

PoseRows PoseRows::only(std::span<const std::size_t> kept) const {
  return {picked(p_m, kept), picked(q, kept), picked(place, kept), picked(noise_m2, kept), placing_m2};
}

FieldFrame turnFrame(const FieldFrame& frame, const PoseScales& scales) {
  FieldFrame turned = scaledFrame(frame, scales.field);
  turned.per_m /= scales.turn_stretch;
  return turned;
}

Eigen::MatrixXd poseCovariance(RadialKernel kernel, const FieldFrame& frame, const PoseScales& scales,
                               const PoseRows& rows) {
  const double signal_m2 = squared(scales.field.signal_sd_m);
  const double turn_m2 = squared(scales.turn_sd_m);
  const double of_place_m2 = rows.placing_m2 + squared(scales.field.nugget_sd_m);
  const LocalRows local(scaledFrame(frame, scales.field), rows.p_m);
  const auto n = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd covariance(n, n);
  Eigen::VectorXd q(n), turned(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto row = static_cast<std::size_t>(j);
    const auto count = static_cast<std::size_t>(n - j - 1);
    local.squaredDistancesBelow(row, q.data());
    auto below = covariance.col(j).tail(n - j - 1);
    radialValues(kernel, 0.0, q.data(), count, below.data());
    below *= signal_m2;
    if (turn_m2 > 0.0) {
      q.head(n - j - 1) /= squared(scales.turn_stretch);
      radialValues(kernel, 0.0, q.data(), count, q.data());
      turned.head(n - j - 1) =
          turnCorrelation(kernel, scales.turn_length_rad, rows.q[row], std::span(rows.q).subspan(row + 1));
      below.array() += turn_m2 * q.head(n - j - 1).array() * turned.head(n - j - 1).array();
    }
    for (std::size_t i = 0; i < count; ++i)
      if (rows.place[row + 1 + i] == rows.place[row]) below[static_cast<Eigen::Index>(i)] += of_place_m2;
    covariance(j, j) = (1.0 + kGaussianProcessJitter) * (signal_m2 + turn_m2 + of_place_m2) + rows.noise_m2[row] +
                       squared(scales.row_sd_m);
  }
  return covariance;
}

PoseScales poseScalesOf(std::span<const double> parameters) {
  PoseScales scales{scalesOf(parameters), std::exp(parameters[kFieldParameters])};
  if (parameters.size() == PoseLikelihood::kPositionParameters) return scales;
  const auto turn = parameters.subspan(PoseLikelihood::kPositionParameters);
  scales.turn_sd_m = std::exp(turn[0]);
  scales.turn_stretch = std::exp(turn[1]);
  scales.turn_length_rad = std::exp(turn[2]);
  return scales;
}

std::optional<PoseLikelihood> PoseLikelihood::of(RadialKernel kernel, const FieldFrame& frame, PoseRows rows,
                                                 const Eigen::MatrixXd& y) {
  FT_CHECK(y.rows() == static_cast<Eigen::Index>(rows.size()) && y.cols() == 3 && rows.q.size() == rows.size());
  PoseLikelihood likelihood;
  likelihood.projection_ = TailProjection::of(frame.tail(rows.p_m));
  if (!likelihood.projection_) return std::nullopt;
  likelihood.kernel_ = kernel;
  likelihood.frame_ = frame;
  likelihood.rows_ = std::move(rows);
  likelihood.projected_y_ = likelihood.projection_->toComplement(y);
  likelihood.residual_variance_m2_ =
      likelihood.projected_y_.squaredNorm() / static_cast<double>(likelihood.projected_y_.size());
  return likelihood;
}

std::optional<double> PoseLikelihood::evaluate(std::span<const double> parameters, double* gradient) const {
  FT_CHECK(parameters.size() == kParameters || parameters.size() == kPositionParameters);
  const PoseScales scales = poseScalesOf(parameters);
  auto fit = restrictedFit(*projection_, poseCovariance(kernel_, frame_, scales, rows_), projected_y_);
  if (!fit) return std::nullopt;
  if (gradient != nullptr) {
    choleskyInverseInPlace(fit->factor);
    std::array<double, kParameters> slopes{};
    addGradient(projection_->lifted(fit->factor), projection_->fromComplement(fit->solved), scales, slopes.data());
    std::copy_n(slopes.begin(), parameters.size(), gradient);
  }
  return fit->value;
}

// As RestrictedLikelihood: sum_ij D_ij dK_ij / d theta with D = 3 P - (P Y)(P Y)^T; twice the lower triangle.
void PoseLikelihood::addGradient(const Eigen::MatrixXd& inverse, const Eigen::MatrixXd& weighted_y,
                                 const PoseScales& scales, double* gradient) const {
  const double signal_m2 = squared(scales.field.signal_sd_m);
  const double turn_m2 = squared(scales.turn_sd_m);
  const double per_stretch2 = 1.0 / squared(scales.turn_stretch);
  const LocalRows local(scaledFrame(frame_, scales.field), rows_.p_m);
  const std::size_t n = rows_.size();
  Eigen::ArrayXd q(static_cast<Eigen::Index>(n)), value(q.size()), slope(q.size()), turned_q(q.size());
  Eigen::ArrayXd turned(q.size()), turned_slope(q.size()), chord2(q.size()), turn(q.size()), turn_slope(q.size());
  for (std::size_t j = 0; j < n; ++j) {
    const auto column = static_cast<Eigen::Index>(j);
    const std::size_t count = n - j - 1;
    const auto below = static_cast<Eigen::Index>(count);
    const double diagonal = kOutputs * inverse(column, column) - weighted_y.row(column).squaredNorm();
    gradient[3] += 2.0 * signal_m2 * (1.0 + kGaussianProcessJitter) * diagonal;
    gradient[4] += 2.0 * squared(scales.field.nugget_sd_m) * (1.0 + kGaussianProcessJitter) * diagonal;
    gradient[5] += 2.0 * squared(scales.row_sd_m) * diagonal;
    gradient[6] += 2.0 * turn_m2 * (1.0 + kGaussianProcessJitter) * diagonal;
    const Eigen::ArrayXd d = 2.0 * (kOutputs * inverse.col(column).tail(below) -
                                    weighted_y.bottomRows(below) * weighted_y.row(column).transpose());
    for (std::size_t i = 0; i < count; ++i)
      if (rows_.place[j + 1 + i] == rows_.place[j])
        gradient[4] += 2.0 * squared(scales.field.nugget_sd_m) * d[static_cast<Eigen::Index>(i)];
    local.squaredDistancesBelow(j, q.data());
    radialValues(kernel_, 0.0, q.data(), count, value.data());
    radialSlopes(kernel_, 0.0, q.data(), count, slope.data());
    gradient[3] += 2.0 * signal_m2 * (d * value.head(below)).sum();
    Eigen::ArrayXd of_square = signal_m2 * d * slope.head(below);  // Of q / 2, in units of the lengths.
    if (turn_m2 > 0.0) {
      turned_q.head(below) = per_stretch2 * q.head(below);
      radialValues(kernel_, 0.0, turned_q.data(), count, turned.data());
      radialSlopes(kernel_, 0.0, turned_q.data(), count, turned_slope.data());
      squaredChords(scales.turn_length_rad, rows_.q[j], std::span(rows_.q).subspan(j + 1), chord2.data());
      radialValues(kernel_, 0.0, chord2.data(), count, turn.data());
      radialSlopes(kernel_, 0.0, chord2.data(), count, turn_slope.data());
      const Eigen::ArrayXd weighted = turn_m2 * d * turn.head(below);
      gradient[6] += 2.0 * (weighted * turned.head(below)).sum();
      gradient[7] -= (weighted * turned_slope.head(below) * turned_q.head(below)).sum();
      gradient[8] -= (turn_m2 * d * turned.head(below) * turn_slope.head(below) * chord2.head(below)).sum();
      of_square += per_stretch2 * weighted * turned_slope.head(below);
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Eigen::Map<const Eigen::ArrayXd> others(local.u[axis].data() + j + 1, below);
      gradient[axis] -= (of_square * (others - local.u[axis][j]).square()).sum();
    }
  }
}

}  // namespace fieldtrue::correctors
