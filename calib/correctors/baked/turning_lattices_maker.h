#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "calib/correctors/base/position_model.h"
#include "calib/correctors/radial/rbf_field.h"

namespace fieldtrue::correctors {

/// The part of a correction that changes as the sensor turns: sum_i c_i kernel(r_i) kernel(chord(q, q_i) / length).
struct TurningPart {
  RadialKernel kernel = RadialKernel::kMatern52;
  FieldFrame frame;  ///< In units of the lengths.
  std::vector<Eigen::Vector3d> p_m;
  std::vector<Eigen::Quaterniond> q;
  Eigen::MatrixXd coefficients;  ///< c, n x 3 [m].
  double length_rad = 1.0;
};

/// A correction over poses on lattices. The orientations of the rows are replaced by as few of them as span the others
/// (pivoted Cholesky of their kernel), and the functions of position that belong to these by as few as the bound allows
/// (singular values over places and orientations).
/// @param still what does not change as the sensor turns; its uncertainty is the whole's
/// @error kUnsupported where that takes more than 48 functions; as LatticeMaker::make. Orientations beyond 256 are left
/// to those that are nearest: whether that does is for the caller to check.
Result<std::unique_ptr<PositionModel>> makeTurningLattices(const PositionModel& still, const TurningPart& part,
                                                           const LatticeMaker& maker, double max_deviation_m);

}  // namespace fieldtrue::correctors
