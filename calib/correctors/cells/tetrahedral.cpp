#include "calib/correctors/base/fit_rows.h"
#include "calib/correctors/base/hold_out_rows.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/cells/cell_json.h"
#include "calib/correctors/cells/local_interpolation.h"
#include "calib/correctors/cells/tetrahedra.h"
#include "calib/correctors/numerics/delaunay.h"

namespace fieldtrue::correctors {
namespace {

class TetrahedralPosition : public PositionModel {
 public:
  TetrahedralPosition(TetrahedralMesh mesh, std::vector<Eigen::Vector3d> v_m, std::string note)
      : mesh_(std::move(mesh)), v_m_(std::move(v_m)), note_(std::move(note)) {}

  bool covers(const Eigen::Vector3d& p_tracked_m) const override { return mesh_.locate(p_tracked_m).has_value(); }

  /// Equation (6), with the natural coordinates of eq. (7); the weights reproduce p itself, so that mixing v = q - p
  /// and adding p is mixing q.
  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    Eigen::Vector3d sum_m = Eigen::Vector3d::Zero();
    const auto at = mesh_.locate(p_tracked_m);
    if (!at) return sum_m;
    for (std::size_t c = 0; c < 4; ++c) sum_m += at->weights[c] * value_m(at->cell, c);
    return sum_m;
  }

  Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const override {
    Eigen::Matrix3d jacobian = Eigen::Matrix3d::Identity();
    const auto at = mesh_.locate(p_tracked_m);
    if (!at) return jacobian;
    for (std::size_t c = 0; c < 3; ++c)
      jacobian +=
          (value_m(at->cell, c) - value_m(at->cell, 3)) * mesh_.slopes_1_m(at->cell).row(static_cast<Eigen::Index>(c));
    return jacobian;
  }

  std::string note() const override { return note_; }

  nlohmann::json parameters() const override {
    nlohmann::json json = mesh_.toJson();
    json["v_m"] = jsonOfPoints(v_m_);
    json["note"] = note_;
    return json;
  }

 private:
  const Eigen::Vector3d& value_m(std::size_t cell, std::size_t corner) const {
    return v_m_[static_cast<std::size_t>(mesh_.corners(cell)[corner])];
  }

  TetrahedralMesh mesh_;
  std::vector<Eigen::Vector3d> v_m_;
  std::string note_;
};

constexpr const char* kName = "Tetrahedral interpolation";

Result<std::unique_ptr<PositionModel>> fitTetrahedral(const FitData& data, const Settings& settings,
                                                      const RunControl&) {
  return tetrahedraOf(data, choiceSetting(settings, "split"), kName)
      .map([](Tetrahedra tetrahedra) -> std::unique_ptr<PositionModel> {
        return std::make_unique<TetrahedralPosition>(std::move(tetrahedra.mesh), errorVectors_m(tetrahedra.places),
                                                     std::move(tetrahedra.note));
      });
}

/// Leaves places out by filling the holes that they leave between the tetrahedra of all.
class TetrahedralHoldOut : public HoldOutFits<PositionModel> {
 public:
  TetrahedralHoldOut(const FitData& data, Settings settings, Places places, Delaunay delaunay)
      : data_(data), settings_(std::move(settings)), places_(std::move(places)), delaunay_(std::move(delaunay)) {}

  Result<std::unique_ptr<PositionModel>> without(std::span<const std::size_t> rows,
                                                 const Pose& fold_from_data) const override {
    FitData rest = rowsOfFitData(data_, rowsWithout(data_.size(), rows));
    for (Eigen::Vector3d& p_m : rest.p_true_m) p_m = fold_from_data * p_m;
    FT_TRY_VOID(checkVolume(rest, kName));
    const auto out = placesOfRows(places_, rows);
    const auto cells = out ? delaunay_.without(*out) : std::nullopt;
    TetrahedralMesh mesh = cells ? TetrahedralMesh(places_.p_tracked_m, *cells) : TetrahedralMesh();
    if (mesh.size() == 0) return fitTetrahedral(rest, settings_, {});
    Places moved = places_;
    for (Eigen::Vector3d& p_m : moved.p_true_m) p_m = fold_from_data * p_m;
    return std::make_unique<TetrahedralPosition>(std::move(mesh), errorVectors_m(moved), std::string());
  }

 private:
  FitData data_;
  Settings settings_;
  Places places_;
  Delaunay delaunay_;
};

/// Cells of a grid are joined anew around what is missing.
bool holdsOutTetrahedral(const FitData& data, const Settings& settings) {
  return isByDelaunay(data, choiceSetting(settings, "split"));
}

Result<std::unique_ptr<HoldOutFits<PositionModel>>> holdOutTetrahedral(const FitData& data, const Settings& settings,
                                                                       const RunControl&) {
  FT_TRY_VOID(checkVolume(data, kName));
  Places places = mergePlaces(data);
  FT_TRY(auto delaunay, Delaunay::of(places.p_tracked_m, kName));
  return std::make_unique<TetrahedralHoldOut>(data, settings, std::move(places), std::move(delaunay));
}

}  // namespace

std::unique_ptr<PositionModel> readTetrahedralPosition(const JsonReader& parameters) {
  TetrahedralMesh mesh = TetrahedralMesh::fromJson(parameters);
  std::vector<Eigen::Vector3d> v_m = pointsFrom(parameters["v_m"], mesh.corners_m().size());
  return std::make_unique<TetrahedralPosition>(std::move(mesh), std::move(v_m), parameters["note"].text());
}

PositionMethod tetrahedralPosition() {
  return {.id = "tetrahedral",
          .label = "Tetrahedral",
          .source = "Ellis et al. 1999; Kenwright, Lane 1996; survey by Kindratenko, section 3.2, eq. 5-7",
          .settings = {splitSetting()},
          .fit = fitTetrahedral,
          .read = readTetrahedralPosition,
          .hold_out = holdOutTetrahedral,
          .holds_out = holdsOutTetrahedral,
          .origin = MethodOrigin::kSurvey,
          .tries = {{"", simplicity::kInterpolating}}};
}

}  // namespace fieldtrue::correctors
