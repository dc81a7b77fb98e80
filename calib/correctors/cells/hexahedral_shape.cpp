#include <algorithm>
#include <cstdio>
#include <utility>

#include "calib/core/declare.h"
#include "calib/correctors/base/fit_names.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/cells/cell_json.h"
#include "calib/correctors/cells/local_interpolation.h"
#include "calib/correctors/cells/shape_cell.h"

namespace fieldtrue::correctors {
namespace {

struct ShapeChoice {
  bool isoparametric = false;
  ShapeAxes axes = ShapeAxes::kCell;
};

class HexahedralShapePosition : public PositionModel {
 public:
  HexahedralShapePosition(HexahedralCells cells, std::vector<Eigen::Vector3d> v_m, const ShapeChoice& choice,
                          std::string note)
      : cells_(std::move(cells)), v_m_(std::move(v_m)), choice_(choice), note_(std::move(note)) {
    if (choice_.isoparametric) return;
    shapes_.reserve(cells_.size());
    for (std::size_t cell = 0; cell < cells_.size(); ++cell) shapes_.emplace_back(cells_, cell, v_m_, choice_.axes);
  }

  bool covers(const Eigen::Vector3d& p_tracked_m) const override { return locate(p_tracked_m).has_value(); }

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    const auto at = locate(p_tracked_m);
    if (!at) return Eigen::Vector3d::Zero();
    return choice_.isoparametric ? trilinearValue(cells_, *at, v_m_) : shapes_[at->cell].displacement_m(p_tracked_m);
  }

  Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const override {
    const auto at = locate(p_tracked_m);
    Eigen::Matrix3d jacobian = Eigen::Matrix3d::Identity();
    if (!at) return jacobian;
    jacobian += choice_.isoparametric ? trilinearGradient(cells_, *at, v_m_) : shapes_[at->cell].gradient(p_tracked_m);
    return jacobian;
  }

  std::string note() const override { return note_; }

  nlohmann::json parameters() const override {
    nlohmann::json json = cells_.toJson();
    json["v_m"] = jsonOfPoints(v_m_);
    json["note"] = note_;
    json["map"] = choice_.isoparametric ? "isoparametric" : "shape";
    json["axes"] = choice_.axes == ShapeAxes::kCell ? "cell" : "tracker";
    return json;
  }

  void setNote(std::string note) { note_ = std::move(note); }
  const HexahedralCells& cells() const { return cells_; }

  bool isSingular(std::size_t cell) const { return !choice_.isoparametric && shapes_[cell].isSingular(); }

  /// Largest difference between the two cells' corrections in the middle of each shared face and of its edges [m].
  double largestJump_m() const {
    double largest_m = 0.0;
    if (choice_.isoparametric) return largest_m;  // On a face it depends on the face's corners alone.
    for (const SharedFace& face : sharedFaces(cells_)) {
      if (isSingular(face.first_cell) || isSingular(face.second_cell)) continue;
      std::array<Eigen::Vector3d, 4> x;
      for (std::size_t c = 0; c < 4; ++c) x[c] = cells_.corners_m()[static_cast<std::size_t>(face.corners[c])];
      for (const Eigen::Vector3d& p_m : {Eigen::Vector3d(0.25 * (x[0] + x[1] + x[2] + x[3])),
                                         Eigen::Vector3d(0.5 * (x[0] + x[1])), Eigen::Vector3d(0.5 * (x[1] + x[2])),
                                         Eigen::Vector3d(0.5 * (x[2] + x[3])), Eigen::Vector3d(0.5 * (x[3] + x[0]))})
        largest_m = std::max(
            largest_m,
            (shapes_[face.first_cell].displacement_m(p_m) - shapes_[face.second_cell].displacement_m(p_m)).norm());
    }
    return largest_m;
  }

 private:
  std::optional<HexahedralCells::Location> locate(const Eigen::Vector3d& p_tracked_m) const {
    auto at = cells_.locate(p_tracked_m);
    if (at && isSingular(at->cell)) at.reset();
    return at;
  }

