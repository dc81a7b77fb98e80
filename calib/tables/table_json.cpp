#include "calib/tables/table_json.h"

#include <nlohmann/json.hpp>

namespace fieldtrue {

namespace {

template <class T>
void put(nlohmann::json& to, std::string_view key, const std::optional<T>& value) {
  if (value) to[std::string(key)] = *value;
}

void take(const JsonReader& from, const std::string& key, std::optional<double>& value) {
  if (const auto found = from.find(key)) value = found->number();
}

void take(const JsonReader& from, const std::string& key, std::optional<std::string>& value) {
  if (const auto found = from.find(key)) value = found->text();
}

NodeRole roleFrom(const JsonReader& json) {
  std::vector<std::string> names;
  for (const auto& [name, role] : kNodeRoles) {
    if (json.raw() == name) return role;
    names.emplace_back(name);
  }
  json.oneOf(names);
  return NodeRole::kFit;
}

nlohmann::json nodeToJson(const Node& node) {
  nlohmann::json to = {{"node", node.node},
                       {"sensor", node.sensor},
                       {"visit", node.visit},
                       {"role", nameOf(node.role)},
                       {"reference_from_sensor", jsonOf(node.reference_from_sensor)},
                       {"tracker_from_sensor", jsonOf(node.tracker_from_sensor)},
                       {"has_orientation", node.has_orientation},
                       {"n_used", node.n_used},
                       {"n_rejected", node.n_rejected},
                       {"n_effective", node.n_effective}};
  put(to, "index", node.index);
  if (node.covariance_m2) to["covariance_m2"] = jsonOf(Eigen::MatrixXd(*node.covariance_m2));
  put(to, "sd_rot_rad", node.sd_rot_rad);
  put(to, "t_start_s", node.t_start_s);
  put(to, "t_end_s", node.t_end_s);
  return to;
}

Node nodeFrom(const JsonReader& from) {
  Node node;
  node.node = from["node"].integer();
  node.sensor = from["sensor"].integer();
  node.visit = from["visit"].integer();
  node.role = roleFrom(from["role"]);
  node.reference_from_sensor = from["reference_from_sensor"].pose();
  node.tracker_from_sensor = from["tracker_from_sensor"].pose();
  node.has_orientation = from["has_orientation"].flag();
  node.n_used = from["n_used"].integer();
  node.n_rejected = from["n_rejected"].integer();
  node.n_effective = from["n_effective"].number();
  if (const auto index = from.find("index")) node.index = index->integers3();
  if (const auto covariance_m2 = from.find("covariance_m2")) node.covariance_m2 = covariance_m2->matrix3();
  take(from, "sd_rot_rad", node.sd_rot_rad);
  take(from, "t_start_s", node.t_start_s);
  take(from, "t_end_s", node.t_end_s);
  return node;
}

}  // namespace

nlohmann::json toJson(const TableMetadata& metadata) {
  nlohmann::json to = {{"frame", metadata.frame},
                       {"alignment", metadata.alignment_known ? "known" : "unknown"},
                       {"other", metadata.other}};
  forEachStatement([&](std::string_view key, auto member) { put(to, key, metadata.*member); });
  if (!metadata.setup.empty()) to["setup"] = metadata.setup;
  return to;
}

TableMetadata metadataFrom(const JsonReader& json) {
  TableMetadata metadata;
  metadata.frame = json["frame"].text();
  metadata.alignment_known = json["alignment"].oneOf({"known", "unknown"}) == "known";
  forEachStatement([&](const char* key, auto member) { take(json, key, metadata.*member); });
  if (const auto setup = json.find("setup")) metadata.setup = setupFrom(*setup);
  if (const auto other = json.find("other")) metadata.other = other->namedTexts();
  return metadata;
}

Setup setupFrom(const JsonReader& json) {
  Setup setup;
  for (const SetupFact& fact : setupFacts())
    if (const auto value = json.find(std::string(fact.key)); value && !value->isNull())
      (void)state(setup, fact.key, value->text());  // The key is a fact's.
  return setup;
}

nlohmann::json toJson(const CalibrationTable& table) {
  nlohmann::json nodes = nlohmann::json::array();
  for (const Node& node : table.nodes) nodes.push_back(nodeToJson(node));
  return {{"metadata", toJson(table.metadata)}, {"nodes", std::move(nodes)}};
}

CalibrationTable tableFrom(const JsonReader& json) {
  return {metadataFrom(json["metadata"]), json["nodes"].list(nodeFrom)};
}

}  // namespace fieldtrue
