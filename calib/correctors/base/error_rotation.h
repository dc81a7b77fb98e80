#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "calib/core/error.h"
#include "calib/core/json_reader.h"
#include "calib/core/settings.h"
#include "calib/correctors/base/fit_data.h"
#include "calib/correctors/base/orientation_model.h"

namespace fieldtrue::correctors {

/// The frame in which the error rotation depends on position alone, whatever way the sensor points.
enum class ErrorFrame {
  kTracker,  ///< q_error = q_tracked q_true^-1: what bends the field at a place turns every reading there alike.
  kSensor,   ///< q_error = q_true^-1 q_tracked: the sensor carries the error with it.
};

/// Of the setting `error_frame`.
ErrorFrame errorFrame(const Settings& settings);

/// The error rotation of every row.
std::vector<Eigen::Quaterniond> errorRotations(const FitData& data, ErrorFrame frame);

/// An orientation model that predicts the error rotation at a position and undoes it.
class ErrorRotationModel : public OrientationModel {
 public:
  explicit ErrorRotationModel(ErrorFrame frame) : frame_(frame) {}

  Eigen::Quaterniond correct(const Eigen::Vector3d& p_tracked_m, const Eigen::Quaterniond& q_tracked) const final;
  nlohmann::json parameters() const final;

 protected:
  /// Unit quaternion; where it depends on how the sensor is turned, the mean over the orientations that were fitted.
  virtual Eigen::Quaterniond errorRotation(const Eigen::Vector3d& p_tracked_m) const = 0;
  virtual Eigen::Quaterniond errorRotationAt(const Pose& tracked) const { return errorRotation(tracked.position_m); }
  virtual nlohmann::json errorParameters() const = 0;

 private:
  ErrorFrame frame_;
};

/// The frame that `parameters` stored.
ErrorFrame errorFrameFrom(const JsonReader& parameters);

/// `error_frame`, the frame in which the error rotation is modelled: `tracker` (default) or `sensor`.
Setting errorFrameSetting();

}  // namespace fieldtrue::correctors
