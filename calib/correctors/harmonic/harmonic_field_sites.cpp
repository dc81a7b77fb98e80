#include "calib/correctors/harmonic/harmonic_field_sites.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace fieldtrue::correctors {
namespace {

/// In extents of the box: nearer to places or transmitter a source is sharper than the places can tell.
constexpr double kLeastDistance = 0.1;

bool isAllowed(const Eigen::Vector3d& at_m, const Box& box) {
  const double least_m = kLeastDistance * box.extent_m();
  return box.distance_m(at_m) > least_m && at_m.norm() > least_m;
}

void addSurface(const Box& box, double distance_m, double pitch_m, std::vector<Site>& sites) {
  const Eigen::Vector3d low_m = box.low_m.array() - distance_m;
  const Eigen::Vector3d size_m = (box.high_m - box.low_m).array() + 2.0 * distance_m;
  std::array<int, 3> steps{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    steps[axis] = std::max(1, static_cast<int>(std::ceil(size_m[static_cast<Eigen::Index>(axis)] / pitch_m)));
  for (int i = 0; i <= steps[0]; ++i) {
    for (int j = 0; j <= steps[1]; ++j) {
      for (int k = 0; k <= steps[2]; ++k) {
        const bool on_surface = i == 0 || i == steps[0] || j == 0 || j == steps[1] || k == 0 || k == steps[2];
        const Eigen::Vector3d share(double(i) / steps[0], double(j) / steps[1], double(k) / steps[2]);
        const Eigen::Vector3d at_m = low_m + share.cwiseProduct(size_m);
        if (on_surface && isAllowed(at_m, box)) sites.push_back({at_m, 0.5 * pitch_m});
      }
    }
  }
}

}  // namespace

bool isAllowedSite(const Site& site, const Box& box) { return site.at_m.isZero() || isAllowed(site.at_m, box); }

double Box::distance_m(const Eigen::Vector3d& p_m) const {
  return (low_m - p_m).cwiseMax(p_m - high_m).cwiseMax(0.0).norm();
}

std::vector<Site> candidateSites(const Box& box) {
  const double extent_m = box.extent_m();
  std::vector<Site> sites{{Eigen::Vector3d::Zero(), 0.0}};
  addSurface(box, 0.16 * extent_m, 0.27 * extent_m, sites);
  addSurface(box, 0.40 * extent_m, 0.53 * extent_m, sites);
  addSurface(box, 1.00 * extent_m, 1.20 * extent_m, sites);
  return sites;
}

std::vector<Site> refinedSites(const Site& site, const Box& box) {
  std::vector<Site> sites;
  constexpr double kLeastReach = 0.03;  // Of the extent: 7 cm in a room of 2.4 m.
  if (site.reach_m < kLeastReach * box.extent_m()) return sites;
  const double reach_m = 0.5 * site.reach_m;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector3d at_m = site.at_m + side * reach_m * Eigen::Vector3d::Unit(axis);
      if (isAllowed(at_m, box)) sites.push_back({at_m, reach_m});
    }
  }
  return sites;
}

}  // namespace fieldtrue::correctors
