#include "calib/evaluation/base/noise_floor.h"

#include <cmath>
#include <map>

#include "calib/core/units.h"

namespace fieldtrue::evaluation {
namespace {

/// Mean over places of the mean over the rows of a place.
class PlaceMean {
 public:
  void add(int place, double value) {
    sums_[place].first += value;
    sums_[place].second += 1.0;
  }
  double value() const {
    double total = 0.0;
    for (const auto& [place, sum] : sums_) total += sum.first / sum.second;
    return sums_.empty() ? 0.0 : total / static_cast<double>(sums_.size());
  }

 private:
  std::map<int, std::pair<double, double>> sums_;
};

}  // namespace

NoiseFloor noiseFloor(std::span<const Node> nodes, const TableMetadata& metadata) {
  const double tolerance_m = metadata.jig_tolerance_m.value_or(0.0);
  const double tolerance_rad = metadata.jig_tolerance_rad.value_or(0.0);
  PlaceMean position_m2;
  PlaceMean orientation_rad2;
  bool from_samples = false;
  for (const Node& node : nodes) {
    const double n_effective = std::max(1.0, node.n_effective);
    const double sample_m2 = node.covariance_m2 ? node.covariance_m2->trace() / n_effective : 0.0;
    const double sample_rad2 = node.sd_rot_rad ? *node.sd_rot_rad * *node.sd_rot_rad / n_effective : 0.0;
    from_samples = from_samples || node.covariance_m2 || node.sd_rot_rad;
    position_m2.add(node.node, sample_m2 + 3.0 * tolerance_m * tolerance_m);
    if (node.has_orientation) orientation_rad2.add(node.node, sample_rad2 + 3.0 * tolerance_rad * tolerance_rad);
  }
  NoiseFloor floor;
  floor.position_mm = 1000.0 * std::sqrt(position_m2.value());
  floor.orientation_deg = kDegPerRad * std::sqrt(orientation_rad2.value());
  const bool from_jig = metadata.jig_tolerance_m || metadata.jig_tolerance_rad;
  floor.from = from_samples && from_jig ? "samples and jig tolerance"
               : from_samples           ? "samples"
               : from_jig               ? "jig tolerance"
                                        : "not stated";
  return floor;
}

}  // namespace fieldtrue::evaluation
