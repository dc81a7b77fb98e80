#include "calib/identify/linearized_model.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "calib/core/statistics.h"
#include "calib/field/tracker_model.h"
#include "calib/identify/whitened_fields.h"

namespace fieldtrue::identify {
namespace {

bool hasFreeAlignment(const GapRows& rows) {
  return !rows.alignment_known || rows.alignment_tolerance_m > 0.0 || rows.alignment_tolerance_rad > 0.0;
}

field::EffectResponse moved(const Eigen::Vector3d& shift_m, const Eigen::Vector3d& turn_rad) {
  field::EffectResponse response;
  response.shift_m = shift_m;
  response.turn_rad = turn_rad;
  return response;
}

/// Whether the arm from the mount to a sensor is a parameter: of the first it moves the places as the rig's shift does,
/// unless the sensor is turned.
bool hasArm(const GapRows& rows, std::size_t sensor) { return sensor > 0 || rows.several_orientations; }

/// What the alignment's parameters do at a setting: shift 3, rotation about the centre 3, then of each sensor its
/// mounting 3 and its arm 3.
std::vector<field::EffectResponse> alignmentResponses(const field::SensorSetting& setting, std::size_t sensor,
                                                      const Eigen::Vector3d& center_m, const GapRows& rows) {
  std::vector<field::EffectResponse> responses;
  if (!hasFreeAlignment(rows)) return responses;
  const Eigen::Matrix3d R = setting.tracker_from_sensor.orientation.toRotationMatrix();
  const Eigen::Vector3d arm_m = setting.tracker_from_sensor.position_m - center_m;
  for (int k = 0; k < 3; ++k) responses.push_back(moved(Eigen::Vector3d::Unit(k), Eigen::Vector3d::Zero()));
  for (int k = 0; k < 3; ++k)
    responses.push_back(moved(Eigen::Vector3d::Unit(k).cross(arm_m), Eigen::Vector3d::Unit(k)));
  if (rows.alignment_known) return responses;
  for (std::size_t s = 0; s < rows.sensors.size(); ++s) {
    const Eigen::Matrix3d own = s == sensor ? R : Eigen::Matrix3d::Zero();
    if (rows.has_orientation)
      for (int k = 0; k < 3; ++k) responses.push_back(moved(Eigen::Vector3d::Zero(), own.col(k)));
    if (hasArm(rows, s))
      for (int k = 0; k < 3; ++k) responses.push_back(moved(own.col(k), Eigen::Vector3d::Zero()));
  }
  return responses;
}

}  // namespace

Eigen::MatrixXd spanOf(Eigen::MatrixXd columns) {
  if (columns.cols() == 0) return columns;
  for (Eigen::Index j = 0; j < columns.cols(); ++j) {
    const double norm = columns.col(j).norm();
    if (norm > 0.0) columns.col(j) /= norm;
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(columns);
  qr.setThreshold(1e-7);
  return qr.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), qr.rank());
}

Whitening makeWhitening(const GapRows& rows, double placing_sd_m, double placing_sd_rad) {
  Whitening whitening;
  for (const GapRow& row : rows.rows) {
    const Matrix6d noise = noiseOf(row, placing_sd_m, placing_sd_rad);
    const Eigen::LLT<Eigen::Matrix3d> factor(noise.topLeftCorner<3, 3>());
    whitening.position.push_back(factor.matrixL().solve(Eigen::Matrix3d::Identity()));
    whitening.rotation.push_back(1.0 / std::sqrt(noise(3, 3)));
  }
  return whitening;
}

std::vector<Vector6d> whitened(std::vector<Vector6d> residuals, const Whitening& whitening) {
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    residuals[i].head<3>() = (whitening.position[i] * residuals[i].head<3>()).eval();
    residuals[i].tail<3>() *= whitening.rotation[i];
  }
  return residuals;
}

