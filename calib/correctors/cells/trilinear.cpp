#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/cells/cell_json.h"
#include "calib/correctors/cells/tracked_grid.h"

namespace fieldtrue::correctors {
namespace {

/// In a box along the axes the natural coordinates are t, u and w of eq. (2).
class TrilinearPosition : public PositionModel {
 public:
  explicit TrilinearPosition(TrackedGrid grid) : grid_(std::move(grid)) {}

  bool covers(const Eigen::Vector3d& p_tracked_m) const override { return grid_.cells.locate(p_tracked_m).has_value(); }

  /// Equation (1): the weights reproduce p itself, so that mixing v = q - p and adding p is mixing q.
  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    const auto at = grid_.cells.locate(p_tracked_m);
    return at ? trilinearValue(grid_.cells, *at, grid_.v_m) : Eigen::Vector3d(Eigen::Vector3d::Zero());
  }

  Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const override {
    const auto at = grid_.cells.locate(p_tracked_m);
    Eigen::Matrix3d jacobian = Eigen::Matrix3d::Identity();
    if (at) jacobian += trilinearGradient(grid_.cells, *at, grid_.v_m);
    return jacobian;
  }

  std::string note() const override { return grid_.note; }

  nlohmann::json parameters() const override {
    nlohmann::json json = grid_.cells.toJson();
    json["v_m"] = jsonOfPoints(grid_.v_m);
    json["note"] = grid_.note;
    return json;
  }

 private:
  TrackedGrid grid_;
};

Result<std::unique_ptr<PositionModel>> fitTrilinear(const FitData& data, const Settings& settings, const RunControl&) {
  return trackedGrid(data, settings, "Trilinear interpolation")
      .map([](TrackedGrid grid) -> std::unique_ptr<PositionModel> {
        return std::make_unique<TrilinearPosition>(std::move(grid));
      });
}

}  // namespace

std::unique_ptr<PositionModel> readTrilinearPosition(const JsonReader& parameters) {
  HexahedralCells cells = HexahedralCells::fromJson(parameters);
  std::vector<Eigen::Vector3d> v_m = pointsFrom(parameters["v_m"], cells.corners_m().size());
  return std::make_unique<TrilinearPosition>(TrackedGrid{std::move(cells), std::move(v_m), parameters["note"].text()});
}

PositionMethod trilinearPosition() {
  return {
      .id = "trilinear",
      .label = "Trilinear",
      .source =
          "Ghazisaedy et al. 1995; Livingston, State 1997; Czernuszenko et al. 1998; survey by Kindratenko, section "
          "3.1, eq. 1-2",
      .settings = resampleSettings(),
      .fit = fitTrilinear,
      .read = readTrilinearPosition,
      .origin = MethodOrigin::kSurvey,
      .tries = {{"", simplicity::kInterpolating}},
      .reading = trackedGridReading()};
}

}  // namespace fieldtrue::correctors
