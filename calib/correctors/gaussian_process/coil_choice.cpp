#include "calib/correctors/gaussian_process/coil_choice.h"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <cstdio>

namespace fieldtrue::correctors {
namespace {

/// What coils of trackers differ by before it is known: a per cent or two; three times that turns.
constexpr double kStrainSd = 0.02;
constexpr double kTurningStrainSd = 0.06;
constexpr double kStrainParameters = 6.0;

struct CoilFit {
  SensorCoils coils;
  double nats = 0.0;  ///< Of the strain, over none.
};

/// The three axes of a row have one strain in common: their columns of the design matrix, row by row.
std::array<Eigen::MatrixXd, 3> designOf(const PoseRows& rows, CoilEffect effect) {
  std::array<Eigen::MatrixXd, 3> design;
  for (Eigen::MatrixXd& axis : design) axis.resize(static_cast<Eigen::Index>(rows.size()), 6);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Eigen::Matrix<double, 3, 6> derivative = coilDerivative(effect, {rows.p_m[i], rows.q[i]});
    for (std::size_t axis = 0; axis < 3; ++axis)
      design[axis].row(static_cast<Eigen::Index>(i)) = derivative.row(static_cast<Eigen::Index>(axis));
  }
  return design;
}

/// Under a normal prior of the strain, with the scales of the process given.
std::optional<CoilFit> fitCoils(const PoseSystem& system, CoilEffect effect, const PoseScales& scales,
                                std::span<const std::size_t> used) {
  const double strain_sd = effect == CoilEffect::kShift ? kStrainSd : kTurningStrainSd;
  const PoseRows rows = system.rows.only(used);
  const auto projection = TailProjection::of(system.frame.tail(rows.p_m));
  if (!projection) return std::nullopt;
  Eigen::LLT<Eigen::MatrixXd> factor(projection->projected(poseCovariance(system.kernel, system.frame, scales, rows)));
  if (factor.info() != Eigen::Success) return std::nullopt;
  const std::array<Eigen::MatrixXd, 3> design = designOf(rows, effect);
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Identity() / (strain_sd * strain_sd);
  CoilStrain right_side = CoilStrain::Zero();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Eigen::VectorXd y(rows.p_m.size());
    for (std::size_t i = 0; i < used.size(); ++i)
      y[static_cast<Eigen::Index>(i)] =
          system.displacement_m(static_cast<Eigen::Index>(used[i]), static_cast<Eigen::Index>(axis));
    const Eigen::MatrixXd weighted = factor.matrixL().solve(projection->toComplement(design[axis]));
    const Eigen::VectorXd whitened = factor.matrixL().solve(projection->toComplement(y));
    information += weighted.transpose() * weighted;
    right_side += weighted.transpose() * whitened;
  }
  const Eigen::LLT<Eigen::Matrix<double, 6, 6>> of_strain(information);
  CoilFit fit;
  fit.coils.effect = effect;
  fit.coils.strain = of_strain.solve(right_side);
  fit.coils.covariance = of_strain.solve(Eigen::Matrix<double, 6, 6>::Identity());
  const double log_volume =
      2.0 * of_strain.matrixLLT().diagonal().array().log().sum() + 2.0 * kStrainParameters * std::log(strain_sd);
  fit.nats = 0.5 * (right_side.dot(fit.coils.strain) - log_volume);
  return fit;
}

PoseSystem without(const PoseSystem& system, const SensorCoils& coils) {
  PoseSystem rest;
  rest.kernel = system.kernel;
  rest.frame = system.frame;
  rest.rows = system.rows;
  rest.tracked_m = system.tracked_m;
  rest.displacement_m = system.displacement_m;
  for (std::size_t i = 0; i < system.rows.size(); ++i)
    rest.displacement_m.row(static_cast<Eigen::Index>(i)) -=
        coils.at({system.rows.p_m[i], system.rows.q[i]}).transpose();
  return rest;
}

std::string noteOf(const SensorCoils& coils, double nats, double before_m, double after_m) {
  const CoilStrain& e = coils.strain;
  std::array<char, 224> text{};
  std::snprintf(
      text.data(), text.size(),
      "Takes what unequal coils would do: gains %+.2f, %+.2f and %+.2f %% about their mean, skew %+.2f, %+.2f and "
      "%+.2f %%; %.0f nats over none, held-out RMS %.3g mm against %.3g mm.",
      100.0 * (e[0] - (e[0] + e[1] + e[2]) / 3.0), 100.0 * (e[1] - (e[0] + e[1] + e[2]) / 3.0),
      100.0 * (e[2] - (e[0] + e[1] + e[2]) / 3.0), 100.0 * e[3], 100.0 * e[4], 100.0 * e[5], nats, 1000.0 * after_m,
      1000.0 * before_m);
  return text.data();
}

}  // namespace

Result<CoilChoice> chooseCoils(const PoseSystem& system, CoilEffect effect, const GaussianProcessScales& start,
                               std::span<const std::size_t> used, double spacing_m, const RunControl& control) {
  const auto before = rowScales(system, start, used, spacing_m, control);
  const auto first = before ? fitCoils(system, effect, *before, used) : std::nullopt;
  if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "Stopped on request");
  if (!first || first->nats < kNatsAParameter * kStrainParameters) return CoilChoice{};
  // Scales that need not explain the coils weigh the rows better.
  const auto after = rowScales(without(system, first->coils), before->field, used, spacing_m, control);
  auto second = after ? fitCoils(system, effect, *after, used) : std::nullopt;
  if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "Stopped on request");
  if (!second) return CoilChoice{};
  const double before_m = heldOutRms_m(system, *before, used);
  const double after_m = heldOutRms_m(without(system, second->coils), *after, used);
  if (!(after_m < kClearlyLess * before_m)) return CoilChoice{};
  second->coils.left_sd_m = after->row_sd_m;
  return CoilChoice{second->coils, noteOf(second->coils, first->nats, before_m, after_m)};
}

}  // namespace fieldtrue::correctors