Eigen::Vector3d alignmentCenter_m(std::span<const field::SensorSetting> settings) {
  Eigen::Vector3d sum_m = Eigen::Vector3d::Zero();
  for (const field::SensorSetting& setting : settings) sum_m += setting.tracker_from_sensor.position_m;
  return sum_m / static_cast<double>(std::max<std::size_t>(1, settings.size()));
}

void applyAlignmentStep(const Eigen::VectorXd& step, const Eigen::Vector3d& center_m, const GapRows& rows,
                        GapAlignment& alignment) {
  if (step.size() < 6) return;
  const Eigen::Quaterniond turn = rotationFromVector(step.segment<3>(3));
  Pose& rig = alignment.tracker_from_reference;
  rig.position_m = turn * (rig.position_m - center_m) + center_m + step.head<3>();
  rig.orientation = (turn * rig.orientation).normalized();
  Eigen::Index at = 6;
  if (rows.alignment_known) return;
  for (std::size_t s = 0; s < rows.sensors.size(); ++s) {
    Pose& mount = alignment.mount_from_sensor[s];
    if (rows.has_orientation) {
      mount.orientation = (mount.orientation * rotationFromVector(step.segment<3>(at))).normalized();
      at += 3;
    }
    if (hasArm(rows, s)) {
      mount.position_m += mount.orientation * step.segment<3>(at);
      at += 3;
    }
  }
}

Vector6d alignmentDeviation(const GapAlignment& alignment, const GapRows& rows, const Eigen::Vector3d& center_m) {
  const Pose change = alignment.tracker_from_reference * inverse(rows.stated_tracker_from_reference);
  Vector6d deviation;
  deviation.head<3>() = change * center_m - center_m;
  deviation.tail<3>() = rotationVector_rad(change.orientation);
  return deviation;
}

namespace {

constexpr double kLeastTolerance = 1e-6;
constexpr double kFarthestInTolerances = 2.5;

Eigen::Vector3d shortened(const Eigen::Vector3d& v, double longest) {
  const double length = v.norm();
  return length > longest ? Eigen::Vector3d(v * (longest / length)) : v;
}

}  // namespace

bool keepNearStated(const GapRows& rows, const Eigen::Vector3d& center_m, GapAlignment& alignment) {
  const Vector6d deviation = alignmentDeviation(alignment, rows, center_m);
  const double farthest_m = kFarthestInTolerances * std::max(kLeastTolerance, rows.alignment_tolerance_m);
  const double farthest_rad = kFarthestInTolerances * std::max(kLeastTolerance, rows.alignment_tolerance_rad);
  if (deviation.head<3>().norm() <= farthest_m && deviation.tail<3>().norm() <= farthest_rad) return false;
  const Eigen::Quaterniond turn = rotationFromVector(shortened(deviation.tail<3>(), farthest_rad));
  const Pose& stated = rows.stated_tracker_from_reference;
  Pose& rig = alignment.tracker_from_reference;
  rig.position_m = turn * (stated.position_m - center_m) + center_m + shortened(deviation.head<3>(), farthest_m);
  rig.orientation = (turn * stated.orientation).normalized();
  return true;
}

double alignmentCost(const GapPhysics& physics, const GapAlignment& alignment) {
  const GapRows& rows = physics.rows();
  if (!rows.alignment_known || !hasFreeAlignment(rows)) return 0.0;
  const Vector6d deviation = alignmentDeviation(alignment, rows, alignmentCenter_m(physics.settings(alignment)));
  return deviation.head<3>().squaredNorm() / std::pow(std::max(kLeastTolerance, rows.alignment_tolerance_m), 2) +
         deviation.tail<3>().squaredNorm() / std::pow(std::max(kLeastTolerance, rows.alignment_tolerance_rad), 2);
}

