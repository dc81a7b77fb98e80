#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "acquisition/plan/plan_text.h"
#include "calib/core/file_io.h"

namespace fieldtrue::acquisition {

namespace {

using nlohmann::json;

constexpr std::string_view kSchema = "fieldtrue.plan/";
constexpr int kSchemaVersion = 1;

/// Access to the members of one JSON object with messages that name it.
struct JsonObject {
  const json& object;
  std::string where;

  tl::unexpected<Error> expected(const std::string& key, const std::string& what) const {
    const std::string seen = object.contains(key) ? object.at(key).dump(-1, ' ', false, json::error_handler_t::replace)
                                                  : std::string("nothing");
    return fail(ErrorCode::kBadInput, where + ": " + key + " must be " + what + ", got " + seen.substr(0, 60));
  }

  Result<void> allowOnly(const std::vector<std::string>& known) const {
    for (const auto& [key, value] : object.items()) {
      if (std::find(known.begin(), known.end(), key) != known.end()) continue;
      std::string list;
      for (const std::string& name : known) list += (list.empty() ? "" : ", ") + name;
      return fail(ErrorCode::kBadInput, where + ": unknown key " + key + " (known: " + list + ")");
    }
    return {};
  }

  std::optional<double> coordinate_m(const std::string& key) const {
    if (!object.contains(key) || !object.at(key).is_number()) return std::nullopt;
    const double value = object.at(key).get<double>();
    return std::abs(value) <= kMaxCoordinate_m ? std::optional(value) : std::nullopt;
  }

