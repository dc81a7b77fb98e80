#include "calib/correctors/regrid/surrounding_tetrahedron.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace fieldtrue::correctors {
namespace {

/// Six volumes of a tetrahedron below this, with the farthest candidate at distance 1, is one of four points in a
/// plane.
constexpr double kFlat = 1e-9;
/// A point may lie outside a face by this share of the height above it: 3 um of a foot, rounding in files.
constexpr double kOutsideShare = 1e-5;
/// Volumes that differ by rounding only are equal.
constexpr double kEqualShare = 1e-9;

/// Candidates around the point as origin, the farthest at distance 1, and a . (b x c) of every three of them.
class Candidates {
 public:
  Candidates(std::span<const Eigen::Vector3d> candidates_m, const Eigen::Vector3d& point_m)
      : n_(candidates_m.size()), squared_distance_(n_), products_(n_ * n_ * n_) {
    std::vector<Eigen::Vector3d> u(candidates_m.begin(), candidates_m.end());
    double farthest_m = 0.0;
    for (Eigen::Vector3d& v : u) {
      v -= point_m;
      farthest_m = std::max(farthest_m, v.norm());
    }
    for (std::size_t i = 0; i < n_; ++i) {
      if (farthest_m > 0.0) u[i] /= farthest_m;
      squared_distance_[i] = u[i].squaredNorm();
    }
    for (std::size_t a = 0; a < n_; ++a)
      for (std::size_t b = a + 1; b < n_; ++b) {
        const Eigen::Vector3d normal = u[a].cross(u[b]);
        for (std::size_t c = b + 1; c < n_; ++c) products_[slot(a, b, c)] = normal.dot(u[c]);
      }
  }

  std::size_t count() const { return n_; }

  /// Six times the volume where the tetrahedron of ascending corners surrounds the origin, 0 where it does not.
  double surroundingVolume(std::size_t a, std::size_t b, std::size_t c, std::size_t d) const {
    const double of_a = products_[slot(b, c, d)];
    const double of_b = -products_[slot(a, c, d)];
    const double of_c = products_[slot(a, b, d)];
    const double of_d = -products_[slot(a, b, c)];
    const double volume = of_a + of_b + of_c + of_d;
    if (std::abs(volume) < kFlat) return 0.0;
    const double least_share = std::min({of_a / volume, of_b / volume, of_c / volume, of_d / volume});
    return least_share >= -kOutsideShare ? std::abs(volume) : 0.0;
  }

  double squaredDistances(std::size_t a, std::size_t b, std::size_t c, std::size_t d) const {
    return squared_distance_[a] + squared_distance_[b] + squared_distance_[c] + squared_distance_[d];
  }

 private:
  std::size_t slot(std::size_t a, std::size_t b, std::size_t c) const { return (a * n_ + b) * n_ + c; }

  std::size_t n_;
  std::vector<double> squared_distance_;
  std::vector<double> products_;
};

}  // namespace

std::optional<std::array<std::size_t, 4>> smallestSurroundingTetrahedron(std::span<const Eigen::Vector3d> candidates_m,
                                                                         const Eigen::Vector3d& point_m) {
  const Candidates candidates(candidates_m, point_m);
  std::optional<std::array<std::size_t, 4>> best;
  double best_volume = HUGE_VAL;
  double best_distances = HUGE_VAL;
  const std::size_t n = candidates.count();
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = a + 1; b < n; ++b)
      for (std::size_t c = b + 1; c < n; ++c)
        for (std::size_t d = c + 1; d < n; ++d) {
          const double volume = candidates.surroundingVolume(a, b, c, d);
          if (volume == 0.0 || volume > best_volume * (1.0 + kEqualShare)) continue;
          const double distances = candidates.squaredDistances(a, b, c, d);
          const bool is_smaller = volume < best_volume * (1.0 - kEqualShare);
          if (!is_smaller && distances >= best_distances * (1.0 - kEqualShare)) continue;
          best = {a, b, c, d};
          best_volume = volume;
          best_distances = distances;
        }
  return best;
}

}  // namespace fieldtrue::correctors
