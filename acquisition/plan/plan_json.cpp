#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "acquisition/plan/plan_text.h"
#include "calib/core/file_io.h"
#include "calib/core/json_reader.h"

namespace fieldtrue::acquisition {

namespace {

constexpr std::string_view kSchema = "fieldtrue.plan/";
constexpr int kSchemaVersion = 1;
constexpr double kLongest_s = 1e7;

double coordinate_m(const JsonReader& json) {
  if (json.isNumber() && std::abs(json.number()) <= kMaxCoordinate_m) return json.number();
  json.refuse("a number of metres within 1000");
}

/// Whether an object has the keys of a group; who gives one of them must give all.
bool hasGroup(const JsonReader& json, const std::vector<std::string>& keys, const std::string& needed) {
  const auto n_given = std::count_if(keys.begin(), keys.end(), [&](const std::string& key) { return json.has(key); });
  if (n_given > 0 && n_given < std::ssize(keys)) json.fail(needed);
  return n_given > 0;
}

Eigen::Quaterniond orientationFrom(const JsonReader& node) {
  const Eigen::Quaterniond given(node["qw"].number(), node["qx"].number(), node["qy"].number(), node["qz"].number());
  if (given.norm() < 1e-6) node.fail("has a quaternion of zeros; qw, qx, qy and qz must be those of a rotation.");
  // One that is unit already keeps its bits, so that a plan written and read again is the same plan.
  const bool is_unit = std::abs(given.squaredNorm() - 1.0) < 1e-14 && given.w() >= 0.0;
  return is_unit ? given : canonical(given);
}

double timeFrom(const JsonReader& json) {
  if (json.isNumber() && json.number() >= 0.0 && json.number() <= kLongest_s) return json.number();
  json.refuse("seconds since the start, from 0 to 1e7");
}

int gridStep(const JsonReader& json) { return static_cast<int>(json.integer(-kMaxPlaces, kMaxPlaces)); }

PlannedPlace placeFrom(const JsonReader& node, std::map<int, int>& next_visit) {
  PlannedPlace place;
  place.node = static_cast<int>(node["node"].integer(0, std::numeric_limits<int>::max()));
  const auto visit = node.find("visit");
  place.visit = visit ? static_cast<int>(visit->integer(0, kMaxPlaces)) : next_visit[place.node];
  next_visit[place.node] = place.visit + 1;
  Pose& pose = place.reference_from_sensor;
  pose.position_m = {coordinate_m(node["x_m"]), coordinate_m(node["y_m"]), coordinate_m(node["z_m"])};
  if (hasGroup(node, {"qw", "qx", "qy", "qz"}, "needs qw, qx, qy and qz together."))
    pose.orientation = orientationFrom(node);
  if (hasGroup(node, {"i", "j", "k"}, "needs i, j and k together."))
    place.index = {gridStep(node["i"]), gridStep(node["j"]), gridStep(node["k"])};
  if (const auto role = node.find("role"))
    place.role = role->oneOf({"fit", "validation"}) == "validation" ? NodeRole::kValidation : NodeRole::kFit;
  if (const auto time = node.find("t_s")) place.t_s = timeFrom(*time);
  node.refuseOtherKeys();
  return place;
}

std::vector<PlannedPlace> placesFrom(const JsonReader& nodes, bool has_further_visits) {
  std::map<int, int> next_visit;
  std::set<std::pair<int, int>> seen;
  std::vector<PlannedPlace> places;
  for (const JsonReader& node : nodes.entries()) {
    places.push_back(placeFrom(node, next_visit));
    const PlannedPlace& place = places.back();
    if (!seen.insert({place.node, place.visit}).second) {
      node.fail("is node " + std::to_string(place.node) + ", visit " + std::to_string(place.visit) +
                ", which is listed twice.");
    }
    if (place.visit > 0 && has_further_visits)
      node["visit"].refuse("0 when orientations or reseat ask for further visits");
  }
  if (places.empty()) nodes.refuse("a list with at least one node");
  return places;
}

void readGrid(const JsonReader& file, Plan& plan) {
  if (const auto grid = file.find("grid")) {
    if (!grid->raw().is_string()) grid->refuse("text like \"5x5x4@0.3048\"");
    if (const auto read = readGridText(grid->text(), plan); !read) grid->fail(read.error());
  } else if (!file.has("nodes")) {
    file.fail("needs grid or nodes.");
  }
  if (const auto origin = file.find("origin"); origin && !origin->isNull())
    plan.origin_m = origin->vector3(kMaxCoordinate_m, "m");
}

void readVisits(const JsonReader& file, Plan& plan) {
  if (const auto order = file.find("order"))
    plan.order = order->oneOf({"serpentine", "random"}) == "random" ? PlanOrder::kRandom : PlanOrder::kSerpentine;
  if (const auto seed = file.find("seed")) {
    if (!seed->raw().is_number_unsigned()) seed->refuse("a whole number from 0");
    plan.seed = seed->raw().get<std::uint64_t>();
  }
  if (const auto count = file.find("orientations"))
    plan.orientations = static_cast<int>(count->integer(1, kMaxOrientations));
  if (const auto count = file.find("reseat")) plan.reseat = static_cast<int>(count->integer(1, 1000));
  if (const auto base = file.find("pipe_base_m")) plan.pipe_base_m = coordinate_m(*base);
}

Plan planFrom(const JsonReader& file) {
  file.schema(kSchema, kSchemaVersion, "a plan");
  Plan plan;
  readGrid(file, plan);
  readVisits(file, plan);
  if (const auto nodes = file.find("nodes"))
    plan.explicit_places = placesFrom(*nodes, plan.orientations * plan.reseat > 1);
  file.refuseOtherKeys();
  return plan;
}

}  // namespace

Result<Plan> planFromJson(const nlohmann::json& object, const std::string& name) {
  return readJson<Plan>(object, name, planFrom).and_then([&](const Plan& plan) -> Result<Plan> {
    FT_TRY_VOID(checkPlanSize(plan, name));
    return plan;
  });
}

nlohmann::json toJson(const Plan& plan) {
  const auto& [nx, ny, nz] = plan.counts;
  nlohmann::json object{{"schema", std::string(kSchema) + std::to_string(kSchemaVersion)},
                        {"grid", std::to_string(nx) + "x" + std::to_string(ny) + "x" + std::to_string(nz) + "@" +
                                     formatNumber(plan.pitch_m.x()) + "x" + formatNumber(plan.pitch_m.y()) + "x" +
                                     formatNumber(plan.pitch_m.z())},
                        {"order", plan.order == PlanOrder::kRandom ? "random" : "serpentine"},
                        {"seed", plan.seed},
                        {"orientations", plan.orientations},
                        {"reseat", plan.reseat},
                        {"pipe_base_m", plan.pipe_base_m}};
  if (plan.origin_m) object["origin"] = {plan.origin_m->x(), plan.origin_m->y(), plan.origin_m->z()};
  for (const PlannedPlace& place : plan.explicit_places) {
    const Pose& pose = place.reference_from_sensor;
    nlohmann::json node{{"node", place.node},         {"visit", place.visit},       {"x_m", pose.position_m.x()},
                        {"y_m", pose.position_m.y()}, {"z_m", pose.position_m.z()}, {"qw", pose.orientation.w()},
                        {"qx", pose.orientation.x()}, {"qy", pose.orientation.y()}, {"qz", pose.orientation.z()}};
    if (place.index) {
      node["i"] = (*place.index)[0];
      node["j"] = (*place.index)[1];
      node["k"] = (*place.index)[2];
    }
    if (place.role == NodeRole::kValidation) node["role"] = "validation";
    if (place.t_s) node["t_s"] = *place.t_s;
    object["nodes"].push_back(std::move(node));
  }
  return object;
}

}  // namespace fieldtrue::acquisition
