#include "calib/geometry/region_shares.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "calib/geometry/convex_hull.h"

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

}  // namespace

std::vector<double> regionShares(std::span<const Eigen::Vector3d> places_m) {
  const std::size_t n_points = std::max<std::size_t>(4000, 8 * places_m.size());
  std::vector<double> shares(places_m.size(), 1.0 / static_cast<double>(places_m.size()));
  const auto normals = convexHullNormals(places_m);
  if (!normals) return shares;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& place_m : places_m) box.extend(place_m);
  std::vector<double> faces_m;
  for (const Eigen::Vector3d& normal : *normals) {
    double most = -std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& place_m : places_m) most = std::max(most, normal.dot(place_m));
    faces_m.push_back(most);
  }
  std::fill(shares.begin(), shares.end(), 0.0);
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
    shares[static_cast<std::size_t>(std::min_element(places_m.begin(), places_m.end(), is_nearer) -
                                    places_m.begin())] += 1.0;
  }
  for (double& share : shares) share /= static_cast<double>(std::max<std::size_t>(1, inside));
  return shares;
}

}  // namespace fieldtrue
