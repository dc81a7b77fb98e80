#include "calib/correctors/cells/hexahedral_cells.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "calib/correctors/base/fit_names.h"
#include "calib/correctors/cells/cell_json.h"
#include "calib/correctors/cells/face_pairs.h"

namespace fieldtrue::correctors {
namespace {

constexpr double kMargin = 0.25;
/// Natural coordinates this far outside are rounding, and count as on the face.
constexpr double kOnFace = 1e-9;

double corner(std::size_t c, int axis) { return ((c >> static_cast<unsigned>(axis)) & 1U) != 0 ? 1.0 : 0.0; }

/// By how much natural coordinates leave the cell; 0 inside.
double overshoot(const Eigen::Vector3d& natural) {
  return std::max(0.0, (natural.array() - 0.5).abs().maxCoeff() - 0.5);
}

/// Squared distance from the cell in natural coordinates.
double outsideSquared(const Eigen::Vector3d& natural) {
  return ((natural.array() - 0.5).abs() - 0.5).max(0.0).square().sum();
}

/// Corners of the six faces of a cell, around each face.
constexpr std::array<std::array<std::size_t, 4>, 6> kFaces = {
    {{0, 2, 6, 4}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 5, 7, 6}}};

/// In a grid a face is known by its lowest corner and the one across.
std::uint64_t faceKey(const HexahedralCells::Corners& cell, const std::array<std::size_t, 4>& face) {
  std::size_t lowest = 0;
  for (std::size_t c = 1; c < 4; ++c)
    if (cell[face[c]] < cell[face[lowest]]) lowest = c;
  return (static_cast<std::uint64_t>(cell[face[lowest]]) << 32U) |
         static_cast<std::uint64_t>(cell[face[(lowest + 2) % 4]]);
}

/// Of the six faces of the first cell, then of the second, and so on.
std::vector<int> partnersOf(const std::vector<HexahedralCells::Corners>& cells) {
  std::vector<std::uint64_t> keys;
  keys.reserve(kFaces.size() * cells.size());
  for (const HexahedralCells::Corners& cell : cells)
    for (const auto& face : kFaces) keys.push_back(faceKey(cell, face));
  return facePartners(keys);
}

}  // namespace

std::array<double, 8> trilinearWeights(const Eigen::Vector3d& natural) {
  const double r = natural.x();
  const double s = natural.y();
  const double t = natural.z();
  const double low_low = (1.0 - s) * (1.0 - t);
  const double high_low = s * (1.0 - t);
  const double low_high = (1.0 - s) * t;
  const double high_high = s * t;
  return {(1.0 - r) * low_low,  r * low_low,  (1.0 - r) * high_low,  r * high_low,
          (1.0 - r) * low_high, r * low_high, (1.0 - r) * high_high, r * high_high};
}

std::array<Eigen::Vector3d, 8> trilinearSlopes(const Eigen::Vector3d& natural) {
  std::array<Eigen::Vector3d, 8> slopes;
  for (std::size_t c = 0; c < 8; ++c) {
    Eigen::Vector3d factor;
    Eigen::Vector3d slope;
    for (int axis = 0; axis < 3; ++axis) {
      const bool is_high = corner(c, axis) > 0.5;
      factor[axis] = is_high ? natural[axis] : 1.0 - natural[axis];
      slope[axis] = is_high ? 1.0 : -1.0;
    }
    slopes[c] = {slope.x() * factor.y() * factor.z(), factor.x() * slope.y() * factor.z(),
                 factor.x() * factor.y() * slope.z()};
  }
  return slopes;
}

HexahedralCells::HexahedralCells(std::vector<Eigen::Vector3d> corners_m, std::vector<Corners> cells)
    : corners_m_(std::move(corners_m)), cells_(std::move(cells)) {
  coefficients_.reserve(cells_.size());
  boxes_.reserve(cells_.size());
  for (const Corners& cell : cells_) {
    std::array<Eigen::Vector3d, 8> x;
    Eigen::AlignedBox3d box;
    for (std::size_t c = 0; c < 8; ++c) {
      x[c] = corners_m_[static_cast<std::size_t>(cell[c])];
      box.extend(x[c]);
    }
    coefficients_.push_back({x[0], x[1] - x[0], x[2] - x[0], x[4] - x[0], x[3] - x[1] - x[2] + x[0],
                             x[5] - x[1] - x[4] + x[0], x[6] - x[2] - x[4] + x[0],
                             x[7] - x[3] - x[5] - x[6] + x[1] + x[2] + x[4] - x[0]});
    // A point that lies on a face in all but rounding shall not miss its cell.
    const Eigen::Vector3d rounding = Eigen::Vector3d::Constant(kOnFace * box.diagonal().norm());
    boxes_.emplace_back(box.min() - rounding, box.max() + rounding);
  }
  lookup_ = BoxLookup(boxes_);
  outer_ = outerCells(partnersOf(cells_), kFaces.size());
  for (const std::size_t cell : outer_) {
    // The map is linear in each natural coordinate: the box of the widened cell is that of its eight corners.
    Eigen::AlignedBox3d box;
    for (std::size_t c = 0; c < 8; ++c) {
      const Eigen::Vector3d at(corner(c, 0), corner(c, 1), corner(c, 2));
      box.extend(position_m({cell, at + 2.0 * kMargin * (at - Eigen::Vector3d::Constant(0.5))}));
    }
    outer_boxes_.push_back(box);
  }
  outer_lookup_ = BoxLookup(outer_boxes_);
}

