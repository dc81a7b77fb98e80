#pragma once

#include "calib/correctors/base/position_model.h"
#include "calib/correctors/multiquadric/hmq_field.h"

namespace fieldtrue::correctors {

/// The fitted position correction: f(p) of a multiquadric field of the true positions.
class HmqPosition : public PositionModel {
 public:
  HmqPosition(MultiquadricField field, std::string note) : field_(std::move(field)), note_(std::move(note)) {}

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    return field_.value3(p_tracked_m) - p_tracked_m;
  }
  Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const override { return field_.gradient3(p_tracked_m); }
  std::string note() const override { return note_; }
  nlohmann::json parameters() const override {
    nlohmann::json json = field_.toJson();
    json["note"] = note_;
    return json;
  }

 private:
  MultiquadricField field_;
  std::string note_;
};

}  // namespace fieldtrue::correctors
