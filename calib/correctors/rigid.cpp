#include "calib/correctors/rigid.h"

#include "calib/correctors/fit_checks.h"
#include "calib/correctors/json_values.h"

namespace fieldtrue {
namespace {

class RigidPosition : public PositionModel {
 public:
  RigidPosition(const Pose& true_from_tracked, bool planar) : true_from_tracked_(true_from_tracked), planar_(planar) {}

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    return true_from_tracked_ * p_tracked_m - p_tracked_m;
  }
  Eigen::Matrix3d jacobian(const Eigen::Vector3d&) const override {
    return true_from_tracked_.orientation.toRotationMatrix();
  }
  std::string note() const override {
    return planar_ ? "The places lie in one plane: they determine the motion, and nothing tests it off the plane." : "";
  }
  nlohmann::json parameters() const override {
    return {{"true_from_tracked", jsonOf(true_from_tracked_)}, {"planar", planar_}};
  }

 private:
  Pose true_from_tracked_;
  bool planar_;
};

Result<std::unique_ptr<PositionModel>> fitRigidPosition(const FitData& data, const Settings&, const RunControl&) {
  if (auto checked = checkPositions(data, "Rigid fit"); !checked) return tl::unexpected(checked.error());
  const std::size_t n_places = mergePlaces(data).size();
  if (n_places < 3)
    return fail(ErrorCode::kTooFewNodes, "Rigid fit needs at least 3 places, got " + std::to_string(n_places));
  if (data.dimension < 2)
    return fail(ErrorCode::kDegenerate,
                "Rigid fit needs places that are not on one line, and these " + std::to_string(n_places) + " are");
  return fitRigid(data.p_tracked_m, data.p_true_m).map([&](const Pose& pose) -> std::unique_ptr<PositionModel> {
    return std::make_unique<RigidPosition>(pose, data.dimension == 2);
  });
}

Result<std::unique_ptr<PositionModel>> loadRigidPosition(const nlohmann::json& parameters) {
  return guarded<std::unique_ptr<PositionModel>>(
      "parameters of rigid", [&]() -> Result<std::unique_ptr<PositionModel>> {
        return std::make_unique<RigidPosition>(poseFrom(parameters.at("true_from_tracked")),
                                               parameters.at("planar").get<bool>());
      });
}

}  // namespace

PositionMethod rigidPosition() {
  return {"rigid", "Rigid motion", "Horn 1987; Umeyama 1991 without scale", {}, fitRigidPosition, loadRigidPosition};
}

}  // namespace fieldtrue