  HexahedralCells cells_;
  std::vector<Eigen::Vector3d> v_m_;
  ShapeChoice choice_;
  std::string note_;
  std::vector<ShapeCell> shapes_;
};

std::string singularNote(const HexahedralShapePosition& model, const Places& places) {
  std::size_t n_singular = 0;
  std::vector<int> nodes;
  for (std::size_t cell = 0; cell < model.cells().size(); ++cell) {
    if (!model.isSingular(cell)) continue;
    ++n_singular;
    for (const int place : model.cells().corners(cell)) nodes.push_back(places.node[static_cast<std::size_t>(place)]);
  }
  if (n_singular == 0) return {};
  return "The shape functions are singular in " + std::to_string(n_singular) + " of " +
         std::to_string(model.cells().size()) + " cells, " + "near " + namesOf(places).list(std::move(nodes)) +
         ": nothing is corrected there, and axes=cell would.";
}

std::string jumpNote(double jump_m) {
  std::array<char, 32> mm{};
  std::snprintf(mm.data(), mm.size(), "%.3g", 1000.0 * jump_m);
  return "The largest jump across a face that two cells share is " + std::string(mm.data()) + " mm.";
}

Result<std::unique_ptr<PositionModel>> fitHexahedralShape(const FitData& data, const Settings& settings,
                                                          const RunControl&) {
  const std::string name = "Hexahedral shape functions";
  FT_TRY(const auto grid, placeGrid(data, name, "tetrahedral"));
  const ShapeChoice choice{choiceSetting(settings, "map") == "isoparametric",
                           choiceSetting(settings, "axes") == "tracker" ? ShapeAxes::kTracker : ShapeAxes::kCell};
  auto model = std::make_unique<HexahedralShapePosition>(HexahedralCells::of(grid), errorVectors_m(grid.places), choice,
                                                         std::string());
  bool all_singular = true;
  for (std::size_t cell = 0; cell < model->cells().size(); ++cell)
    all_singular = all_singular && model->isSingular(cell);
  if (all_singular)
    return fail(ErrorCode::kDegenerate,
                name + " are singular in each of the " + std::to_string(model->cells().size()) + " cells; " +
                    (choice.axes == ShapeAxes::kTracker ? "axes=cell is not, where the cells enclose a volume"
                                                        : "cells that enclose a volume are needed"));
  model->setNote(joinedNotes({gridNote(grid), foldNote(model->cells(), grid.places), singularNote(*model, grid.places),
                              jumpNote(model->largestJump_m())}));
  return model;
}

}  // namespace

std::unique_ptr<PositionModel> readHexahedralShapePosition(const JsonReader& parameters) {
  HexahedralCells cells = HexahedralCells::fromJson(parameters);
  std::vector<Eigen::Vector3d> v_m = pointsFrom(parameters["v_m"], cells.corners_m().size());
  const std::string map = parameters["map"].oneOf({"shape", "isoparametric"});
  const std::string axes = parameters["axes"].oneOf({"cell", "tracker"});
  const ShapeChoice choice{map == "isoparametric", axes == "cell" ? ShapeAxes::kCell : ShapeAxes::kTracker};
  return std::make_unique<HexahedralShapePosition>(std::move(cells), std::move(v_m), choice, parameters["note"].text());
}

PositionMethod hexahedralShapePosition() {
  return {
      .id = "hexahedral_shape",
      .label = "Hexahedral shape functions",
      .source = "Zachmann 2000; survey by Kindratenko, section 3.2, eq. 3-4",
      .settings =
          {declare::choice(
               "map", "Map", {"shape", "isoparametric"}, "shape",
               "Shape functions of the position, as published, or of the natural coordinates, which is continuous "
               "between cells."),
           declare::choice("axes", "Axes", {"cell", "tracker"}, "cell",
                           "Axes of the shape functions; tracker is as published and singular for a cube turned by 45 "
                           "degrees.")},
      .fit = fitHexahedralShape,
      .read = readHexahedralShapePosition,
      .origin = MethodOrigin::kSurvey,
      .tries = {{"", simplicity::kInterpolating}}};
}

}  // namespace fieldtrue::correctors
