#include "calib/correctors/base/error_rotation.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/place_rotations.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/cells/cell_json.h"
#include "calib/correctors/cells/tetrahedra.h"

namespace fieldtrue::correctors {
namespace {

/// Ellis measures the error by the vertical alone; here the whole error rotation of each corner is mixed.
class TetrahedralErrorRotation : public ErrorRotationModel {
 public:
  TetrahedralErrorRotation(ErrorFrame frame, TetrahedralMesh mesh, std::vector<Eigen::Quaterniond> q_error,
                           std::string note)
      : ErrorRotationModel(frame), mesh_(std::move(mesh)), q_error_(std::move(q_error)), note_(std::move(note)) {}

  bool covers(const Eigen::Vector3d& p_tracked_m) const override { return mesh_.locate(p_tracked_m).has_value(); }
  std::string note() const override { return note_; }

 protected:
  Eigen::Quaterniond errorRotation(const Eigen::Vector3d& p_tracked_m) const override {
    const auto at = mesh_.locate(p_tracked_m);
    if (!at) return Eigen::Quaterniond::Identity();
    std::array<Eigen::Quaterniond, 4> q;
    for (std::size_t c = 0; c < 4; ++c) q[c] = q_error_[static_cast<std::size_t>(mesh_.corners(at->cell)[c])];
    return weightedRotation(q, at->weights);
  }

  nlohmann::json errorParameters() const override {
    nlohmann::json json = mesh_.toJson();
    json["q_error_wxyz"] = jsonOfRotations(q_error_);
    json["note"] = note_;
    return json;
  }

 private:
  TetrahedralMesh mesh_;
  std::vector<Eigen::Quaterniond> q_error_;
  std::string note_;
};

Result<std::unique_ptr<OrientationModel>> fitTetrahedralQuaternion(const FitData& data, const Settings& settings,
                                                                   const RunControl&) {
  const std::string name = "Tetrahedral mixture of rotations";
  FT_TRY_VOID(checkOrientations(data, name));
  FT_TRY(auto tetrahedra, tetrahedraOf(data, choiceSetting(settings, "split"), name));
  const ErrorFrame frame = errorFrame(settings);
  std::vector<Eigen::Quaterniond> q_error = placeErrorRotations(data, tetrahedra.places, frame);
  return std::make_unique<TetrahedralErrorRotation>(frame, std::move(tetrahedra.mesh), std::move(q_error),
                                                    std::move(tetrahedra.note));
}

}  // namespace

std::unique_ptr<OrientationModel> readTetrahedralQuaternionOrientation(const JsonReader& parameters) {
  TetrahedralMesh mesh = TetrahedralMesh::fromJson(parameters);
  std::vector<Eigen::Quaterniond> q_error = rotationsFrom(parameters["q_error_wxyz"], mesh.corners_m().size());
  return std::make_unique<TetrahedralErrorRotation>(errorFrameFrom(parameters), std::move(mesh), std::move(q_error),
                                                    parameters["note"].text());
}

OrientationMethod tetrahedralQuaternionOrientation() {
  return {.id = "tetrahedral_quaternion",
          .label = "Tetrahedral rotations",
          .source = "Ellis et al. 1999; survey by Kindratenko, section 4.1, weights of eq. 7",
          .settings = {splitSetting(), errorFrameSetting()},
          .fit = fitTetrahedralQuaternion,
          .read = readTetrahedralQuaternionOrientation};
}

}  // namespace fieldtrue::correctors
