#include "calib/correctors/numerics/delaunay.h"

#include <algorithm>
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

std::vector<std::array<int, 4>> tetrahedraOf(const QhullRun& run) {
  std::vector<std::array<int, 4>> cells;
  qhT* qh = run.get();
  facetT* facet = nullptr;
  FORALLfacets {
    if (facet->upperdelaunay || qh_setsize(qh, facet->vertices) != 4) continue;
    std::array<int, 4> cell{};
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

}  // namespace

Result<std::vector<std::array<int, 4>>> delaunayTetrahedra(std::span<const Eigen::Vector3d> points_m,
                                                           const std::string& name) {
  if (points_m.size() < 4)
    return fail(ErrorCode::kTooFewNodes, name + " needs at least 4 places, got " + std::to_string(points_m.size()));
  std::vector<double> coordinates = shakenCoordinates(points_m);
  if (!coordinates.empty()) {
    const QhullRun run(coordinates, "qhull d Qbb Qt Pp");
    if (run.succeeded()) return tetrahedraOf(run);
  }
  return fail(ErrorCode::kDegenerate, name +
                                          " needs places that enclose a volume, and Qhull finds none between these " +
                                          std::to_string(points_m.size()));
}

}  // namespace fieldtrue::correctors
