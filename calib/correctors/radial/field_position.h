#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "calib/correctors/base/position_model.h"

namespace fieldtrue::correctors {

/// A smooth field of displacements as a position model.
template <class Field>
class FieldPosition : public PositionModel {
 public:
  FieldPosition(Field field, std::string note) : field_(std::move(field)), note_(std::move(note)) {}

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    return field_.value(p_tracked_m);
  }
  Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const override {
    return Eigen::Matrix3d::Identity() + field_.gradient(p_tracked_m);
  }
  std::string note() const override { return note_; }
  nlohmann::json parameters() const override {
    nlohmann::json json = field_.toJson();
    json["note"] = note_;
    return json;
  }

 private:
  Field field_;
  std::string note_;
};

}  // namespace fieldtrue::correctors
