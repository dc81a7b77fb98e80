#include "calib/correctors/numerics/delaunay.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <iterator>
#include <random>

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

#include "calib/geometry/qhull_run.h"

namespace fieldtrue::correctors {
namespace {

/// Far below any measurement and far above rounding, of the extent of the points.
constexpr double kShake = 1e-6;

/// Coordinates near 1, where Qhull's tolerances belong, each shaken a little: eight corners of a cube lie on one
/// sphere, and where Qhull must triangulate such a group by itself (Qt), neighbours may choose different diagonals.
std::vector<double> shakenCoordinates(std::span<const Eigen::Vector3d> points_m) {
  std::vector<double> coordinates = centeredAndScaled(points_m);
  std::mt19937_64 generator(1);
  constexpr double kPerStep = 2.0 / 18446744073709551616.0;
  for (double& coordinate : coordinates) coordinate += kShake * (static_cast<double>(generator()) * kPerStep - 1.0);
  return coordinates;
}

std::vector<Delaunay::Corners> tetrahedraOf(const QhullRun& run) {
  std::vector<Delaunay::Corners> cells;
  qhT* qh = run.get();
  facetT* facet = nullptr;
  FORALLfacets {
    if (facet->upperdelaunay || qh_setsize(qh, facet->vertices) != 4) continue;
    Delaunay::Corners cell{};
    std::size_t c = 0;
    vertexT* vertex = nullptr;
    vertexT** vertexp = nullptr;
    FOREACHvertex_(facet->vertices) cell[c++] = qh_pointid(qh, vertex->point);
    std::sort(cell.begin(), cell.end());
    cells.push_back(cell);
  }
  std::sort(cells.begin(), cells.end());
  return cells;
}

/// @param coordinates as QhullRun takes them
std::optional<std::vector<Delaunay::Corners>> triangulated(std::vector<double> coordinates) {
  if (coordinates.size() == 12) return {{{0, 1, 2, 3}}};
  const QhullRun run(coordinates, "qhull d Qbb Qt Pp");
  if (!run.succeeded()) return std::nullopt;
  return tetrahedraOf(run);
}

/// Whether the origin lies in the ball through four points.
bool ballHoldsOrigin(const std::array<Eigen::Vector3d, 4>& x) {
  Eigen::Matrix4d lifted;
  for (std::size_t c = 0; c < 4; ++c) lifted.row(static_cast<Eigen::Index>(c)) << x[c].transpose(), x[c].squaredNorm();
  const double turn = (x[1] - x[0]).dot((x[2] - x[0]).cross(x[3] - x[0]));
  return lifted.determinant() * turn < 0.0;
}

}  // namespace

Result<Delaunay> Delaunay::of(std::span<const Eigen::Vector3d> points_m, const std::string& name) {
  if (points_m.size() < 4)
    return fail(ErrorCode::kTooFewNodes, name + " needs at least 4 places, got " + std::to_string(points_m.size()));
  Delaunay delaunay;
  delaunay.coordinates_ = shakenCoordinates(points_m);
  if (!delaunay.coordinates_.empty()) {
    if (auto tetrahedra = triangulated(delaunay.coordinates_)) {
      delaunay.tetrahedra_ = *std::move(tetrahedra);
      return delaunay;
    }
  }
  return fail(ErrorCode::kDegenerate, name +
                                          " needs places that enclose a volume, and Qhull finds none between these " +
                                          std::to_string(points_m.size()));
}

Eigen::Vector3d Delaunay::at(int point) const {
  return Eigen::Map<const Eigen::Vector3d>(coordinates_.data() + 3 * static_cast<std::ptrdiff_t>(point));
}

/// @return false where the hole cannot be filled
bool Delaunay::takeOut(int point, std::vector<Corners>& cells) const {
  std::vector<int> around;
  const auto is_at_point = [&](const Corners& cell) {
    return std::find(cell.begin(), cell.end(), point) != cell.end();
  };
  for (const Corners& cell : cells)
    if (is_at_point(cell))
      std::copy_if(cell.begin(), cell.end(), std::back_inserter(around), [&](int c) { return c != point; });
  cells.erase(std::remove_if(cells.begin(), cells.end(), is_at_point), cells.end());
  std::sort(around.begin(), around.end());
  around.erase(std::unique(around.begin(), around.end()), around.end());
  if (around.size() < 4) return true;
  std::vector<double> coordinates;
  for (const int c : around)
    for (const double x : at(c)) coordinates.push_back(x);
  const auto between = triangulated(std::move(coordinates));
  if (!between) return false;
  // Of those between the points around, the ones in the hole are those that the point was in the way of.
  for (const Corners& cell : *between) {
    Corners numbers{};
    std::array<Eigen::Vector3d, 4> from_point;
    for (std::size_t c = 0; c < 4; ++c) {
      numbers[c] = around[static_cast<std::size_t>(cell[c])];
      from_point[c] = at(numbers[c]) - at(point);
    }
    if (ballHoldsOrigin(from_point)) cells.push_back(numbers);
  }
  return true;
}

std::optional<std::vector<Delaunay::Corners>> Delaunay::without(std::span<const std::size_t> points) const {
  std::vector<Corners> cells = tetrahedra_;
  for (const std::size_t point : points)
    if (!takeOut(static_cast<int>(point), cells)) return std::nullopt;
  std::sort(cells.begin(), cells.end());
  return cells;
}

}  // namespace fieldtrue::correctors
