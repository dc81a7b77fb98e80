#include "calib/calibration/table_json.h"

#include "calib/correctors/base/json_values.h"

namespace fieldtrue::calibration {
namespace {

using nlohmann::json;

template <class T>
void put(json& to, const char* key, const std::optional<T>& value) {
  if (value) to[key] = *value;
}

template <class T>
void take(const json& from, const char* key, std::optional<T>& value) {
  if (const auto found = from.find(key); found != from.end()) value = found->template get<T>();
}

const char* roleName(NodeRole role) {
  switch (role) {
    case NodeRole::kFit:
      return "fit";
    case NodeRole::kValidation:
      return "validation";
    case NodeRole::kSkipped:
      return "skipped";
  }
  return "fit";
}

NodeRole roleFrom(const std::string& name) {
  for (const NodeRole role : {NodeRole::kFit, NodeRole::kValidation, NodeRole::kSkipped})
    if (name == roleName(role)) return role;
  correctors::throwMalformed("role must be fit, validation or skipped, got " + name);
}

json metadataToJson(const TableMetadata& metadata) {
  json to = {{"frame", metadata.frame}, {"alignment", metadata.alignment_known ? "known" : "unknown"}};
  put(to, "tracker", metadata.tracker);
  put(to, "rig", metadata.rig);
  put(to, "date", metadata.date);
  put(to, "excitation", metadata.excitation);
  put(to, "carrier_hz", metadata.carrier_hz);
  put(to, "rate_hz", metadata.rate_hz);
  put(to, "quantum_m", metadata.quantum_m);
  put(to, "jig_tolerance_m", metadata.jig_tolerance_m);
  put(to, "jig_tolerance_rad", metadata.jig_tolerance_rad);
  put(to, "alignment_tolerance_m", metadata.alignment_tolerance_m);
  put(to, "alignment_tolerance_rad", metadata.alignment_tolerance_rad);
  to["other"] = metadata.other;
  return to;
}

TableMetadata metadataFromJson(const json& from) {
  TableMetadata metadata;
  metadata.frame = from.at("frame").get<std::string>();
  metadata.alignment_known = from.at("alignment").get<std::string>() == "known";
  take(from, "tracker", metadata.tracker);
  take(from, "rig", metadata.rig);
  take(from, "date", metadata.date);
  take(from, "excitation", metadata.excitation);
  take(from, "carrier_hz", metadata.carrier_hz);
  take(from, "rate_hz", metadata.rate_hz);
  take(from, "quantum_m", metadata.quantum_m);
  take(from, "jig_tolerance_m", metadata.jig_tolerance_m);
  take(from, "jig_tolerance_rad", metadata.jig_tolerance_rad);
  take(from, "alignment_tolerance_m", metadata.alignment_tolerance_m);
  take(from, "alignment_tolerance_rad", metadata.alignment_tolerance_rad);
  metadata.other = from.at("other").get<std::map<std::string, std::string>>();
  return metadata;
}

json nodeToJson(const Node& node) {
  json to = {{"node", node.node},
             {"sensor", node.sensor},
             {"visit", node.visit},
             {"role", roleName(node.role)},
             {"reference_from_sensor", correctors::jsonOf(node.reference_from_sensor)},
             {"tracker_from_sensor", correctors::jsonOf(node.tracker_from_sensor)},
             {"has_orientation", node.has_orientation},
             {"n_used", node.n_used},
             {"n_rejected", node.n_rejected},
             {"n_effective", node.n_effective}};
  put(to, "index", node.index);
  if (node.covariance_m2) to["covariance_m2"] = correctors::jsonOf(Eigen::MatrixXd(*node.covariance_m2));
  put(to, "sd_rot_rad", node.sd_rot_rad);
  put(to, "t_start_s", node.t_start_s);
  put(to, "t_end_s", node.t_end_s);
  return to;
}

Node nodeFromJson(const json& from) {
  Node node;
  node.node = from.at("node").get<int>();
  node.sensor = from.at("sensor").get<int>();
  node.visit = from.at("visit").get<int>();
  node.role = roleFrom(from.at("role").get<std::string>());
  node.reference_from_sensor = correctors::poseFrom(from.at("reference_from_sensor"));
  node.tracker_from_sensor = correctors::poseFrom(from.at("tracker_from_sensor"));
  node.has_orientation = from.at("has_orientation").get<bool>();
  node.n_used = from.at("n_used").get<int>();
  node.n_rejected = from.at("n_rejected").get<int>();
  node.n_effective = from.at("n_effective").get<double>();
  take(from, "index", node.index);
  if (const auto found = from.find("covariance_m2"); found != from.end()) {
    const Eigen::MatrixXd covariance_m2 = correctors::matrixFrom(*found, 3);
    if (covariance_m2.rows() != 3) correctors::throwMalformed("covariance_m2 must be a 3 by 3 matrix");
    node.covariance_m2 = covariance_m2;
  }
  take(from, "sd_rot_rad", node.sd_rot_rad);
  take(from, "t_start_s", node.t_start_s);
  take(from, "t_end_s", node.t_end_s);
  return node;
}

}  // namespace

json tableToJson(const CalibrationTable& table) {
  json nodes = json::array();
  for (const Node& node : table.nodes) nodes.push_back(nodeToJson(node));
  return {{"metadata", metadataToJson(table.metadata)}, {"nodes", std::move(nodes)}};
}

CalibrationTable tableFromJson(const json& json) {
  CalibrationTable table;
  table.metadata = metadataFromJson(json.at("metadata"));
  for (const nlohmann::json& node : json.at("nodes")) table.nodes.push_back(nodeFromJson(node));
  return table;
}

}  // namespace fieldtrue::calibration
