#include "calib/correctors/harmonic/harmonic_field_linear.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>
#include <cmath>

#include "calib/core/error.h"
#include "calib/correctors/numerics/dense_solver.h"
#include "calib/field/dipole_field.h"
#include "calib/field/tracker_model.h"

namespace fieldtrue::correctors {
namespace {

const std::array<Eigen::Matrix3d, kPerSource>& symmetricTensors() {
  static const std::array<Eigen::Matrix3d, kPerSource> kTensors = [] {
    std::array<Eigen::Matrix3d, kPerSource> tensors;
    std::size_t next = 0;
    for (int a = 0; a < 3; ++a) {
      for (int b = a; b < 3; ++b) {
        Eigen::Matrix3d tensor = Eigen::Matrix3d::Zero();
        tensor(a, b) = tensor(b, a) = a == b ? 1.0 : std::sqrt(0.5);
        tensors[next++] = tensor;
      }
    }
    return tensors;
  }();
  return kTensors;
}

/// What excites a source: the transmitter's field there; at the transmitter, its coils themselves.
Eigen::Matrix3d excitationAt(const Eigen::Vector3d& at_m) {
  return at_m.isZero() ? Eigen::Matrix3d::Identity() : field::dipoleField(at_m, 1.0);
}

Eigen::MatrixXd allEffects(const PlaceDerivative& place, std::span<const ChosenSource> sources,
                           const Eigen::Vector3d& about_m) {
  const auto n_sources = kPerChosen * static_cast<Eigen::Index>(sources.size());
  Eigen::MatrixXd effects(3, n_sources + 6);
  for (std::size_t k = 0; k < sources.size(); ++k) {
    auto columns = effects.middleCols<kPerChosen>(kPerChosen * static_cast<Eigen::Index>(k));
    columns.leftCols<kPerSource>() = effectOfSource(place, sources[k].basis);
    columns.rightCols<3>() = effectOfMove(place, sources[k]);
  }
  effects.rightCols<6>() = effectOfMotion(place.at_m, about_m);
  return effects;
}

}  // namespace

SourceBasis::SourceBasis(const Eigen::Vector3d& source_at_m) : at_m(source_at_m) {
  const Eigen::Matrix3d excitation = excitationAt(at_m);
  for (Eigen::Index e = 0; e < kPerSource; ++e) {
    const Eigen::Matrix3d response = symmetricTensors()[static_cast<std::size_t>(e)] * excitation;
    responses.col(e) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(response.data());
  }
}

ChosenSource::ChosenSource(const FieldSource& source) : basis(source.at_m), response(source.response) {
  response_moved.fill(Eigen::Matrix3d::Zero());
  if (source.at_m.isZero()) return;
  constexpr double kStep_m = 1e-4;
  const Eigen::Matrix3d tensor = source.response * excitationAt(source.at_m).inverse();
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step_m = kStep_m * Eigen::Vector3d::Unit(axis);
    response_moved[static_cast<std::size_t>(axis)] =
        tensor * (excitationAt(source.at_m + step_m) - excitationAt(source.at_m - step_m)) / (2.0 * kStep_m);
  }
}

FieldSource sourceOf(const Eigen::Vector3d& at_m, const TensorAmplitudes& amplitudes) {
  const Eigen::Matrix<double, 9, 1> response = SourceBasis(at_m).responses * amplitudes;
  return {at_m, Eigen::Map<const Eigen::Matrix3d>(response.data())};
}

PlaceDerivative PlaceDerivative::of(const DisturbedField& field, const Eigen::Vector3d& p_tracked_m) {
  return at(field, field.truePosition_m(p_tracked_m));
}

PlaceDerivative PlaceDerivative::at(const DisturbedField& field, const Eigen::Vector3d& p_true_m) {
  PlaceDerivative place;
  place.at_m = p_true_m;
  place.by_tracked = field.trackedJacobian(place.at_m).inverse();
  place.by_field = -place.by_tracked * field::solvedPositionDerivative(field.at(place.at_m), place.at_m);
  return place;
}

Eigen::Matrix<double, 3, kPerSource> effectOfSource(const PlaceDerivative& place, const SourceBasis& source) {
  // The field is G(p - at) response: G first, for it is the same for all six responses.
  const Eigen::Matrix3d from_source = field::dipoleField(place.at_m - source.at_m, 1.0);
  Eigen::Matrix<double, 3, 9> by_response;
  for (Eigen::Index column = 0; column < 3; ++column)
    by_response.middleCols<3>(3 * column).noalias() = place.by_field.middleCols<3>(3 * column) * from_source;
  return by_response * source.responses;
}

