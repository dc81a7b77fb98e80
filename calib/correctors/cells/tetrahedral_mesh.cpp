#include "calib/correctors/cells/tetrahedral_mesh.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "calib/correctors/cells/cell_json.h"
#include "calib/correctors/cells/face_pairs.h"

namespace fieldtrue::correctors {
namespace {

constexpr double kMargin = 0.25;
/// Weights this far below 0 are rounding, and count as on the face.
constexpr double kOnFace = 1e-9;
/// Flatter tetrahedra hold no position that their neighbours do not, and their slopes are noise.
constexpr double kFlat = 1e-6;

constexpr std::size_t kFaces = 4;

/// The three corners of each face in ascending order, 21 bits each: enough for two million places. Face c is opposite
/// corner c.
std::vector<std::uint64_t> faceKeys(const std::vector<TetrahedralMesh::Corners>& cells) {
  std::vector<std::uint64_t> keys;
  keys.reserve(kFaces * cells.size());
  for (const TetrahedralMesh::Corners& cell : cells)
    for (std::size_t c = 0; c < kFaces; ++c) {
      std::array<std::uint64_t, 3> face{};
      for (std::size_t k = 0; k < 3; ++k) face[k] = static_cast<std::uint64_t>(cell[(c + 1 + k) % kFaces]);
      if (face[0] > face[1]) std::swap(face[0], face[1]);
      if (face[1] > face[2]) std::swap(face[1], face[2]);
      if (face[0] > face[1]) std::swap(face[0], face[1]);
      keys.push_back((face[0] << 42U) | (face[1] << 21U) | face[2]);
    }
  return keys;
}

double least(const std::array<double, 4>& weights) { return *std::min_element(weights.begin(), weights.end()); }

}  // namespace

double relativeVolume(const TetrahedralMesh::Corners& cell, const std::vector<Eigen::Vector3d>& corners_m) {
  std::array<Eigen::Vector3d, 4> x;
  for (std::size_t c = 0; c < 4; ++c) x[c] = corners_m[static_cast<std::size_t>(cell[c])];
  double longest_m2 = 0.0;
  for (std::size_t a = 0; a < 4; ++a)
    for (std::size_t b = a + 1; b < 4; ++b) longest_m2 = std::max(longest_m2, (x[a] - x[b]).squaredNorm());
  if (!(longest_m2 > 0.0)) return 0.0;
  return (x[1] - x[0]).cross(x[2] - x[0]).dot(x[3] - x[0]) / (longest_m2 * std::sqrt(longest_m2));
}

TetrahedralMesh::TetrahedralMesh(std::vector<Eigen::Vector3d> corners_m, const std::vector<Corners>& cells)
    : corners_m_(std::move(corners_m)) {
  std::vector<Corners> kept;
  std::vector<Eigen::AlignedBox3d> boxes;
  kept.reserve(cells.size());
  boxes.reserve(cells.size());
  cells_.reserve(cells.size());
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
  findOuter(kept);
}

void TetrahedralMesh::findOuter(const std::vector<Corners>& cells) {
  const std::vector<int> partners = facePartners(faceKeys(cells));
  std::vector<Eigen::AlignedBox3d> outer_boxes;
  for (const std::size_t cell : outerCells(partners, kFaces)) {
    Outer outer{cell, {}};
    for (std::size_t c = 0; c < kFaces; ++c) outer.is_own[c] = partners[kFaces * cell + c] < 0;
    outer_.push_back(outer);
    Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
    for (const int c : cells[cell]) center_m += 0.25 * corners_m_[static_cast<std::size_t>(c)];
    // Weights of at least -1/4 each, adding up to 1: the tetrahedron grown about its centroid to twice its size.
    Eigen::AlignedBox3d box;
    for (const int c : cells[cell])
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
  return locateAround(p_tracked_m);
}

double TetrahedralMesh::overshoot(const Outer& outer, const std::array<double, 4>& weights) {
  // Over its own faces a position may be out by a quarter of the height over each. Over others it is some other
  // tetrahedron's, and whatever it is out there adds up: else one that has but a corner on the hull would reach far.
  double over_own = 0.0;
  double over_others = 0.0;
  for (std::size_t c = 0; c < 4; ++c) {
    const double out = std::max(0.0, -weights[c]);
    if (outer.is_own[c])
      over_own = std::max(over_own, out);
    else
      over_others += out;
  }
  return over_own + over_others;
}

std::optional<TetrahedralMesh::Location> TetrahedralMesh::locateAround(const Eigen::Vector3d& p_tracked_m) const {
  std::optional<Location> nearest;
  double least = std::numeric_limits<double>::infinity();
  for (const int item : outer_lookup_.near(p_tracked_m)) {
    const Outer& outer = outer_[static_cast<std::size_t>(item)];
    const Location at{outer.cell, weights(cells_[outer.cell], p_tracked_m)};
    if (overshoot(outer, at.weights) > kMargin + kOnFace) continue;
    double out = 0.0;
    for (const double weight : at.weights) out += std::min(0.0, weight) * std::min(0.0, weight);
    if (out >= least) continue;
    least = out;
    nearest = at;
  }
  return nearest;
}

nlohmann::json TetrahedralMesh::toJson() const {
  std::vector<Corners> cells;
  cells.reserve(cells_.size());
  for (const Cell& cell : cells_) cells.push_back(cell.corners);
  return {{"tracked_m", jsonOfPoints(corners_m_)}, {"cells", cells}};
}

TetrahedralMesh TetrahedralMesh::fromJson(const JsonReader& json) {
  std::vector<Eigen::Vector3d> corners_m = pointsFrom(json["tracked_m"]);
  const std::vector<Corners> cells = cellsFrom<4>(json["cells"], corners_m.size());
  return {std::move(corners_m), cells};
}

}  // namespace fieldtrue::correctors
