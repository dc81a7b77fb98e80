#include "calib/correctors/cells/cell_json.h"

namespace fieldtrue::correctors {
namespace {

void needCount(const nlohmann::json& json, std::size_t count) {
  if (!json.is_array() || json.empty() || (count > 0 && json.size() != count))
    throwMalformed("an array with a row for each place is needed, got " + json.dump().substr(0, 60));
}

}  // namespace

nlohmann::json jsonOfPoints(const std::vector<Eigen::Vector3d>& points) {
  nlohmann::json json = nlohmann::json::array();
  for (const Eigen::Vector3d& point : points) json.push_back(jsonOf(point));
  return json;
}

nlohmann::json jsonOfRotations(const std::vector<Eigen::Quaterniond>& rotations) {
  nlohmann::json json = nlohmann::json::array();
  for (const Eigen::Quaterniond& rotation : rotations) json.push_back(jsonOf(rotation));
  return json;
}

std::vector<Eigen::Vector3d> pointsFrom(const nlohmann::json& json, std::size_t count) {
  needCount(json, count);
  std::vector<Eigen::Vector3d> points;
  points.reserve(json.size());
  for (const nlohmann::json& row : json) points.push_back(vectorFrom(row));
  return points;
}

std::vector<Eigen::Quaterniond> rotationsFrom(const nlohmann::json& json, std::size_t count) {
  needCount(json, count);
  std::vector<Eigen::Quaterniond> rotations;
  rotations.reserve(json.size());
  for (const nlohmann::json& row : json) rotations.push_back(quaternionFrom(row));
  return rotations;
}

}  // namespace fieldtrue::correctors