Eigen::Matrix3d effectOfMove(const PlaceDerivative& place, const ChosenSource& source) {
  constexpr double kStep_m = 1e-4;
  const Eigen::Vector3d from_source_m = place.at_m - source.basis.at_m;
  const Eigen::Matrix3d field = field::dipoleField(from_source_m, 1.0);
  Eigen::Matrix3d effect;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step_m = kStep_m * Eigen::Vector3d::Unit(axis);
    const Eigen::Matrix3d slope =
        (field::dipoleField(from_source_m - step_m, 1.0) - field::dipoleField(from_source_m + step_m, 1.0)) /
        (2.0 * kStep_m);
    const Eigen::Matrix3d change =
        slope * source.response + field * source.response_moved[static_cast<std::size_t>(axis)];
    effect.col(axis) = place.by_field * change.reshaped();
  }
  return effect;
}

Eigen::Matrix<double, 3, 6> effectOfMotion(const Eigen::Vector3d& p_m, const Eigen::Vector3d& about_m) {
  const Eigen::Vector3d d = p_m - about_m;
  Eigen::Matrix3d cross;
  cross << 0.0, -d.z(), d.y(), d.z(), 0.0, -d.x(), -d.y(), d.x(), 0.0;
  Eigen::Matrix<double, 3, 6> effect;
  effect << -Eigen::Matrix3d::Identity(), cross;
  return effect;
}

Eigen::Matrix3d FieldPosterior::covariance_m2(const PlaceDerivative& place) const {
  const Eigen::MatrixXd effects = allEffects(place, sources, about_m) * root.triangularView<Eigen::Upper>();
  return effects * effects.transpose();
}

double FieldPosterior::sd_m(const PlaceDerivative& place) const {
  const Eigen::MatrixXd effects = allEffects(place, sources, about_m);
  return (effects * root.triangularView<Eigen::Upper>()).norm();
}

double FieldPosterior::sdOfMotion_m(const Eigen::Vector3d& p_m) const {
  return (effectOfMotion(p_m, about_m) * root.bottomRightCorner<6, 6>().triangularView<Eigen::Upper>()).norm();
}

FieldPosterior posteriorOf(std::span<const PlaceRow> rows, std::span<const FieldSource> sources,
                           std::span<const SourcePrior> priors, const Eigen::Vector3d& about_m, double noise_factor) {
  FT_CHECK(sources.size() == priors.size());
  const std::vector<ChosenSource> chosen(sources.begin(), sources.end());
  const auto n_unknowns = kPerChosen * static_cast<Eigen::Index>(sources.size()) + 6;
  Eigen::MatrixXd effects(n_unknowns, 3 * static_cast<Eigen::Index>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i)
    effects.middleCols<3>(3 * static_cast<Eigen::Index>(i)) =
        (rows[i].whitening * allEffects(rows[i].derivative, chosen, about_m)).transpose();
  Eigen::MatrixXd precision = timesOwnTranspose(effects) / noise_factor;
  completeSymmetric(precision);
  for (std::size_t k = 0; k < priors.size(); ++k) {
    auto diagonal = precision.diagonal().segment<kPerChosen>(kPerChosen * static_cast<Eigen::Index>(k)).array();
    diagonal.head<kPerSource>() += 1.0 / priors[k].amplitude_variance;
    diagonal.tail<3>() += 1.0 / priors[k].place_variance_m2;
  }
  // The unknowns differ by many orders of magnitude: a unit diagonal first, and no direction without any precision.
  const Eigen::VectorXd scale = precision.diagonal().cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd scaled = scale.asDiagonal() * precision * scale.asDiagonal();
  scaled.diagonal().array() += 1e-12;
  const Eigen::LLT<Eigen::MatrixXd> llt(scaled);
  FieldPosterior posterior{chosen, about_m, Eigen::MatrixXd::Identity(scaled.rows(), scaled.cols())};
  llt.matrixU().solveInPlace(posterior.root);
  posterior.root = scale.asDiagonal() * posterior.root;
  return posterior;
}

}  // namespace fieldtrue::correctors