  std::optional<std::int64_t> integer(const std::string& key, std::int64_t low, std::int64_t high) const {
    if (!object.contains(key) || !object.at(key).is_number_integer()) return std::nullopt;
    if (object.at(key).is_number_unsigned() && object.at(key).get<std::uint64_t>() > INT64_MAX) return std::nullopt;
    const auto value = object.at(key).get<std::int64_t>();
    return value >= low && value <= high ? std::optional(value) : std::nullopt;
  }
};

Result<void> readNodePosition(const JsonObject& node, PlannedPlace& place) {
  const std::array<std::string, 3> keys{"x_m", "y_m", "z_m"};
  for (int axis = 0; axis < 3; ++axis) {
    const std::string& key = keys[static_cast<std::size_t>(axis)];
    const auto value = node.coordinate_m(key);
    if (!value) return node.expected(key, "a number of metres within 1000");
    place.reference_from_sensor.position_m[axis] = *value;
  }
  return {};
}

Result<void> readNodeOrientation(const JsonObject& node, PlannedPlace& place) {
  const std::array<std::string, 4> keys{"qw", "qx", "qy", "qz"};
  const auto given =
      std::count_if(keys.begin(), keys.end(), [&](const auto& key) { return node.object.contains(key); });
  if (given == 0) return {};
  std::array<double, 4> q{};
  for (std::size_t part = 0; part < 4; ++part) {
    const auto value = node.coordinate_m(keys[part]);
    if (!value) return node.expected(keys[part], "a number (qw, qx, qy and qz stand together)");
    q[part] = *value;
  }
  const Eigen::Quaterniond quaternion(q[0], q[1], q[2], q[3]);
  if (quaternion.norm() < 1e-6) return node.expected("qw", "part of a quaternion that is not zero");
  // One that is unit already keeps its bits, so that a plan written and read again is the same plan.
  const bool unit = std::abs(quaternion.squaredNorm() - 1.0) < 1e-14 && q[0] >= 0.0;
  place.reference_from_sensor.orientation = unit ? quaternion : canonical(quaternion);
  return {};
}

Result<void> readNodeIndex(const JsonObject& node, PlannedPlace& place) {
  const std::array<std::string, 3> keys{"i", "j", "k"};
  const auto given =
      std::count_if(keys.begin(), keys.end(), [&](const auto& key) { return node.object.contains(key); });
  if (given == 0) return {};
  std::array<int, 3> index{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto value = node.integer(keys[axis], -kMaxPlaces, kMaxPlaces);
    if (!value) return node.expected(keys[axis], "a whole number (i, j and k stand together)");
    index[axis] = static_cast<int>(*value);
  }
  place.index = index;
  return {};
}

Result<void> readNodeRole(const JsonObject& node, PlannedPlace& place) {
  if (!node.object.contains("role")) return {};
  const json& role = node.object.at("role");
  if (role != "fit" && role != "validation") return node.expected("role", "\"fit\" or \"validation\"");
  place.role = role == "validation" ? NodeRole::kValidation : NodeRole::kFit;
  return {};
}

Result<PlannedPlace> readNode(const JsonObject& node, std::map<int, int>& next_visit) {
  if (!node.object.is_object()) return fail(ErrorCode::kBadInput, node.where + ": must be an object");
  if (auto known =
          node.allowOnly({"node", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "i", "j", "k", "role", "visit"});
      !known) {
    return tl::unexpected(known.error());
  }
  PlannedPlace place;
  const auto number = node.integer("node", 0, INT32_MAX);
  if (!number) return node.expected("node", "a whole number from 0");
  place.node = static_cast<int>(*number);
  const auto visit = node.integer("visit", 0, kMaxPlaces);
  if (node.object.contains("visit") && !visit) return node.expected("visit", "a whole number from 0");
  place.visit = visit ? static_cast<int>(*visit) : next_visit[place.node];
  next_visit[place.node] = place.visit + 1;
  for (const auto read : {readNodePosition, readNodeOrientation, readNodeIndex, readNodeRole}) {
    if (auto part = read(node, place); !part) return tl::unexpected(part.error());
  }
  return place;
}

Result<void> readNodes(const JsonObject& file, Plan& plan) {
  if (!file.object.contains("nodes")) return {};
  const json& nodes = file.object.at("nodes");
  if (!nodes.is_array() || nodes.empty()) return file.expected("nodes", "a list with at least one node");
  std::map<int, int> next_visit;
  std::set<std::pair<int, int>> seen;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const JsonObject node{nodes[i], file.where + ": nodes[" + std::to_string(i) + "]"};
    auto place = readNode(node, next_visit);
    if (!place) return tl::unexpected(place.error());
    if (!seen.insert({place->node, place->visit}).second) {
      return fail(ErrorCode::kBadInput, node.where + ": node " + std::to_string(place->node) + " visit " +
                                            std::to_string(place->visit) + " is listed twice");
    }
    if (place->visit > 0 && plan.orientations * plan.reseat > 1) {
      return node.expected("visit", "0 when orientations or reseat ask for further visits");
    }
    plan.explicit_places.push_back(*place);
  }
  return {};
}

Result<void> readGridKeys(const JsonObject& file, Plan& plan) {
  if (file.object.contains("grid")) {
    if (!file.object.at("grid").is_string()) return file.expected("grid", "text like \"5x5x4@0.3048\"");
    const auto text = file.object.at("grid").get<std::string>();
    if (auto grid = readGridText(text, plan); !grid) {
      return fail(ErrorCode::kBadInput, file.where + ": grid " + grid.error().message);
    }
  } else if (!file.object.contains("nodes")) {
    return fail(ErrorCode::kBadInput, file.where + ": needs grid or nodes");
  }
  if (!file.object.contains("origin") || file.object.at("origin").is_null()) return {};
  const json& origin = file.object.at("origin");
  if (!origin.is_array() || origin.size() != 3) return file.expected("origin", "[x, y, z] in metres");
  Eigen::Vector3d value;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!origin[axis].is_number() || !(std::abs(origin[axis].get<double>()) <= kMaxCoordinate_m)) {
      return file.expected("origin", "[x, y, z] in metres, within 1000");
    }
    value[static_cast<Eigen::Index>(axis)] = origin[axis].get<double>();
  }
  plan.origin_m = value;
  return {};
}

