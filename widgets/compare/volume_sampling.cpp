#include "widgets/compare/volume_sampling.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "calib/core/units.h"
#include "calib/correctors/regrid/regrid.h"
#include "calib/geometry/geometry.h"
#include "widgets/figures/scene_space.h"

namespace fieldtrue::widgets {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kWidthPitches = 0.5;

std::vector<Eigen::Vector3d> pointsOf(const std::map<int, Eigen::Vector3d>& places_m) {
  std::vector<Eigen::Vector3d> points_m;
  for (const auto& [node, position_m] : places_m) points_m.push_back(position_m);
  return points_m;
}

/// Fills the lattice, one layer at a time beside each other.
VolumeField sample(VolumeField lattice, const RunControl& control,
                   const std::function<double(const Eigen::Vector3d& at_m)>& value_mm) {
  const std::size_t layer = static_cast<std::size_t>(lattice.count[0]) * static_cast<std::size_t>(lattice.count[1]);
  control.parallel_for(static_cast<std::size_t>(lattice.count[2]), [&](std::size_t k) {
    if (control.stop.stop_requested()) return;
    for (std::size_t i = k * layer; i < (k + 1) * layer; ++i) lattice.values_mm[i] = value_mm(lattice.point_m(i));
  });
  return lattice;
}

Eigen::Vector3d corrected_m(const calibration::Corrector& corrector, const Eigen::Vector3d& p_tracked_m,
                            const Held& held) {
  return held ? corrector.correct(Pose{p_tracked_m, *held}).position_m : corrector.correctPosition_m(p_tracked_m);
}

}  // namespace

std::vector<Eigen::Quaterniond> waysHeld(const CalibrationTable& table) {
  constexpr double kWithin_rad = 5.0 * kRadPerDeg;
  constexpr std::size_t kMost = 24;
  std::vector<Eigen::Quaterniond> held;
  for (const Node& node : table.nodes)
    if (node.has_orientation && node.role != NodeRole::kSkipped) held.push_back(node.tracker_from_sensor.orientation);
  std::vector<Eigen::Quaterniond> ways = distinctRotations(held, kWithin_rad);
  if (ways.size() < 2) return {};
  ways.resize(std::min(ways.size(), kMost));
  return ways;
}

VolumeField latticeAround(const CalibrationTable& table, int most_points) {
  const std::vector<Eigen::Vector3d> points_m = pointsOf(truePositions_m(table));
  VolumeField lattice;
  if (points_m.empty()) return lattice;
  Eigen::Vector3d low_m = points_m.front(), high_m = points_m.front();
  for (const Eigen::Vector3d& point_m : points_m) {
    low_m = low_m.cwiseMin(point_m);
    high_m = high_m.cwiseMax(point_m);
  }
  const double step_m = std::max((high_m - low_m).maxCoeff() / (most_points - 1), 1e-6);
  lattice.low_m = low_m;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const double length_m = high_m[a] - low_m[a];
    lattice.count[axis] = std::max(2, static_cast<int>(std::lround(length_m / step_m)) + 1);
    // A flat set of places still gets two layers, a step apart around it.
    lattice.step_m[a] = length_m > 0.0 ? length_m / (lattice.count[axis] - 1) : step_m;
    if (length_m <= 0.0) lattice.low_m[a] -= 0.5 * step_m;
  }
  lattice.values_mm.assign(lattice.size(), kNan);
  return lattice;
}

VolumeField correctionVolume(const calibration::Corrector& corrector, const Held& held, VolumeField lattice,
                             const RunControl& control) {
  const Pose reference_from_tracker = corrector.alignment().reference_from_tracker;
  const Pose tracker_from_reference = inverse(reference_from_tracker);
  return sample(std::move(lattice), control, [&](const Eigen::Vector3d& at_m) {
    const Eigen::Vector3d p_tracked_m = tracker_from_reference * at_m;
    if (!corrector.covers(p_tracked_m)) return kNan;
    return 1000.0 * (corrected_m(corrector, p_tracked_m, held) - at_m).norm();
  });
}

