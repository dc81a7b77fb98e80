#include "calib/evaluation/orientation/planned_orientations.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "calib/core/file_io.h"
#include "calib/core/place_name.h"
#include "calib/core/units.h"
#include "calib/correctors/base/sensor_coils.h"
#include "calib/evaluation/orientation/orientation_rows.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::evaluation {
namespace {

/// A strain is told when its SD is below a fifth of what real coils differ by (about 1 %).
constexpr double kTold = 0.002;
/// A place so far from one where the sensor is turned, as a share of the plan's extent, is advised to be turned at too.
constexpr double kFarShare = 0.34;
constexpr std::size_t kMostAdvised = 6;

/// Tracker frame.
std::vector<TurnedPlace> turnedPlaces(std::span<const PlannedPlace> plan, const Pose& tracker_from_reference) {
  std::map<int, std::size_t> at;
  std::vector<TurnedPlace> places;
  for (const PlannedPlace& stop : plan) {
    if (stop.role == NodeRole::kSkipped) continue;
    const Pose tracked = tracker_from_reference * stop.reference_from_sensor;
    const auto [found, is_new] = at.try_emplace(stop.node, places.size());
    if (is_new) places.push_back({stop.node, tracked.position_m, {}});
    places[found->second].q.push_back(tracked.orientation);
  }
  return places;
}

/// Columns: strains without a change of volume, of unit norm as matrices.
Eigen::Matrix<double, 6, PlannedOrientations::kCoilWays> coilWays() {
  Eigen::Matrix<double, 6, PlannedOrientations::kCoilWays> ways;
  ways.setZero();
  ways.col(0).head<3>() = Eigen::Vector3d(1.0, -1.0, 0.0) / std::sqrt(2.0);
  ways.col(1).head<3>() = Eigen::Vector3d(1.0, 1.0, -2.0) / std::sqrt(6.0);
  ways.bottomRightCorner<3, 3>() = std::sqrt(0.5) * Eigen::Matrix3d::Identity();
  return ways;
}

/// SD of each way, ascending: from what changes between the visits of a place, whatever the field does there.
Eigen::VectorXd coilSd(const std::vector<TurnedPlace>& places, double placing_sd_m) {
  constexpr int kWays = PlannedOrientations::kCoilWays;
  Eigen::Matrix<double, kWays, kWays> information = Eigen::Matrix<double, kWays, kWays>::Zero();
  for (const TurnedPlace& place : places) {
    std::vector<Eigen::Matrix<double, 3, kWays>> shifts;
    Eigen::Matrix<double, 3, kWays> mean = Eigen::Matrix<double, 3, kWays>::Zero();
    for (const Eigen::Quaterniond& q : place.q) {
      shifts.emplace_back(correctors::coilDerivative(correctors::CoilEffect::kShift, {place.p_m, q}) * coilWays());
      mean += shifts.back() / static_cast<double>(place.q.size());
    }
    for (const auto& shift : shifts) information += (shift - mean).transpose() * (shift - mean);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, kWays, kWays>> eigen(information);
  Eigen::VectorXd sd = placing_sd_m * eigen.eigenvalues().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  return sd.reverse();
}

/// Where to turn the sensor too: one after the other the place farthest from all where it is turned.
void advisePlaces(const std::vector<TurnedPlace>& places, PlannedOrientations& planned) {
  Eigen::AlignedBox3d box;
  std::vector<std::size_t> turned;
  for (std::size_t i = 0; i < places.size(); ++i) {
    box.extend(places[i].p_m);
    if (places[i].isTurned()) turned.push_back(i);
  }
  if (turned.empty()) return;
  for (std::size_t i = 0; i < kMostAdvised; ++i) {
    const FarthestPlace farthest = farthestFrom(places, turned);
    if (farthest.distance_m <= kFarShare * box.diagonal().norm()) return;
    planned.turn_here.push_back(places[farthest.place].node);
    turned.push_back(farthest.place);
  }
}

std::string namesOf(std::span<const PlannedPlace> plan, const std::vector<int>& nodes) {
  std::vector<Node> named;
  for (const PlannedPlace& place : plan) {
    named.emplace_back();
    named.back().node = place.node;
    named.back().index = place.index;
  }
  return PlaceNames(named).list(nodes);
}

std::string coilText(const PlannedOrientations& planned) {
  const std::string ways = std::to_string(PlannedOrientations::kCoilWays);
  if (planned.cover.n_turned == 0)
    return "How the sensor's coils differ cannot be told: no place is visited in two of them.";
  const std::string told = "Of the " + ways + " ways in which the sensor's coils may differ they tell " +
                           std::to_string(planned.coil_ways_told);
  if (planned.coil_ways_told < PlannedOrientations::kCoilWays)
    return told + ": turn it about another axis too, or at more places.";
  return told + ", the worst to " + formatNumber(std::round(1e4 * *planned.coil_sd) / 100.0) + " %.";
}

std::string textOf(std::span<const PlannedPlace> plan, const PlannedOrientations& planned) {
  const std::string far = std::to_string(std::lround(planned.cover.farthest_deg));
  if (planned.cover.n_orientations < 2)
    return "One orientation: a correction holds for a sensor held that way. If it will be turned, plan 4 orientations "
           "or "
           "more; fewer do not tell how its coils differ.";
  std::string text = std::to_string(planned.cover.n_orientations) + " orientations, at " +
                     std::to_string(planned.cover.n_turned) + " of " + std::to_string(planned.cover.n_places) +
                     " places two or more: a sensor held anyhow is at most about " + far +
                     " degrees from one of them. " + coilText(planned);
  if (!planned.turn_here.empty())
    text += " Turn it also at " + namesOf(plan, planned.turn_here) + ": up to " +
            formatNumber(std::round(100.0 * *planned.cover.farthest_turned_m) / 100.0) +
            " m from there to a place where it is turned.";
  return text;
}

}  // namespace

PlannedOrientations plannedOrientations(std::span<const PlannedPlace> plan, const Pose& tracker_from_reference,
                                        double placing_sd_m) {
  const std::vector<TurnedPlace> places = turnedPlaces(plan, tracker_from_reference);
  PlannedOrientations planned;
  planned.cover = orientationCover(places);
  const Eigen::VectorXd sd = coilSd(places, placing_sd_m);
  planned.coil_ways_told = static_cast<int>((sd.array() < kTold).count());
  if (planned.coil_ways_told > 0) planned.coil_sd = sd[planned.coil_ways_told - 1];
  advisePlaces(places, planned);
  planned.text = textOf(plan, planned);
  return planned;
}

nlohmann::json toJson(const PlannedOrientations& planned) {
  nlohmann::json json = toJson(planned.cover);
  json.update({{"coil_ways", PlannedOrientations::kCoilWays},
               {"coil_ways_told", planned.coil_ways_told},
               {"coil_sd", planned.coil_sd ? nlohmann::json(*planned.coil_sd) : nlohmann::json()},
               {"turn_here", planned.turn_here},
               {"text", planned.text}});
  return json;
}

}  // namespace fieldtrue::evaluation
