#include "calib/correctors/base/error_rotation.h"

#include "calib/core/declare.h"
#include "calib/core/json_reader.h"

namespace fieldtrue::correctors {

ErrorFrame errorFrame(const Settings& settings) {
  return choiceSetting(settings, "error_frame") == "sensor" ? ErrorFrame::kSensor : ErrorFrame::kTracker;
}

std::vector<Eigen::Quaterniond> errorRotations(const FitData& data, ErrorFrame frame) {
  std::vector<Eigen::Quaterniond> q_error;
  q_error.reserve(data.q_tracked.size());
  for (std::size_t i = 0; i < data.q_tracked.size(); ++i) {
    const Eigen::Quaterniond q_true_inverse = data.q_true[i].conjugate();
    q_error.push_back(frame == ErrorFrame::kTracker ? data.q_tracked[i] * q_true_inverse
                                                    : q_true_inverse * data.q_tracked[i]);
  }
  return q_error;
}

Eigen::Quaterniond ErrorRotationModel::correct(const Eigen::Vector3d& p_tracked_m,
                                               const Eigen::Quaterniond& q_tracked) const {
  const Eigen::Quaterniond q_error_inverse = errorRotationAt({p_tracked_m, q_tracked}).conjugate();
  const Eigen::Quaterniond q_true =
      frame_ == ErrorFrame::kTracker ? q_error_inverse * q_tracked : q_tracked * q_error_inverse;
  return q_true.normalized();
}

nlohmann::json ErrorRotationModel::parameters() const {
  nlohmann::json json = errorParameters();
  json["error_frame"] = frame_ == ErrorFrame::kTracker ? "tracker" : "sensor";
  return json;
}

ErrorFrame errorFrameFrom(const JsonReader& parameters) {
  return parameters["error_frame"].oneOf({"tracker", "sensor"}) == "sensor" ? ErrorFrame::kSensor
                                                                            : ErrorFrame::kTracker;
}

Setting errorFrameSetting() {
  return declare::choice(
      "error_frame", "Error frame", {"tracker", "sensor"}, "tracker",
      "Where the error rotation is taken to be the same for every orientation of the sensor at a place.");
}

}  // namespace fieldtrue::correctors
