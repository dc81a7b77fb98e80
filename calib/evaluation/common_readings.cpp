#include "calib/evaluation/common_readings.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

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
/// From how many readings is climbed, none within a step of another: of 8 the largest change of two calibrations of 60
/// places was 3 % short of a dense search, of 16 less than 1 %.
constexpr std::size_t kMostStarts = 16;
/// Of a lattice's step: smaller ones move the largest change by less than 1 %.
constexpr double kFinestStep = 1.0 / 64.0;

std::vector<Eigen::Vector3d> trackedPlaces(const Corrector& corrector) {
  std::vector<Eigen::Vector3d> places_m;
  for (const Node& node : corrector.table().nodes) places_m.push_back(node.tracker_from_sensor.position_m);
  return places_m;
}

bool coversBoth(const Corrector& first, const Corrector& second, const Eigen::Vector3d& p_tracked_m) {
  return first.covers(p_tracked_m) && second.covers(p_tracked_m);
}

void spreadPoints(const Corrector& first, const Corrector& second, std::size_t most, CommonReadings& readings) {
  const std::vector<Eigen::Vector3d> places_m = trackedPlaces(first);
  const int dimension = std::clamp(pointSpread(places_m).dimension, 0, 3);
  RegionLattice lattice = latticeInside(places_m, dimension, first.region(), most);
  const auto is_outside = [&](const Eigen::Vector3d& p_m) { return !coversBoth(first, second, p_m); };
  std::erase_if(lattice.points_m, is_outside);
  readings.points_m = std::move(lattice.points_m);
  readings.step_m = lattice.step_m;
  if (!readings.points_m.empty()) return;
  readings.points_m = trackedPlaces(second);
  readings.step_m = 0.0;
  std::erase_if(readings.points_m, is_outside);
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

void addHeld(const Eigen::Vector3d& p_m, const std::vector<Eigen::Quaterniond>& held, std::vector<Reading>& readings) {
  if (held.empty()) readings.push_back({p_m, std::nullopt});
  for (const Eigen::Quaterniond& q : held) readings.push_back({p_m, q});
}

bool asksForOrientation(const Corrector& corrector) {
  return corrector.takesOrientation() || corrector.turnTakesOrientation();
}

struct Found {
  Reading reading;
  double figure = 0.0;
};

/// The places that either was fitted on, as far as both cover them.
std::vector<Reading> readingsAtPlaces(const Corrector& first, const Corrector& second, const CommonReadings& common) {
  std::vector<Reading> readings;
  for (const Corrector* one : {&first, &second}) {
    std::set<int> places;
    for (const Node& node : one->table().nodes)
      if (const Eigen::Vector3d& p_m = node.tracker_from_sensor.position_m;
          coversBoth(first, second, p_m) && places.insert(node.node).second)
        addHeld(p_m, common.held, readings);
  }
  return readings;
}

/// The largest first, none within a distance of one before.
std::vector<Found> worstApart(std::vector<Found> all, double apart_m) {
  std::stable_sort(all.begin(), all.end(), [](const Found& a, const Found& b) { return a.figure > b.figure; });
  std::vector<Found> worst;
  for (const Found& one : all) {
    const auto is_near = [&](const Found& other) { return (other.reading.p_m - one.reading.p_m).norm() < apart_m; };
    if (std::none_of(worst.begin(), worst.end(), is_near)) worst.push_back(one);
    if (worst.size() == kMostStarts) break;
  }
  return worst;
}

/// Steps to all 26 sides of a cube, ever finer ones: along the slanted faces of a region as well as inside.
Found climb(const Corrector& first, const Corrector& second, double step_m, Found at,
            const std::function<double(const Reading&)>& figure) {
  for (double length_m = step_m; length_m > kFinestStep * step_m; length_m *= 0.5) {
    for (bool has_moved = true; has_moved;) {
      has_moved = false;
      const Found from = at;
      for (int side = 0; side < 27; ++side) {
        const Eigen::Vector3i towards(side % 3 - 1, side / 3 % 3 - 1, side / 9 - 1);
        const Reading next{from.reading.p_m + length_m * towards.cast<double>().normalized(), from.reading.held};
        if (towards.isZero() || !coversBoth(first, second, next.p_m)) continue;
        if (const double there = figure(next); there > at.figure) {
          at = {next, there};
          has_moved = true;
        }
      }
    }
  }
  return at;
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
  for (const Eigen::Vector3d& p_m : points_m) addHeld(p_m, held, readings);
  return readings;
}

CommonReadings commonReadings(const Corrector& first, const Corrector& second) {
  CommonReadings readings;
  if (asksForOrientation(first) || asksForOrientation(second)) holdSensor(first, second, readings);
  spreadPoints(first, second, std::min(kMostPoints, kMostReadings / readings.readingsAPlace()), readings);
  return readings;
}

Reading worstReading(const Corrector& first, const Corrector& second, const CommonReadings& common,
                     const std::vector<double>& on_lattice, const std::function<double(const Reading&)>& figure) {
  const std::vector<Reading> readings = common.all();
  FT_CHECK(!readings.empty() && readings.size() == on_lattice.size());
  std::vector<Found> known;
  for (std::size_t i = 0; i < readings.size(); ++i) known.push_back({readings[i], on_lattice[i]});
  for (const Reading& reading : readingsAtPlaces(first, second, common)) known.push_back({reading, figure(reading)});
  std::vector<Found> found;
  for (const Found& start : worstApart(std::move(known), common.step_m))
    found.push_back(climb(first, second, common.step_m, start, figure));
  return std::max_element(found.begin(), found.end(),
                          [](const Found& a, const Found& b) { return a.figure < b.figure; })
      ->reading;
}

}  // namespace fieldtrue::evaluation
