#include "calib/geometry/region_shares.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "calib/geometry/convex_hull.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue {
namespace {

/// The n-th of a sequence that fills 0 to 1 evenly. @source Halton 1960, Numer. Math. 2 84
double radicalInverse(std::size_t n, std::size_t base) {
  double value = 0.0;
  double digit = 1.0;
  for (; n > 0; n /= base) {
    digit /= static_cast<double>(base);
    value += digit * static_cast<double>(n % base);
  }
  return value;
}

/// Places as they fill a box best: along their principal axes where they lie in a plane or on a line, what they lie off
/// it left out, or where that box is much the smaller; else as they are.
std::vector<Eigen::Vector3d> boxedPlaces_m(std::span<const Eigen::Vector3d> places_m, const PointSpread& spread) {
  constexpr double kMuchSmaller = 0.5;
  std::vector<Eigen::Vector3d> along_m;
  Eigen::AlignedBox3d box, box_along;
  for (const Eigen::Vector3d& place_m : places_m) {
    Eigen::Vector3d at_m = spread.axes.transpose() * (place_m - spread.center_m);
    at_m.tail(3 - spread.dimension).setZero();
    box.extend(place_m);
    box_along.extend(at_m);
    along_m.push_back(at_m);
  }
  if (spread.dimension < 3 || box_along.volume() < kMuchSmaller * box.volume()) return along_m;
  return {places_m.begin(), places_m.end()};
}

/// Outward normals of the faces of the places' hull: of its edges where they are flat, none needed on a line.
/// @return none where Qhull fails
std::optional<std::vector<Eigen::Vector3d>> faceNormals(std::span<const Eigen::Vector3d> places_m, int dimension) {
  if (dimension > 2) return convexHullNormals(places_m);
  std::vector<Eigen::Vector3d> normals;
  if (dimension < 2) return normals;
  std::vector<Eigen::Vector2d> flat_m;
  for (const Eigen::Vector3d& place_m : places_m) flat_m.emplace_back(place_m.head<2>());
  const std::vector<Eigen::Vector2d> corners_m = convexPolygon(std::move(flat_m));
  for (std::size_t k = 0; k < corners_m.size(); ++k) {
    const Eigen::Vector2d edge_m = corners_m[(k + 1) % corners_m.size()] - corners_m[k];
    normals.push_back(Eigen::Vector3d(edge_m.y(), -edge_m.x(), 0.0).normalized());
  }
  return normals;
}

}  // namespace

std::vector<double> regionShares(std::span<const Eigen::Vector3d> places_m) {
  const std::size_t n_points = std::max<std::size_t>(4000, 8 * places_m.size());
  const std::vector<double> alike(places_m.size(), 1.0 / static_cast<double>(places_m.size()));
  const PointSpread spread = pointSpread(places_m);
  if (spread.dimension == 0) return alike;
  const std::vector<Eigen::Vector3d> boxed_m = boxedPlaces_m(places_m, spread);
  const auto normals = faceNormals(boxed_m, spread.dimension);
  if (!normals) return alike;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& place_m : boxed_m) box.extend(place_m);
  std::vector<double> faces_m;
  for (const Eigen::Vector3d& normal : *normals) {
    double most = -std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& place_m : boxed_m) most = std::max(most, normal.dot(place_m));
    faces_m.push_back(most);
  }
  std::vector<double> shares(places_m.size(), 0.0);
  std::size_t inside = 0;
  for (std::size_t n = 1; n <= 40 * n_points && inside < n_points; ++n) {
    const Eigen::Vector3d at(radicalInverse(n, 2), radicalInverse(n, 3), radicalInverse(n, 5));
    const Eigen::Vector3d point_m = box.min() + at.cwiseProduct(box.sizes());
    bool is_inside = true;
    for (std::size_t f = 0; f < faces_m.size() && is_inside; ++f)
      is_inside = (*normals)[f].dot(point_m) <= faces_m[f] + 1e-9;
    if (!is_inside) continue;
    ++inside;
    const auto is_nearer = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
      return (a - point_m).squaredNorm() < (b - point_m).squaredNorm();
    };
    shares[static_cast<std::size_t>(std::min_element(boxed_m.begin(), boxed_m.end(), is_nearer) - boxed_m.begin())] +=
        1.0;
  }
  if (inside == 0) return alike;
  for (double& share : shares) share /= static_cast<double>(inside);
  return shares;
}

}  // namespace fieldtrue