Result<void> readVisitKeys(const JsonObject& file, Plan& plan) {
  const json& object = file.object;
  if (object.contains("order")) {
    if (object.at("order") != "serpentine" && object.at("order") != "random") {
      return file.expected("order", "\"serpentine\" or \"random\"");
    }
    plan.order = object.at("order") == "random" ? PlanOrder::kRandom : PlanOrder::kSerpentine;
  }
  if (object.contains("seed")) {
    if (!object.at("seed").is_number_unsigned()) return file.expected("seed", "a whole number from 0");
    plan.seed = object.at("seed").get<std::uint64_t>();
  }
  if (object.contains("orientations")) {
    const auto count = file.integer("orientations", 1, kMaxOrientations);
    if (!count) return file.expected("orientations", "a whole number from 1 to " + std::to_string(kMaxOrientations));
    plan.orientations = static_cast<int>(*count);
  }
  if (object.contains("reseat")) {
    const auto count = file.integer("reseat", 1, 1000);
    if (!count) return file.expected("reseat", "a whole number from 1 to 1000");
    plan.reseat = static_cast<int>(*count);
  }
  if (object.contains("pipe_base_m")) {
    const auto base = file.coordinate_m("pipe_base_m");
    if (!base) return file.expected("pipe_base_m", "a number of metres within 1000");
    plan.pipe_base_m = *base;
  }
  return {};
}

Result<void> checkSchema(const JsonObject& file) {
  if (!file.object.is_object()) return fail(ErrorCode::kBadInput, file.where + ": a plan must be a JSON object");
  if (!file.object.contains("schema")) return {};
  const json& schema = file.object.at("schema");
  const std::string text = schema.is_string() ? schema.get<std::string>() : std::string();
  const auto version =
      text.starts_with(kSchema) ? parseNumber<int>(std::string_view(text).substr(kSchema.size())) : std::nullopt;
  if (!version || *version < 1) return file.expected("schema", "\"fieldtrue.plan/1\"");
  if (*version > kSchemaVersion) {
    return fail(ErrorCode::kNewerVersion,
                file.where + ": this plan was written by a newer version of Fieldtrue (" + text + ")");
  }
  return {};
}

}  // namespace

Result<Plan> planFromJson(const nlohmann::json& object, const std::string& name) {
  const JsonObject file{object, name};
  if (auto schema = checkSchema(file); !schema) return tl::unexpected(schema.error());
  if (auto known = file.allowOnly(
          {"schema", "grid", "origin", "order", "seed", "orientations", "reseat", "pipe_base_m", "nodes"});
      !known) {
    return tl::unexpected(known.error());
  }
  Plan plan;
  for (const auto read : {readGridKeys, readVisitKeys, readNodes}) {
    if (auto part = read(file, plan); !part) return tl::unexpected(part.error());
  }
  if (auto size = checkPlanSize(plan, name); !size) return tl::unexpected(size.error());
  return plan;
}

nlohmann::json toJson(const Plan& plan) {
  const auto& [nx, ny, nz] = plan.counts;
  json object{{"schema", std::string(kSchema) + std::to_string(kSchemaVersion)},
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
    json node{{"node", place.node},         {"visit", place.visit},       {"x_m", pose.position_m.x()},
              {"y_m", pose.position_m.y()}, {"z_m", pose.position_m.z()}, {"qw", pose.orientation.w()},
              {"qx", pose.orientation.x()}, {"qy", pose.orientation.y()}, {"qz", pose.orientation.z()}};
    if (place.index) {
      node["i"] = (*place.index)[0];
      node["j"] = (*place.index)[1];
      node["k"] = (*place.index)[2];
    }
    if (place.role == NodeRole::kValidation) node["role"] = "validation";
    object["nodes"].push_back(std::move(node));
  }
  return object;
}

}  // namespace fieldtrue::acquisition
