#include "calib/geometry/convex_hull.h"

#include <algorithm>
#include <cmath>

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

#include "calib/geometry/qhull_run.h"

namespace fieldtrue {

namespace {

/// Twice the area of the triangle o a b, positive when it turns left.
double turn(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return (a.x() - o.x()) * (b.y() - o.y()) - (a.y() - o.y()) * (b.x() - o.x());
}

/// Half of the hull: the chain that turns left all the way.
template <class Iterator>
std::vector<Eigen::Vector2d> leftTurningChain(Iterator first, Iterator last, double flat_area) {
  std::vector<Eigen::Vector2d> chain;
  for (; first != last; ++first) {
    while (chain.size() >= 2 && turn(chain[chain.size() - 2], chain.back(), *first) <= flat_area) chain.pop_back();
    chain.push_back(*first);
  }
  return chain;
}

std::vector<Eigen::Vector3d> facetNormals(const QhullRun& run) {
  std::vector<Eigen::Vector3d> normals;
  const qhT* qh = run.get();
  const facetT* facet = nullptr;
  FORALLfacets {
    const Eigen::Vector3d normal(facet->normal[0], facet->normal[1], facet->normal[2]);
    normals.push_back(normal.normalized());
  }
  return normals;
}

}  // namespace

std::vector<Eigen::Vector2d> convexPolygon(std::vector<Eigen::Vector2d> points) {
  if (points.size() < 3) return {};
  std::sort(points.begin(), points.end(), [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  double extent = 0.0;
  for (const Eigen::Vector2d& p : points) extent = std::max(extent, (p - points.front()).norm());
  const double flat_area = 1e-12 * extent * extent;
  std::vector<Eigen::Vector2d> corners = leftTurningChain(points.begin(), points.end(), flat_area);
  const std::vector<Eigen::Vector2d> upper = leftTurningChain(points.rbegin(), points.rend(), flat_area);
  if (corners.size() + upper.size() < 5) return {};
  corners.pop_back();
  corners.insert(corners.end(), upper.begin(), upper.end() - 1);
  return corners;
}

std::optional<std::vector<Eigen::Vector3d>> convexHullNormals(std::span<const Eigen::Vector3d> points_m) {
  if (points_m.size() < 4) return std::nullopt;
  std::vector<double> coordinates = centeredAndScaled(points_m);
  if (coordinates.empty()) return std::nullopt;
  // QJ joggles the input where merging facets does not help (Qhull manual, "Imprecision problems").
  for (const char* command : {"qhull Pp", "qhull QJ Pp"}) {
    const QhullRun run(coordinates, command);
    if (run.succeeded()) return facetNormals(run);
  }
  return std::nullopt;
}

}  // namespace fieldtrue
