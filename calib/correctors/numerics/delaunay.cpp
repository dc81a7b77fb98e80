#include "calib/correctors/numerics/delaunay.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <random>

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace fieldtrue::correctors {
namespace {

/// Far below any measurement and far above rounding, of the extent of the points.
constexpr double kShake = 1e-6;

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

/// Coordinates near 1, where Qhull's tolerances belong, each shaken a little: eight corners of a cube lie on one
/// sphere, and where Qhull must triangulate such a group by itself (Qt), neighbours may choose different diagonals.
std::vector<double> shakenCoordinates(std::span<const Eigen::Vector3d> points_m) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p_m : points_m) box.extend(p_m);
  const double extent_m = box.sizes().maxCoeff();
  std::vector<double> coordinates;
  if (!(extent_m > 0.0)) return coordinates;
  coordinates.reserve(3 * points_m.size());
  std::mt19937_64 generator(1);
  constexpr double kPerStep = 2.0 / 18446744073709551616.0;
  for (const Eigen::Vector3d& p_m : points_m)
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double shake = kShake * (static_cast<double>(generator()) * kPerStep - 1.0);
      coordinates.push_back((p_m[axis] - box.center()[axis]) / extent_m + shake);
    }
  return coordinates;
}

/// One Delaunay run of Qhull; its messages go nowhere.
class DelaunayRun {
 public:
  explicit DelaunayRun(std::vector<double>& coordinates)
      : silence_(std::fopen("/dev/null", "w")), qhull_(std::make_unique<qhT>()) {
    qh_zero(qhull_.get(), silence_.get());
    std::string command = "qhull d Qbb Qt Pp";
    succeeded_ = silence_ && qh_new_qhull(qhull_.get(), 3, static_cast<int>(coordinates.size() / 3), coordinates.data(),
                                          False, command.data(), nullptr, silence_.get()) == 0;
  }
  DelaunayRun(const DelaunayRun&) = delete;
  DelaunayRun& operator=(const DelaunayRun&) = delete;
  ~DelaunayRun() {
    qhT* qh = qhull_.get();
    qh->NOerrexit = True;
    qh_freeqhull(qh, !qh_ALL);
    int blocks = 0;
    int bytes = 0;
    qh_memfreeshort(qh, &blocks, &bytes);
  }
  bool succeeded() const { return succeeded_; }
  std::vector<std::array<int, 4>> tetrahedra() const {
    std::vector<std::array<int, 4>> cells;
    qhT* qh = qhull_.get();
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

 private:
  std::unique_ptr<std::FILE, CloseFile> silence_;
  std::unique_ptr<qhT> qhull_;
  bool succeeded_ = false;
};

}  // namespace

Result<std::vector<std::array<int, 4>>> delaunayTetrahedra(std::span<const Eigen::Vector3d> points_m,
                                                           const std::string& name) {
  if (points_m.size() < 4)
    return fail(ErrorCode::kTooFewNodes, name + " needs at least 4 places, got " + std::to_string(points_m.size()));
  std::vector<double> coordinates = shakenCoordinates(points_m);
  if (!coordinates.empty()) {
    const DelaunayRun run(coordinates);
    if (run.succeeded()) return run.tetrahedra();
  }
  return fail(ErrorCode::kDegenerate, name +
                                          " needs places that enclose a volume, and Qhull finds none between these " +
                                          std::to_string(points_m.size()));
}

}  // namespace fieldtrue::correctors