VolumeField differenceVolume(const calibration::Corrector& a, const calibration::Corrector& b, const Held& held,
                             VolumeField lattice, const RunControl& control) {
  const Pose tracker_from_reference = inverse(a.alignment().reference_from_tracker);
  return sample(std::move(lattice), control, [&](const Eigen::Vector3d& at_m) {
    const Eigen::Vector3d p_tracked_m = tracker_from_reference * at_m;
    if (!a.covers(p_tracked_m) || !b.covers(p_tracked_m)) return kNan;
    return 1000.0 * (corrected_m(a, p_tracked_m, held) - corrected_m(b, p_tracked_m, held)).norm();
  });
}

VolumeField uncertaintyVolume(const calibration::Corrector& corrector, const Held& held, VolumeField lattice,
                              const RunControl& control) {
  const Pose tracker_from_reference = inverse(corrector.alignment().reference_from_tracker);
  return sample(std::move(lattice), control, [&](const Eigen::Vector3d& at_m) {
    const Eigen::Vector3d p_tracked_m = tracker_from_reference * at_m;
    if (!corrector.covers(p_tracked_m)) return kNan;
    const std::optional<double> sd_m =
        held ? corrector.uncertaintyAt_m(Pose{p_tracked_m, *held}) : corrector.uncertainty_m(p_tracked_m);
    return sd_m ? 1000.0 * *sd_m : kNan;
  });
}

VolumeField heldOutVolume(const evaluation::Comparison& comparison, const CalibrationTable& table,
                          const std::vector<double>& errors_mm, VolumeField lattice, const RunControl& control) {
  const std::map<int, Eigen::Vector3d> true_m = truePositions_m(table);
  std::vector<Eigen::Vector3d> places_m;
  std::vector<double> squares_mm2;
  for (std::size_t i = 0; i < comparison.places.size() && i < errors_mm.size(); ++i) {
    const auto place = true_m.find(comparison.places[i]);
    if (place == true_m.end() || !std::isfinite(errors_mm[i])) continue;
    places_m.push_back(place->second);
    squares_mm2.push_back(errors_mm[i] * errors_mm[i]);
  }
  if (places_m.empty()) return lattice;
  correctors::RegridOptions options;
  options.method = correctors::RegridMethod::kLivingston;
  options.pitch_m = gridPitch_m(places_m).minCoeff();
  options.width_pitches = kWidthPitches;
  const correctors::Regridder regridder(places_m, options);
  return sample(std::move(lattice), control, [&](const Eigen::Vector3d& at_m) {
    const std::vector<correctors::RegridWeight> weights = regridder.weightsAt(at_m);
    if (weights.empty()) return kNan;
    double square_mm2 = 0.0;
    for (const correctors::RegridWeight& share : weights) square_mm2 += share.weight * squares_mm2[share.place];
    return std::sqrt(square_mm2);
  });
}

std::vector<double> uncertaintyAtPlaces_mm(const calibration::Corrector& corrector,
                                           const evaluation::Comparison& comparison, const CalibrationTable& table) {
  std::map<int, double> sum_mm, count;
  for (const Node& node : table.nodes) {
    if (node.role == NodeRole::kSkipped) continue;
    const std::optional<double> sd_m = node.has_orientation
                                           ? corrector.uncertaintyAt_m(node.tracker_from_sensor)
                                           : corrector.uncertainty_m(node.tracker_from_sensor.position_m);
    sum_mm[node.node] += sd_m ? 1000.0 * *sd_m : kNan;
    count[node.node] += 1.0;
  }
  std::vector<double> sds_mm;
  for (const int place : comparison.places)
    sds_mm.push_back(count.contains(place) ? sum_mm[place] / count[place] : kNan);
  return sds_mm;
}

}  // namespace fieldtrue::widgets
