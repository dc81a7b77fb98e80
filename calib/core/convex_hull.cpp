#include "calib/core/convex_hull.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

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

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

/// One run of Qhull; its messages go nowhere.
class QhullRun {
 public:
  QhullRun(std::vector<double>& coordinates, const char* command)
      : silence_(std::fopen("/dev/null", "w")), qhull_(std::make_unique<qhT>()) {
    qh_zero(qhull_.get(), silence_.get());
    std::string command_text = command;
    succeeded_ = silence_ && qh_new_qhull(qhull_.get(), 3, static_cast<int>(coordinates.size() / 3), coordinates.data(),
                                          False, command_text.data(), nullptr, silence_.get()) == 0;
  }
  QhullRun(const QhullRun&) = delete;
  QhullRun& operator=(const QhullRun&) = delete;
  ~QhullRun() {
    qhT* qh = qhull_.get();
    qh->NOerrexit = True;
    qh_freeqhull(qh, !qh_ALL);
    int blocks = 0;
    int bytes = 0;
    qh_memfreeshort(qh, &blocks, &bytes);
  }
  bool succeeded() const { return succeeded_; }
  std::vector<Eigen::Vector3d> normals() const {
    std::vector<Eigen::Vector3d> normals;
    const qhT* qh = qhull_.get();
    const facetT* facet = nullptr;
    FORALLfacets {
      const Eigen::Vector3d normal(facet->normal[0], facet->normal[1], facet->normal[2]);
      normals.push_back(normal.normalized());
    }
    return normals;
  }

 private:
  std::unique_ptr<std::FILE, CloseFile> silence_;
  std::unique_ptr<qhT> qhull_;
  bool succeeded_ = false;
};

/// Qhull's tolerances are those of coordinates near 1: the points are moved to their middle and scaled alike.
std::vector<double> centeredAndScaled(std::span<const Eigen::Vector3d> points_m) {
  Eigen::Vector3d low = points_m.front();
  Eigen::Vector3d high = points_m.front();
  for (const Eigen::Vector3d& p : points_m) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const double extent_m = (high - low).maxCoeff();
  std::vector<double> coordinates;
  if (!(extent_m > 0.0)) return coordinates;
  coordinates.reserve(points_m.size() * 3);
  for (const Eigen::Vector3d& p : points_m) {
    const Eigen::Vector3d scaled = (p - (low + high) / 2.0) / extent_m;
    coordinates.insert(coordinates.end(), {scaled.x(), scaled.y(), scaled.z()});
  }
  return coordinates;
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
    if (run.succeeded()) return run.normals();
  }
  return std::nullopt;
}

}  // namespace fieldtrue