LinearPrior priorOf(const effects::EffectFit& fit) {
  const std::vector<effects::FitParameter> linear = fit.linear();
  LinearPrior prior;
  prior.precision = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(linear.size()));
  const bool is_searched = !fit.searched().empty();
  if (linear.size() == 1 && (is_searched || linear.front().low >= 0.0)) {
    prior.low = linear.front().low;
    prior.high = linear.front().high;
  } else if (!is_searched) {
    for (std::size_t j = 0; j < linear.size(); ++j)
      prior.precision[static_cast<Eigen::Index>(j)] = 1.0 / (linear[j].high * linear[j].high);
  }
  return prior;
}

bool isBentStrongly(const GapRows& rows, std::span<const Vector6d> moved, const Whitening& whitening) {
  constexpr double kStrongly = 5.0;  // RMS, in noise.
  constexpr double kMissed = 1.0;    // In noise.
  constexpr double kOfRows = 0.9;
  constexpr double kDipole = 3.0;  // Its field falls with the third power of the distance.
  const double unit = std::sqrt(static_cast<double>(rows.channels()));
  const std::vector<Vector6d> white = whitened({moved.begin(), moved.end()}, whitening);
  double squares = 0.0;
  std::vector<double> missed;
  for (std::size_t i = 0; i < white.size(); ++i) {
    const double distance_m = rows.rows[i].tracker_from_sensor.position_m.norm();
    const double bent = std::max(kDipole * moved[i].head<3>().norm() / distance_m, moved[i].tail<3>().norm());
    const double size = white[i].norm() / unit;
    squares += size * size;
    missed.push_back(bent * size);
  }
  if (missed.empty()) return false;
  return squares > kStrongly * kStrongly * static_cast<double>(missed.size()) ||
         quantile(std::move(missed), kOfRows) > kMissed;
}

namespace {

/// Reported minus actual poses: what effects do to them [m, rad].
std::vector<Vector6d> movedBy(std::span<const field::SensorSetting> at, std::span<const Pose> reported, int channels) {
  std::vector<Vector6d> moved(at.size(), Vector6d::Zero());
  for (std::size_t i = 0; i < at.size(); ++i) {
    const Pose& actual = at[i].tracker_from_sensor;
    moved[i].head<3>() = reported[i].position_m - actual.position_m;
    if (channels == 6)
      moved[i].tail<3>() = rotationVector_rad(reported[i].orientation * actual.orientation.conjugate());
  }
  return moved;
}

}  // namespace

Linearized::Linearized(const GapPhysics& physics, const GapModel& state, const Whitening& whitening,
                       std::span<const int> block, ResponseAt response, std::vector<Pose> predicted)
    : channels_(physics.rows().channels()), order_(physics.size()) {
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  std::stable_sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) { return block[a] < block[b]; });
  const std::vector<field::SensorSetting> at = physics.settings(state.alignment);
  const std::vector<Pose> reported = predicted.empty() ? physics.predictions(state) : std::move(predicted);
  const std::vector<Vector6d> residuals = physics.residuals(reported);
  const auto n = static_cast<Eigen::Index>(order_.size());
  const GapRows& rows = physics.rows();
  n_prior_ = rows.alignment_known && hasFreeAlignment(rows) ? 6 : 0;
  residual_ = Eigen::VectorXd::Zero(n * channels_ + n_prior_);
  const bool is_half_way = response == ResponseAt::kHalfWayIfBent && isBentStrongly(rows, residuals, whitening);
  const double way = is_half_way ? 0.5 : 1.0;
  for (std::size_t k = 0; k < order_.size(); ++k) {
    const std::size_t i = order_[k];
    settings_.push_back(at[i]);
    white_position_.push_back(whitening.position[i]);
    white_rotation_.push_back(whitening.rotation[i]);
    const Eigen::Vector3d from_m = rows.rows[i].tracker_from_sensor.position_m - way * residuals[i].head<3>();
    white_by_field_.push_back(whiteOf(k, field::poseByField(from_m)));
    const Eigen::Index row = static_cast<Eigen::Index>(k) * channels_;
    residual_.segment<3>(row) = white_position_.back() * residuals[i].head<3>();
    if (channels_ == 6) residual_.segment<3>(row + 3) = white_rotation_.back() * residuals[i].tail<3>();
    const int b = block[i];
    if (static_cast<std::size_t>(b) >= segments_.size()) segments_.push_back({row, 0});
    segments_.back().count += channels_;
  }
  if (isBentStrongly(rows, movedBy(at, reported, channels_), whitening)) bend(physics, state, reported);
  addAlignment(rows, state.alignment);
  addTerms(state);
}