HexahedralCells HexahedralCells::of(const PlaceGrid& grid) {
  std::vector<Corners> cells;
  cells.reserve(grid.cells.size());
  for (const GridCell& cell : grid.cells) cells.push_back(cell.corners);
  return {grid.places.p_tracked_m, std::move(cells)};
}

Eigen::Vector3d HexahedralCells::position_m(const Location& at) const {
  const Coefficients& c = coefficients_[at.cell];
  const double r = at.natural.x();
  const double s = at.natural.y();
  const double t = at.natural.z();
  return c[0] + r * c[1] + s * c[2] + t * c[3] + r * s * c[4] + r * t * c[5] + s * t * c[6] + r * s * t * c[7];
}

Eigen::Matrix3d HexahedralCells::tangent_m(const Location& at) const {
  const Coefficients& c = coefficients_[at.cell];
  const double r = at.natural.x();
  const double s = at.natural.y();
  const double t = at.natural.z();
  Eigen::Matrix3d tangent_m;
  tangent_m.col(0) = c[1] + s * c[4] + t * c[5] + s * t * c[7];
  tangent_m.col(1) = c[2] + r * c[4] + t * c[6] + r * t * c[7];
  tangent_m.col(2) = c[3] + r * c[5] + s * c[6] + r * s * c[7];
  return tangent_m;
}

std::optional<Eigen::Vector3d> HexahedralCells::natural(std::size_t cell, const Eigen::Vector3d& p_tracked_m) const {
  constexpr int kMostSteps = 20;
  constexpr double kFarAway = 4.0;
  // Newton's method doubles the digits: what remains after a step this small is below rounding.
  constexpr double kLastStep = 1e-8;
  Location at{cell, Eigen::Vector3d::Constant(0.5)};
  for (int i = 0; i < kMostSteps; ++i) {
    const Eigen::Matrix3d tangent_m = this->tangent_m(at);
    const Eigen::Vector3d across = tangent_m.col(1).cross(tangent_m.col(2));
    const double volume_m3 = tangent_m.col(0).dot(across);
    if (volume_m3 == 0.0) return std::nullopt;
    const Eigen::Vector3d left_m = p_tracked_m - position_m(at);
    const Eigen::Vector3d step =
        Eigen::Vector3d(across.dot(left_m), tangent_m.col(2).cross(tangent_m.col(0)).dot(left_m),
                        tangent_m.col(0).cross(tangent_m.col(1)).dot(left_m)) /
        volume_m3;
    at.natural += step;
    if (!(at.natural.cwiseAbs().maxCoeff() < kFarAway)) return std::nullopt;
    if (step.cwiseAbs().maxCoeff() < kLastStep) return at.natural;
  }
  return std::nullopt;
}

std::optional<HexahedralCells::Location> HexahedralCells::locateInside(const Eigen::Vector3d& p_tracked_m) const {
  for (const int item : lookup_.near(p_tracked_m)) {
    const auto cell = static_cast<std::size_t>(item);
    if (!boxes_[cell].contains(p_tracked_m)) continue;
    const auto at = natural(cell, p_tracked_m);
    if (at && overshoot(*at) <= kOnFace) return Location{cell, *at};
  }
  return std::nullopt;
}

std::optional<HexahedralCells::Location> HexahedralCells::locateAround(const Eigen::Vector3d& p_tracked_m) const {
  std::optional<Location> nearest;
  double least = std::numeric_limits<double>::infinity();
  for (const int item : outer_lookup_.near(p_tracked_m)) {
    const auto i = static_cast<std::size_t>(item);
    if (!outer_boxes_[i].contains(p_tracked_m)) continue;
    const auto at = natural(outer_[i], p_tracked_m);
    if (!at || overshoot(*at) > kMargin + kOnFace) continue;
    // The largest overshoot alone is the same for neighbours: over their face, and over it and a side.
    const double out = outsideSquared(*at);
    if (out >= least) continue;
    least = out;
    nearest = Location{outer_[i], *at};
  }
  return nearest;
}

