#include "calib/correctors/tetrahedral_mesh.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "calib/correctors/cell_json.h"

namespace fieldtrue {
namespace {

constexpr double kMargin = 0.25;
/// Weights this far below 0 are rounding, and count as on the face.
constexpr double kOnFace = 1e-9;
/// Flatter tetrahedra hold no position that their neighbours do not, and their slopes are noise.
constexpr double kFlat = 1e-6;

/// Numbers of the tetrahedra that have a face which no other has.
std::vector<std::size_t> outerCells(const std::vector<TetrahedralMesh::Corners>& cells) {
  std::vector<std::pair<std::array<int, 3>, std::size_t>> faces;
  faces.reserve(4 * cells.size());
  for (std::size_t cell = 0; cell < cells.size(); ++cell) {
    TetrahedralMesh::Corners c = cells[cell];
    std::sort(c.begin(), c.end());
    for (const std::array<int, 3>& face :
         {std::array<int, 3>{c[1], c[2], c[3]}, {c[0], c[2], c[3]}, {c[0], c[1], c[3]}, {c[0], c[1], c[2]}})
      faces.emplace_back(face, cell);
  }
  std::sort(faces.begin(), faces.end());
  std::vector<std::size_t> outer;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const bool like_last = i > 0 && faces[i - 1].first == faces[i].first;
    const bool like_next = i + 1 < faces.size() && faces[i + 1].first == faces[i].first;
    if (!like_last && !like_next) outer.push_back(faces[i].second);
  }
  std::sort(outer.begin(), outer.end());
  outer.erase(std::unique(outer.begin(), outer.end()), outer.end());
  return outer;
}

double least(const std::array<double, 4>& weights) { return *std::min_element(weights.begin(), weights.end()); }

}  // namespace

double relativeVolume(const TetrahedralMesh::Corners& cell, const std::vector<Eigen::Vector3d>& corners_m) {
  std::array<Eigen::Vector3d, 4> x;
  for (std::size_t c = 0; c < 4; ++c) x[c] = corners_m[static_cast<std::size_t>(cell[c])];
  double longest_m = 0.0;
  for (std::size_t a = 0; a < 4; ++a)
    for (std::size_t b = a + 1; b < 4; ++b) longest_m = std::max(longest_m, (x[a] - x[b]).norm());
  if (!(longest_m > 0.0)) return 0.0;
  return (x[1] - x[0]).cross(x[2] - x[0]).dot(x[3] - x[0]) / (longest_m * longest_m * longest_m);
}

TetrahedralMesh::TetrahedralMesh(std::vector<Eigen::Vector3d> corners_m, const std::vector<Corners>& cells)
    : corners_m_(std::move(corners_m)) {
  std::vector<Corners> kept;
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const Corners& corners : cells) {
    if (!(std::abs(relativeVolume(corners, corners_m_)) > kFlat)) continue;
    Cell cell;
    cell.corners = corners;
    cell.last_m = corners_m_[static_cast<std::size_t>(corners[3])];
    Eigen::Matrix3d edges_m;
    for (std::size_t c = 0; c < 4; ++c) {
      const Eigen::Vector3d& corner_m = corners_m_[static_cast<std::size_t>(corners[c])];
      if (c < 3) edges_m.col(static_cast<Eigen::Index>(c)) = corner_m - cell.last_m;
      cell.box.extend(corner_m);
    }
    cell.slopes_1_m = edges_m.inverse();
    const Eigen::Vector3d rounding = Eigen::Vector3d::Constant(kOnFace * cell.box.diagonal().norm());
    cell.box = Eigen::AlignedBox3d(cell.box.min() - rounding, cell.box.max() + rounding);
    boxes.push_back(cell.box);
    kept.push_back(corners);
    cells_.push_back(cell);
  }
  lookup_ = BoxLookup(boxes);
  outer_ = outerCells(kept);
  std::vector<Eigen::AlignedBox3d> outer_boxes;
  for (const std::size_t cell : outer_) {
    Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
    for (const int c : cells_[cell].corners) center_m += 0.25 * corners_m_[static_cast<std::size_t>(c)];
    // Weights of at least -1/4 each, adding up to 1: the tetrahedron grown about its centroid to twice its size.
    Eigen::AlignedBox3d box;
    for (const int c : cells_[cell].corners)
      box.extend(center_m + (1.0 + 4.0 * kMargin) * (corners_m_[static_cast<std::size_t>(c)] - center_m));
    outer_boxes.push_back(box);
  }
  outer_lookup_ = BoxLookup(outer_boxes);
}

std::array<double, 4> TetrahedralMesh::weights(const Cell& cell, const Eigen::Vector3d& p_tracked_m) {
  const Eigen::Vector3d first = cell.slopes_1_m * (p_tracked_m - cell.last_m);  // Equation (7).
  return {first.x(), first.y(), first.z(), 1.0 - first.sum()};
}

std::optional<TetrahedralMesh::Location> TetrahedralMesh::locate(const Eigen::Vector3d& p_tracked_m) const {
  for (const int item : lookup_.near(p_tracked_m)) {
    const auto cell = static_cast<std::size_t>(item);
    if (!cells_[cell].box.contains(p_tracked_m)) continue;
    const Location at{cell, weights(cells_[cell], p_tracked_m)};
    if (least(at.weights) >= -kOnFace) return at;
  }
  std::optional<Location> nearest;
  double highest = -kMargin - kOnFace;
  for (const int item : outer_lookup_.near(p_tracked_m)) {
    const std::size_t cell = outer_[static_cast<std::size_t>(item)];
    const Location at{cell, weights(cells_[cell], p_tracked_m)};
    if (!(least(at.weights) > highest)) continue;
    highest = least(at.weights);
    nearest = at;
  }
  return nearest;
}

nlohmann::json TetrahedralMesh::toJson() const {
  std::vector<Corners> cells;
  cells.reserve(cells_.size());
  for (const Cell& cell : cells_) cells.push_back(cell.corners);
  return {{"tracked_m", jsonOfPoints(corners_m_)}, {"cells", jsonOfCells<4>(cells)}};
}

TetrahedralMesh TetrahedralMesh::fromJson(const nlohmann::json& json) {
  std::vector<Eigen::Vector3d> corners_m = pointsFrom(json.at("tracked_m"));
  const std::vector<Corners> cells = cellsFrom<4>(json.at("cells"), corners_m.size());
  return {std::move(corners_m), cells};
}

}  // namespace fieldtrue
