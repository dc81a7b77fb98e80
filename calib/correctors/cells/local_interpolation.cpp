#include "calib/correctors/cells/local_interpolation.h"

#include "calib/correctors/base/readers.h"
#include "calib/correctors/cells/cell_json.h"

namespace fieldtrue::correctors {
namespace {

class LocalPosition : public PositionModel {
 public:
  LocalPosition(HexahedralCells cells, std::vector<Eigen::Vector3d> v_m, const WeightRule& rule, std::string note)
      : cells_(std::move(cells)), v_m_(std::move(v_m)), rule_(rule), note_(std::move(note)) {
    FT_CHECK(v_m_.size() == cells_.corners_m().size());
    for (std::size_t cell = 0; cell < cells_.size(); ++cell) lengths_.push_back(cellLengths(cells_, cell));
  }

  bool covers(const Eigen::Vector3d& p_tracked_m) const override { return cells_.locate(p_tracked_m).has_value(); }

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    const auto at = cells_.locate(p_tracked_m);
    return at ? displacementIn_m(at->cell, p_tracked_m) : Eigen::Vector3d(Eigen::Vector3d::Zero());
  }

  Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const override {
    const auto at = cells_.locate(p_tracked_m);
    if (!at) return Eigen::Matrix3d::Identity();
    return cellJacobian(p_tracked_m, [&](const Eigen::Vector3d& p_m) { return displacementIn_m(at->cell, p_m); });
  }

  std::string note() const override { return note_; }

  nlohmann::json parameters() const override {
    nlohmann::json json = cells_.toJson();
    json.update(toJson(rule_));
    json["v_m"] = jsonOfPoints(v_m_);
    json["note"] = note_;
    return json;
  }

 private:
  /// Equations (8) and (12).
  Eigen::Vector3d displacementIn_m(std::size_t cell, const Eigen::Vector3d& p_tracked_m) const {
    const std::array<double, 8> weights =
        cornerWeights(rule_, lengths_[cell], cornerDistances_m(cells_, cell, p_tracked_m));
    Eigen::Vector3d sum_m = Eigen::Vector3d::Zero();
    for (std::size_t c = 0; c < 8; ++c) sum_m += weights[c] * v_m_[static_cast<std::size_t>(cells_.corners(cell)[c])];
    return sum_m;
  }

  HexahedralCells cells_;
  std::vector<Eigen::Vector3d> v_m_;
  WeightRule rule_;
  std::string note_;
  std::vector<CellLengths> lengths_;
};

}  // namespace

std::vector<Eigen::Vector3d> errorVectors_m(const Places& places) {
  std::vector<Eigen::Vector3d> v_m(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) v_m[i] = places.p_true_m[i] - places.p_tracked_m[i];
  return v_m;
}

std::array<double, 8> cornerDistances_m(const HexahedralCells& cells, std::size_t cell,
                                        const Eigen::Vector3d& p_tracked_m) {
  std::array<double, 8> d_m{};
  for (std::size_t c = 0; c < 8; ++c) d_m[c] = (p_tracked_m - cells.corner_m(cell, c)).norm();
  return d_m;
}

std::unique_ptr<PositionModel> makeLocalPosition(HexahedralCells cells, std::vector<Eigen::Vector3d> v_m,
                                                 const WeightRule& rule, std::string note) {
  return std::make_unique<LocalPosition>(std::move(cells), std::move(v_m), rule, std::move(note));
}

Result<std::unique_ptr<PositionModel>> fitLocalPosition(const FitData& data, const WeightRule& rule,
                                                        const std::string& name) {
  FT_TRY(const auto grid, placeGrid(data, name, "tetrahedral"));
  HexahedralCells cells = HexahedralCells::of(grid);
  std::string note = joinedNotes({gridNote(grid), foldNote(cells, grid.places), bumpNote(rule, cells)});
  return makeLocalPosition(std::move(cells), errorVectors_m(grid.places), rule, std::move(note));
}

std::unique_ptr<PositionModel> readLocalPosition(const JsonReader& parameters) {
  HexahedralCells cells = HexahedralCells::fromJson(parameters);
  std::vector<Eigen::Vector3d> v_m = pointsFrom(parameters["v_m"], cells.corners_m().size());
  return makeLocalPosition(std::move(cells), std::move(v_m), weightRuleFrom(parameters), parameters["note"].text());
}

}  // namespace fieldtrue::correctors