template <int kColumns>
Eigen::Matrix<double, 6, kColumns> Linearized::whiteOf(std::size_t k,
                                                       const Eigen::Matrix<double, 6, kColumns>& change) const {
  Eigen::Matrix<double, 6, kColumns> white;
  white.template topRows<3>() = white_position_[k] * change.template topRows<3>();
  white.template bottomRows<3>() = white_rotation_[k] * change.template bottomRows<3>();
  return white;
}

/// Where the state's own effects bend strongly, what moves the sensor is not reported as it is: the field that it moves
/// in is not the one that the tracker knows, and the tracker sees it turned. With the field F at the sensor,
/// G(reported) = Q F, Q from the actual to the reported orientation; so d reported = poseByField(reported) Q dF.
void Linearized::bend(const GapPhysics& physics, const GapModel& state, std::span<const Pose> reported) {
  constexpr double kStep_m = 1e-4;
  const std::vector<field::EffectResponse> here = physics.responses(state, settings_);
  std::vector<Eigen::Matrix<double, 6, 6>> by_placing(settings_.size(), Eigen::Matrix<double, 6, 6>::Zero());
  std::vector<Eigen::Matrix<double, 6, 9>> by_field;
  for (std::size_t k = 0; k < settings_.size(); ++k) {
    const Pose& pose = reported[order_[k]];
    const Eigen::Quaterniond actual = field::displaced(settings_[k].tracker_from_sensor, here[k]).orientation;
    const Eigen::Matrix3d turn = (pose.orientation * actual.conjugate()).toRotationMatrix();
    by_field.push_back(field::poseByField(pose.position_m));
    for (int coil = 0; coil < 3; ++coil)
      by_field[k].middleCols<3>(3 * coil) = (by_field[k].middleCols<3>(3 * coil) * turn).eval();
    by_placing[k].bottomRightCorner<3, 3>() = turn;
  }
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<field::SensorSetting> aside = settings_;
    for (field::SensorSetting& one : aside) one.tracker_from_sensor.position_m[axis] += kStep_m;
    const std::vector<field::EffectResponse> there = physics.responses(state, aside);
    for (std::size_t k = 0; k < settings_.size(); ++k) {
      const Eigen::Matrix3d slope =
          (field::totalField_per_m3(aside[k], there[k]) - field::totalField_per_m3(settings_[k], here[k])) / kStep_m;
      by_placing[k].col(axis) = by_field[k] * Eigen::Map<const Eigen::Matrix<double, 9, 1>>(slope.data());
    }
  }
  for (std::size_t k = 0; k < settings_.size(); ++k) {
    white_by_field_[k] = whiteOf(k, by_field[k]);
    white_by_placing_.push_back(whiteOf(k, by_placing[k]));
  }
}

