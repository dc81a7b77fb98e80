#pragma once

#include <memory>
#include <optional>
#include <string>

#include "calib/core/json_reader.h"
#include "calib/correctors/base/position_model.h"
#include "calib/correctors/multiquadric/hmq_field.h"
#include "calib/correctors/multiquadric/hmq_single.h"

namespace fieldtrue::correctors {

enum class HmqPrecision { kDouble, kSingle };

/// The fitted position correction: f(p) of a multiquadric field of the true positions.
class HmqPosition : public PositionModel {
 public:
  HmqPosition(MultiquadricField field, HmqPrecision precision, std::string note);

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override;
  void correct(std::span<const Eigen::Vector3d> p_tracked_m, std::span<Eigen::Vector3d> p_corrected_m) const override;
  Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const override { return field_.gradient3(p_tracked_m); }
  std::string note() const override { return note_; }
  nlohmann::json parameters() const override;

  static std::unique_ptr<HmqPosition> fromJson(const JsonReader& parameters);

 private:
  void values(std::span<const Eigen::Vector3d> p_m, std::span<Eigen::Vector3d> f) const;

  MultiquadricField field_;
  std::optional<SingleMultiquadricField> single_;
  std::string note_;
};

}  // namespace fieldtrue::correctors
