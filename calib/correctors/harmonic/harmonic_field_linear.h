#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "calib/correctors/harmonic/harmonic_field_evidence.h"
#include "calib/correctors/harmonic/harmonic_field_physics.h"
#include "calib/field/tracker_model.h"

namespace fieldtrue::correctors {

/// What a source answers the transmitter's field with: six amplitudes of a symmetric tensor, in the order xx xy xz yy
/// yz zz, those off the diagonal over sqrt(2) so that all tensors are of unit norm.
using TensorAmplitudes = Eigen::Matrix<double, kPerSource, 1>;

/// The source of a tensor at a place: its response is the tensor times the transmitter's field there, or times the
/// coils themselves where it is the transmitter.
FieldSource sourceOf(const Eigen::Vector3d& at_m, const TensorAmplitudes& amplitudes);

/// How a corrected position changes with the field, at one place.
struct PlaceDerivative {
  Eigen::Vector3d at_m = Eigen::Vector3d::Zero();  ///< Where the field counts, transmitter frame.
  field::PositionDerivative by_field = field::PositionDerivative::Zero();  ///< d corrected / d field matrix.
  Eigen::Matrix3d by_tracked = Eigen::Matrix3d::Identity();                ///< d corrected / d tracked.

  /// At a true position.
  static PlaceDerivative at(const DisturbedField& field, const Eigen::Vector3d& p_true_m);
  /// At the place that a field corrects a tracked position to.
  static PlaceDerivative of(const DisturbedField& field, const Eigen::Vector3d& p_tracked_m);
};

/// A place where a source may stand, with the responses of its six amplitudes (columns, each a 3x3 matrix
/// column-major).
struct SourceBasis {
  Eigen::Vector3d at_m;
  Eigen::Matrix<double, 9, kPerSource> responses;

  explicit SourceBasis(const Eigen::Vector3d& source_at_m);
};

/// d corrected / d amplitudes of a source at one place.
Eigen::Matrix<double, 3, kPerSource> effectOfSource(const PlaceDerivative& place, const SourceBasis& source);

/// d corrected / d (shift, turn about a point) of a motion done to the truth instead.
Eigen::Matrix<double, 3, 6> effectOfMotion(const Eigen::Vector3d& p_m, const Eigen::Vector3d& about_m);

/// A source that was chosen: how a place errs with its amplitudes, and with where it stands.
struct ChosenSource {
  SourceBasis basis;
  Eigen::Matrix3d response;
  std::array<Eigen::Matrix3d, 3> response_moved;  ///< d response / d place, of each axis; the tensor stays.

  explicit ChosenSource(const FieldSource& source);
};

/// d corrected / d place of a source.
Eigen::Matrix3d effectOfMove(const PlaceDerivative& place, const ChosenSource& source);

inline constexpr Eigen::Index kPerChosen = kPerSource + 3;

/// Joint posterior of amplitudes and places of some sources and of the rigid motion, for the SD of corrected positions.
struct FieldPosterior {
  std::vector<ChosenSource> sources;
  Eigen::Vector3d about_m = Eigen::Vector3d::Zero();  ///< Of the motion's turn.
  Eigen::MatrixXd root;                               ///< Upper triangular W, covariance = W W^T.

  /// Covariance of the corrected position [m^2].
  Eigen::Matrix3d covariance_m2(const PlaceDerivative& place) const;
  /// Root of its trace [m].
  double sd_m(const PlaceDerivative& place) const;
  /// The same of a place that the sources do not reach.
  double sdOfMotion_m(const Eigen::Vector3d& p_m) const;
};

/// Positions to be explained at one linearisation.
struct PlaceRow {
  PlaceDerivative derivative;
  Eigen::Vector3d true_minus_corrected_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d whitening = Eigen::Matrix3d::Identity();  ///< Inverse Cholesky factor of its noise.
};

/// What is known of a source before the data: the variance of its amplitudes, and of where it stands about the place
/// that was chosen, per axis.
struct SourcePrior {
  double amplitude_variance = 0.0;
  double place_variance_m2 = 0.0;
};

/// @param noise_factor variance of the noise over what the rows' whitening says
FieldPosterior posteriorOf(std::span<const PlaceRow> rows, std::span<const FieldSource> sources,
                           std::span<const SourcePrior> priors, const Eigen::Vector3d& about_m, double noise_factor);

}  // namespace fieldtrue::correctors
