#include "calib/evaluation/common_readings.h"

#include <algorithm>
#include <cmath>

#include "calib/evaluation/region/region_lattice.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::evaluation {

namespace {

using calibration::Corrector;

constexpr std::size_t kMostPoints = 4000;
/// Coils that differ turn their error with the sensor; of the 24 ways in which a cube can lie, twelve spread evenly
/// give the RMS over all of them within 2 %.
constexpr std::size_t kMostOrientations = 12;
/// Of places times orientations, so that a calibration that takes orientation is compared as quickly as others.
constexpr std::size_t kMostReadings = 12000;

std::vector<Eigen::Vector3d> trackedPlaces(const Corrector& corrector) {
  std::vector<Eigen::Vector3d> places_m;
  for (const Node& node : corrector.table().nodes) places_m.push_back(node.tracker_from_sensor.position_m);
  return places_m;
}

bool coversBoth(const Corrector& first, const Corrector& second, const Eigen::Vector3d& p_tracked_m) {
  return first.covers(p_tracked_m) && second.covers(p_tracked_m);
}

std::vector<Eigen::Vector3d> commonPoints(const Corrector& first, const Corrector& second, std::size_t most) {
  const std::vector<Eigen::Vector3d> places_m = trackedPlaces(first);
  const int dimension = std::clamp(pointSpread(places_m).dimension, 0, 3);
  std::vector<Eigen::Vector3d> points_m = latticeInside(places_m, dimension, first.region(), most).points_m;
  const auto is_outside = [&](const Eigen::Vector3d& p_m) { return !coversBoth(first, second, p_m); };
  std::erase_if(points_m, is_outside);
  if (!points_m.empty()) return points_m;
  points_m = trackedPlaces(second);
  std::erase_if(points_m, is_outside);
  return points_m;
}

double nearestAngle_rad(const std::vector<Eigen::Quaterniond>& among, const Eigen::Quaterniond& q) {
  double nearest_rad = HUGE_VAL;
  for (const Eigen::Quaterniond& one : among) nearest_rad = std::min(nearest_rad, angleBetween_rad(one, q));
  return nearest_rad;
}

/// The first, then one after the other that which lies farthest from all before.
std::vector<Eigen::Quaterniond> evenly(const std::vector<Eigen::Quaterniond>& from, std::size_t most) {
  if (from.size() <= most) return from;
  std::vector<Eigen::Quaterniond> chosen = {from.front()};
  while (chosen.size() < most)
    chosen.push_back(*std::max_element(from.begin(), from.end(), [&](const auto& a, const auto& b) {
      return nearestAngle_rad(chosen, a) < nearestAngle_rad(chosen, b);
    }));
  return chosen;
}

void holdSensor(const Corrector& first, const Corrector& second, CommonReadings& readings) {
  std::vector<Eigen::Quaterniond> of_both, of_either = first.orientationsSeen();
  const std::vector<Eigen::Quaterniond> of_second = second.orientationsSeen();
  for (const Eigen::Quaterniond& q : of_either)
    if (nearestAngle_rad(of_second, q) <= correctors::kSameOrientation_rad) of_both.push_back(q);
  of_either.insert(of_either.end(), of_second.begin(), of_second.end());
  readings.is_held_seen_by_both = !of_both.empty();
  readings.held = evenly(of_both.empty() ? of_either : of_both, kMostOrientations);
}

bool asksForOrientation(const Corrector& corrector) {
  return corrector.takesOrientation() || corrector.turnTakesOrientation();
}

}  // namespace

Pose correctedBy(const Corrector& corrector, const Reading& reading) {
  Pose pose = corrector.correct({reading.p_m, reading.held.value_or(Eigen::Quaterniond::Identity())});
  if (!reading.held) pose.position_m = corrector.correctPosition_m(reading.p_m);
  return pose;
}

std::optional<double> uncertainty_m(const Corrector& corrector, const Reading& reading) {
  return reading.held ? corrector.uncertaintyAt_m({reading.p_m, *reading.held}) : corrector.uncertainty_m(reading.p_m);
}

std::vector<Reading> CommonReadings::all() const {
  std::vector<Reading> readings;
  for (const Eigen::Vector3d& p_m : points_m) {
    if (held.empty()) readings.push_back({p_m, std::nullopt});
    for (const Eigen::Quaterniond& q : held) readings.push_back({p_m, q});
  }
  return readings;
}

CommonReadings commonReadings(const Corrector& first, const Corrector& second) {
  CommonReadings readings;
  if (asksForOrientation(first) || asksForOrientation(second)) holdSensor(first, second, readings);
  readings.points_m = commonPoints(first, second, std::min(kMostPoints, kMostReadings / readings.readingsAPlace()));
  return readings;
}

}  // namespace fieldtrue::evaluation
