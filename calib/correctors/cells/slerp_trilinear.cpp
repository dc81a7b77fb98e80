#include "calib/correctors/base/error_rotation.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/place_rotations.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/cells/cell_json.h"
#include "calib/correctors/cells/hexahedral_cells.h"

namespace fieldtrue::correctors {
namespace {

/// Livingston reduces the trilinear mixture of eight error quaternions to seven mixtures of two: four along the first
/// natural coordinate, two along the second, one along the third.
class SlerpErrorRotation : public ErrorRotationModel {
 public:
  SlerpErrorRotation(ErrorFrame frame, HexahedralCells cells, std::vector<Eigen::Quaterniond> q_error, std::string note)
      : ErrorRotationModel(frame), cells_(std::move(cells)), q_error_(std::move(q_error)), note_(std::move(note)) {}

  bool covers(const Eigen::Vector3d& p_tracked_m) const override { return cells_.locate(p_tracked_m).has_value(); }
  std::string note() const override { return note_; }

 protected:
  Eigen::Quaterniond errorRotation(const Eigen::Vector3d& p_tracked_m) const override {
    const auto at = cells_.locate(p_tracked_m);
    if (!at) return Eigen::Quaterniond::Identity();
    std::array<Eigen::Quaterniond, 8> q;
    for (std::size_t c = 0; c < 8; ++c) q[c] = q_error_[static_cast<std::size_t>(cells_.corners(at->cell)[c])];
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      for (std::size_t i = 0; i < 4U >> static_cast<unsigned>(axis); ++i)
        q[i] = q[2 * i].slerp(at->natural[axis], q[2 * i + 1]);
    return q[0].normalized();
  }

  nlohmann::json errorParameters() const override {
    nlohmann::json json = cells_.toJson();
    json["q_error_wxyz"] = jsonOfRotations(q_error_);
    json["note"] = note_;
    return json;
  }

 private:
  HexahedralCells cells_;
  std::vector<Eigen::Quaterniond> q_error_;
  std::string note_;
};

Result<std::unique_ptr<OrientationModel>> fitSlerpTrilinear(const FitData& data, const Settings& settings,
                                                            const RunControl&) {
  const std::string name = "Trilinear slerp";
  FT_TRY_VOID(checkOrientations(data, name));
  FT_TRY(const auto grid, placeGrid(data, name, "tetrahedral_quaternion"));
  const ErrorFrame frame = errorFrame(settings);
  HexahedralCells cells = HexahedralCells::of(grid);
  std::string note = joinedNotes({gridNote(grid), foldNote(cells, grid.places)});
  return std::make_unique<SlerpErrorRotation>(frame, std::move(cells), placeErrorRotations(data, grid.places, frame),
                                              std::move(note));
}

}  // namespace

std::unique_ptr<OrientationModel> readSlerpTrilinearOrientation(const JsonReader& parameters) {
  HexahedralCells cells = HexahedralCells::fromJson(parameters);
  std::vector<Eigen::Quaterniond> q_error = rotationsFrom(parameters["q_error_wxyz"], cells.corners_m().size());
  return std::make_unique<SlerpErrorRotation>(errorFrameFrom(parameters), std::move(cells), std::move(q_error),
                                              parameters["note"].text());
}

OrientationMethod slerpTrilinearOrientation() {
  return {.id = "slerp_trilinear",
          .label = "Trilinear slerp",
          .source = "Livingston, State 1997; survey by Kindratenko, section 4.1",
          .settings = {errorFrameSetting()},
          .fit = fitSlerpTrilinear,
          .read = readSlerpTrilinearOrientation};
}

}  // namespace fieldtrue::correctors