void Linearized::addAlignment(const GapRows& rows, const GapAlignment& alignment) {
  const Eigen::Vector3d center_m = alignmentCenter_m(settings_);
  std::vector<field::EffectResponse> responses;
  for (std::size_t k = 0; k < settings_.size(); ++k) {
    const std::vector<field::EffectResponse> at =
        alignmentResponses(settings_[k], rows.rows[order_[k]].sensor, center_m, rows);
    responses.insert(responses.end(), at.begin(), at.end());
  }
  n_alignment_ = static_cast<int>(responses.size() / settings_.size());
  nuisance_ = columnsOf(responses, n_alignment_);
  if (n_prior_ == 0) return;
  const Vector6d deviation = alignmentDeviation(alignment, rows, center_m);
  for (Eigen::Index k = 0; k < 6; ++k) {
    const double tolerance =
        std::max(kLeastTolerance, k < 3 ? rows.alignment_tolerance_m : rows.alignment_tolerance_rad);
    nuisance_(residual_.size() - 6 + k, k) = 1.0 / tolerance;
    residual_[residual_.size() - 6 + k] = -deviation[k] / tolerance;
  }
}

void Linearized::addTerms(const GapModel& state) {
  for (const GapTerm& term : state.terms) {
    const Eigen::MatrixXd linear = columns(*term.fit, term.searched);
    const Eigen::Index dim = term.searched.size();
    Eigen::MatrixXd all(size(), linear.cols() + dim);
    all.leftCols(linear.cols()) = linear;
    const std::vector<effects::FitParameter> bounds = term.fit->searched();
    for (Eigen::Index d = 0; d < dim; ++d) {
      const effects::FitParameter& bound = bounds[static_cast<std::size_t>(d)];
      const double h = 1e-4 * std::max(1e-3, std::min(1.0, bound.high - bound.low));
      Eigen::VectorXd shifted = term.searched;
      shifted[d] += h;
      all.col(linear.cols() + d) = (columns(*term.fit, shifted) - linear) * term.linear / h;
    }
    nuisance_.conservativeResize(Eigen::NoChange, nuisance_.cols() + all.cols());
    nuisance_.rightCols(all.cols()) = all;
  }
}

/// What moves the sensor adds to the whitened change of a row.
Eigen::Matrix<double, 6, 1> Linearized::whitenedPlacing(std::size_t k, const field::EffectResponse& response) const {
  if (!white_by_placing_.empty())
    return white_by_placing_[k].leftCols<3>() * response.shift_m +
           white_by_placing_[k].rightCols<3>() * response.turn_rad;
  Eigen::Matrix<double, 6, 1> change;
  change << white_position_[k] * response.shift_m, white_rotation_[k] * response.turn_rad;
  return change;
}

Eigen::MatrixXd Linearized::columnsOf(std::span<const field::EffectResponse> responses, Eigen::Index parameters) const {
  static_assert(sizeof(field::EffectResponse) % sizeof(double) == 0);
  Eigen::MatrixXd columns(size(), parameters);
  columns.bottomRows(n_prior_).setZero();
  const auto m = static_cast<std::size_t>(parameters);
  if (order_.empty() || m == 0) return columns;
  whitenFields({white_by_field_.front().data(), responses.front().field_per_m3.data(),
                sizeof(field::EffectResponse) / sizeof(double), order_.size(), m, static_cast<std::size_t>(channels_)},
               columns.data(), static_cast<std::size_t>(size()));
  for (std::size_t i = 0; i < order_.size() * m; ++i) {
    const field::EffectResponse& response = responses[i];
    if (response.shift_m.isZero(0.0) && response.turn_rad.isZero(0.0)) continue;
    columns.col(static_cast<Eigen::Index>(i % m)).segment(static_cast<Eigen::Index>(i / m) * channels_, channels_) +=
        whitenedPlacing(i / m, response).head(channels_);
  }
  return columns;
}

Linearized Linearized::withResidual(Eigen::VectorXd residual) const {
  Linearized other = *this;
  other.residual_ = std::move(residual);
  return other;
}

Eigen::MatrixXd Linearized::columns(const effects::EffectFit& fit, const Eigen::VectorXd& searched) const {
  const std::size_t m = fit.linear().size();
  std::vector<field::EffectResponse> responses(settings_.size() * m);
  fit.respond(settings_, searched, responses);
  return columnsOf(responses, static_cast<Eigen::Index>(m));
}

}  // namespace fieldtrue::identify
