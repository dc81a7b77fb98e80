#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "calib/core/pose.h"

namespace fieldtrue::correctors {

/// A fitted, immutable orientation correction. It models the error rotation q_error(p) as a function of tracked
/// position, or of the whole tracked pose, and undoes it: q_true = q_error^-1 q_tracked (error frame `tracker`) or
/// q_true = q_tracked q_error^-1
/// (`sensor`).
class OrientationModel {
 public:
  virtual ~OrientationModel() = default;

  /// Corrected orientation, tracker_from_sensor.
  /// @param p_tracked_m tracker frame [m]
  virtual Eigen::Quaterniond correct(const Eigen::Vector3d& p_tracked_m, const Eigen::Quaterniond& q_tracked) const = 0;

  /// Whether the error rotation depends on how the sensor is turned.
  virtual bool takesOrientation() const { return false; }

  virtual bool covers(const Eigen::Vector3d&) const { return true; }
  /// As PositionModel::coefficients.
  virtual int coefficients() const { return 0; }
  virtual std::string note() const { return {}; }
  virtual nlohmann::json parameters() const = 0;
};

}  // namespace fieldtrue::correctors
