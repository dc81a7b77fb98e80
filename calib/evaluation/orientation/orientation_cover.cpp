#include "calib/evaluation/orientation/orientation_cover.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "calib/core/number_text.h"
#include "calib/core/units.h"
#include "calib/evaluation/base/figures.h"
#include "calib/evaluation/orientation/orientation_rows.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::evaluation {
namespace {

/// Orientations spread evenly over all there are.
/// @source Alexa 2022, Super-Fibonacci spirals: fast, low-discrepancy sampling of SO(3), CVPR, algorithm 1
std::vector<Eigen::Quaterniond> evenOrientations(int count) {
  constexpr double kPhi = std::numbers::sqrt2;
  constexpr double kPsi = 1.533751168755204288118041;
  std::vector<Eigen::Quaterniond> all;
  for (int i = 0; i < count; ++i) {
    const double s = i + 0.5;
    const double inner = std::sqrt(s / count);
    const double outer = std::sqrt(1.0 - s / count);
    const double alpha = 2.0 * std::numbers::pi * s / kPhi;
    const double beta = 2.0 * std::numbers::pi * s / kPsi;
    all.emplace_back(outer * std::cos(beta), inner * std::sin(alpha), inner * std::cos(alpha), outer * std::sin(beta));
  }
  return all;
}

double farthest_deg(std::span<const Eigen::Quaterniond> seen) {
  constexpr int kProbes = 20000;  // About 6 degrees apart.
  double least_cosine = 1.0;
  for (const Eigen::Quaterniond& q : evenOrientations(kProbes)) {
    double nearest = 0.0;
    for (const Eigen::Quaterniond& other : seen) nearest = std::max(nearest, std::abs(q.dot(other)));
    least_cosine = std::min(least_cosine, nearest);
  }
  return 2.0 * kDegPerRad * std::acos(least_cosine);
}

std::string textOf(const OrientationCover& cover) {
  if (cover.n_orientations < 2)
    return "The sensor was held in one way: what it reads in another is not known from these places.";
  const std::string far = std::to_string(std::lround(cover.farthest_deg));
  std::string text = "The sensor was held in " + std::to_string(cover.n_orientations) + " ways, at " +
                     std::to_string(cover.n_turned) + " of " +
                     countText(static_cast<std::size_t>(cover.n_places), "place", "places") +
                     " in two or more; held anyhow it is at most about " + far + " degrees from one of them";
  if (cover.farthest_turned_m && *cover.farthest_turned_m > 0.0)
    text += ", and at most " + fixedText(*cover.farthest_turned_m, 2) + " m from a place where it was turned";
  return text + ".";
}

}  // namespace

bool TurnedPlace::isTurned() const { return distinctRotations(q, kAlike_rad).size() > 1; }

FarthestPlace farthestFrom(const std::vector<TurnedPlace>& places, const std::vector<std::size_t>& some) {
  FarthestPlace farthest;
  std::vector<bool> is_one(places.size(), false);
  for (const std::size_t t : some) is_one[t] = true;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (is_one[i]) continue;
    double nearest_m = std::numeric_limits<double>::infinity();
    // Of a plan with very many places: no farther than is known already is all there is to know.
    for (std::size_t n = 0; n < some.size() && nearest_m > farthest.distance_m; ++n)
      nearest_m = std::min(nearest_m, (places[i].p_m - places[some[n]].p_m).norm());
    if (nearest_m > farthest.distance_m) farthest = {i, nearest_m};
  }
  return farthest;
}

OrientationCover orientationCover(const std::vector<TurnedPlace>& places) {
  std::vector<Eigen::Quaterniond> all;
  std::vector<std::size_t> turned;
  for (std::size_t i = 0; i < places.size(); ++i) {
    all.insert(all.end(), places[i].q.begin(), places[i].q.end());
    if (places[i].isTurned()) turned.push_back(i);
  }
  const std::vector<Eigen::Quaterniond> distinct = distinctRotations(all, kAlike_rad);
  OrientationCover cover;
  cover.n_orientations = static_cast<int>(distinct.size());
  cover.n_places = static_cast<int>(places.size());
  cover.n_turned = static_cast<int>(turned.size());
  cover.farthest_deg = farthest_deg(distinct);
  if (!turned.empty()) cover.farthest_turned_m = farthestFrom(places, turned).distance_m;
  return cover;
}

std::optional<OrientationCover> orientationCover(const CalibrationTable& table) {
  std::map<int, std::size_t> at;
  std::vector<TurnedPlace> places;
  for (const Node& node : nodesOfAskedSensor(table)) {
    if (!node.has_orientation) return std::nullopt;
    const auto [found, is_new] = at.try_emplace(node.node, places.size());
    if (is_new) places.push_back({node.node, node.reference_from_sensor.position_m, {}});
    places[found->second].q.push_back(node.reference_from_sensor.orientation);
  }
  if (places.empty()) return std::nullopt;
  OrientationCover cover = orientationCover(places);
  cover.text = textOf(cover);
  return cover;
}

nlohmann::json toJson(const OrientationCover& cover) {
  return {{"count", cover.n_orientations},
          {"places", cover.n_places},
          {"places_turned", cover.n_turned},
          {"farthest_deg", cover.farthest_deg},
          {"farthest_turned_m", cover.farthest_turned_m ? nlohmann::json(*cover.farthest_turned_m) : nlohmann::json()},
          {"text", cover.text}};
}

}  // namespace fieldtrue::evaluation