std::optional<HexahedralCells::Location> HexahedralCells::locate(const Eigen::Vector3d& p_tracked_m) const {
  const auto inside = locateInside(p_tracked_m);
  return inside ? inside : locateAround(p_tracked_m);
}

std::vector<std::size_t> HexahedralCells::foldedCells() const {
  std::vector<std::array<bool, 8>> is_left(cells_.size());
  std::size_t n_left = 0;
  for (std::size_t cell = 0; cell < cells_.size(); ++cell)
    for (std::size_t c = 0; c < 8; ++c) {
      is_left[cell][c] = tangent_m({cell, {corner(c, 0), corner(c, 1), corner(c, 2)}}).determinant() <= 0.0;
      n_left += is_left[cell][c] ? 1U : 0U;
    }
  const bool most_are_left = n_left > 4 * cells_.size();
  std::vector<std::size_t> folded;
  for (std::size_t cell = 0; cell < cells_.size(); ++cell)
    if (std::any_of(is_left[cell].begin(), is_left[cell].end(), [&](bool left) { return left != most_are_left; }))
      folded.push_back(cell);
  return folded;
}

nlohmann::json HexahedralCells::toJson() const { return {{"tracked_m", jsonOfPoints(corners_m_)}, {"cells", cells_}}; }

HexahedralCells HexahedralCells::fromJson(const JsonReader& json) {
  std::vector<Eigen::Vector3d> corners_m = pointsFrom(json["tracked_m"]);
  std::vector<Corners> cells = cellsFrom<8>(json["cells"], corners_m.size());
  return {std::move(corners_m), std::move(cells)};
}

std::vector<SharedFace> sharedFaces(const HexahedralCells& cells) {
  std::vector<HexahedralCells::Corners> all;
  all.reserve(cells.size());
  for (std::size_t cell = 0; cell < cells.size(); ++cell) all.push_back(cells.corners(cell));
  const std::vector<int> partners = partnersOf(all);
  std::vector<SharedFace> shared;
  for (std::size_t i = 0; i < partners.size(); ++i) {
    if (partners[i] < static_cast<int>(i)) continue;
    SharedFace face{i / kFaces.size(), static_cast<std::size_t>(partners[i]) / kFaces.size(), {}};
    for (std::size_t c = 0; c < 4; ++c) face.corners[c] = all[face.first_cell][kFaces[i % kFaces.size()][c]];
    shared.push_back(face);
  }
  return shared;
}

Eigen::Vector3d trilinearValue(const HexahedralCells& cells, const HexahedralCells::Location& at,
                               const std::vector<Eigen::Vector3d>& values) {
  const std::array<double, 8> weights = trilinearWeights(at.natural);
  const HexahedralCells::Corners& corners = cells.corners(at.cell);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t c = 0; c < 8; ++c) sum += weights[c] * values[static_cast<std::size_t>(corners[c])];
  return sum;
}

Eigen::Matrix3d trilinearGradient(const HexahedralCells& cells, const HexahedralCells::Location& at,
                                  const std::vector<Eigen::Vector3d>& values) {
  const std::array<Eigen::Vector3d, 8> slopes = trilinearSlopes(at.natural);
  const HexahedralCells::Corners& corners = cells.corners(at.cell);
  Eigen::Matrix3d by_natural = Eigen::Matrix3d::Zero();
  for (std::size_t c = 0; c < 8; ++c)
    by_natural += values[static_cast<std::size_t>(corners[c])] * slopes[c].transpose();
  return by_natural * cells.tangent_m(at).inverse();
}

std::string foldNote(const HexahedralCells& cells, const Places& places) {
  const std::vector<std::size_t> folded = cells.foldedCells();
  if (folded.empty()) return {};
  std::vector<int> nodes;
  for (const std::size_t cell : folded)
    for (const int place : cells.corners(cell)) nodes.push_back(places.node[static_cast<std::size_t>(place)]);
  return "The field folds back in " + std::to_string(folded.size()) + (folded.size() == 1 ? " cell, " : " cells, ") +
         "near " + namesOf(places).list(std::move(nodes)) +
         ": there one tracked position stands for several true ones.";
}

}  // namespace fieldtrue::correctors
