#pragma once

#include <Eigen/Core>
#include <memory>

#include "calib/core/json_reader.h"
#include "calib/correctors/base/fit_data.h"
#include "calib/correctors/base/method.h"

namespace fieldtrue::correctors {

/// A sensor whose coils differ in gain, or are not square to each other, reads the field B as (1 + E) B in its own
/// axes, E a symmetric strain (its skew part is a turn, and moves nothing). Turned by R against the transmitter it errs
/// with S = R E R^T. To first order a tracker that takes the range r and the direction n from the strength of the
/// signals and their proportions is wrong by
///
///   tracked - true = r [ -(3 n.Sn + tr S) n / 18 - 4/3 (Sn - (n.Sn) n) ]
///
/// Of a gain g of all coils alike that leaves -g r / 3: the signal falls with the cube of the range.
/// and is turned by a multiple of n x Sn, -3 where it takes the rotation nearest to what the signals leave once the
/// position is known: of n and S alone no other axis can be made, however it solves.
/// @source first-order perturbation of the dipole's singular values, whose range and direction Kuipers 1999 takes
using CoilStrain = Eigen::Matrix<double, 6, 1>;  ///< xx, yy, zz, xy, xz, yz.

/// What of a pose is looked at.
enum class CoilEffect {
  kShift,  ///< True minus tracked position [m].
  kTurn    ///< Rotation vector of the error, tracker frame [rad], as n x Sn with a strain of its own.
};

struct SensorCoils {
  CoilEffect effect = CoilEffect::kShift;
  CoilStrain strain = CoilStrain::Zero();
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  double left_sd_m = 0.0;  ///< Each axis: what else changes as the sensor turns, where nothing else tells it.

  Eigen::Vector3d at(const Pose& tracked) const;
};

/// What each of the strain's six numbers, were it 1, would do to each of some readings: n x 18, of each number x, y, z.
using CoilDesign = Eigen::Matrix<double, Eigen::Dynamic, 18>;

/// d effect / d strain: the effect is linear in it.
Eigen::Matrix<double, 3, 6> coilDerivative(CoilEffect effect, const Pose& tracked);

/// The data without what the coils do: its truth moved to where a sensor with perfect coils would have been read. Of
/// turns the truth stands for the tracked position plus the error's vector.
FitData withoutCoils(FitData data, const SensorCoils& coils);

/// A model of that data with the coils' shift added. Coils that are misjudged leave an error of which the model takes
/// what it can for its own: what is uncertain is only the rest.
/// @param design of the readings that the model was fitted to; no rows where it cannot tell of what it is made
/// @param q orientations it was fitted on; their mean counts where none is told
std::unique_ptr<PositionModel> withCoils(std::unique_ptr<PositionModel> model, const SensorCoils& coils,
                                         CoilDesign design, std::span<const Eigen::Quaterniond> q);
/// @param base reads the model without coils
std::unique_ptr<PositionModel> readCoils(const JsonReader& parameters,
                                         std::unique_ptr<PositionModel> (*base)(const JsonReader&));

}  // namespace fieldtrue::correctors
