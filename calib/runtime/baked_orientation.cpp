#include "calib/runtime/baked_orientation.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "calib/correctors/baked/baked_lattice_maker.h"

namespace fieldtrue::runtime {
namespace {

using correctors::OrientationModel;

/// Every model turns a reading by a rotation that depends on position alone, from the left or from the right.
enum class Side { kLeft, kRight };

Eigen::Quaterniond turned(Side side, const Eigen::Quaterniond& by, const Eigen::Quaterniond& q_tracked) {
  return side == Side::kLeft ? by * q_tracked : q_tracked * by;
}

/// The rotation vector as a field to bake: its numbers are radians.
class TurnField : public correctors::PositionModel {
 public:
  explicit TurnField(const OrientationModel& model) : model_(model) {}

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    return rotationVector_rad(model_.correct(p_tracked_m, Eigen::Quaterniond::Identity()));
  }
  bool covers(const Eigen::Vector3d& p_tracked_m) const override { return model_.covers(p_tracked_m); }
  nlohmann::json parameters() const override { return {}; }

 private:
  const OrientationModel& model_;
};

class BakedOrientation : public OrientationModel {
 public:
  BakedOrientation(std::unique_ptr<correctors::BakedLattice> turns, Side side)
      : turns_(std::move(turns)), side_(side) {}

  Eigen::Quaterniond correct(const Eigen::Vector3d& p_tracked_m, const Eigen::Quaterniond& q_tracked) const override {
    return turned(side_, rotationFromVector(turns_->displacement_m(p_tracked_m)), q_tracked);
  }
  bool covers(const Eigen::Vector3d& p_tracked_m) const override { return turns_->covers(p_tracked_m); }
  nlohmann::json parameters() const override { return turns_->parameters(); }

 private:
  std::unique_ptr<correctors::BakedLattice> turns_;
  Side side_;
};

constexpr double kAlike_rad = 1e-12;

bool isConstant(const OrientationModel& model, std::span<const Eigen::Vector3d> places_m) {
  const Eigen::Quaterniond first = model.correct(places_m.front(), Eigen::Quaterniond::Identity());
  return std::all_of(places_m.begin(), places_m.end(), [&](const Eigen::Vector3d& p_m) {
    return model.covers(p_m) &&
           angleBetween_rad(model.correct(p_m, Eigen::Quaterniond::Identity()), first) < kAlike_rad;
  });
}

/// On which side of the reading the model's rotation stands: seen where the sides differ most.
Side sideOf(const OrientationModel& model, std::span<const Eigen::Vector3d> places_m) {
  const Eigen::Quaterniond q(0.5, 0.5, 0.5, 0.5);
  double left_rad = 0.0, right_rad = 0.0;
  for (const Eigen::Vector3d& p_m : places_m) {
    if (!model.covers(p_m)) continue;
    const Eigen::Quaterniond by = model.correct(p_m, Eigen::Quaterniond::Identity());
    const Eigen::Quaterniond seen = model.correct(p_m, q);
    left_rad = std::max(left_rad, angleBetween_rad(turned(Side::kLeft, by, q), seen));
    right_rad = std::max(right_rad, angleBetween_rad(turned(Side::kRight, by, q), seen));
  }
  return left_rad <= right_rad ? Side::kLeft : Side::kRight;
}

}  // namespace

Result<std::shared_ptr<const OrientationModel>> bakeOrientation(std::shared_ptr<const OrientationModel> model,
                                                                const Region& region,
                                                                std::span<const Eigen::Vector3d> places_m,
                                                                double max_angle_rad) {
  if (places_m.empty() || isConstant(*model, places_m)) return model;
  FT_TRY(auto turns, correctors::bakeLattice(TurnField(*model), region, places_m, max_angle_rad, {}));
  return std::make_shared<const BakedOrientation>(std::move(turns), sideOf(*model, places_m));
}

}  // namespace fieldtrue::runtime
