#include "calib/correctors/cells/cell_json.h"

namespace fieldtrue::correctors {
namespace {

/// Every entry, as many as asked for and at least one.
template <class Read>
auto countedList(const JsonReader& json, std::size_t count, Read read) {
  auto items = json.list(read);
  if (items.empty() || (count > 0 && items.size() != count)) json.refuse("a list with a row for each place");
  return items;
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

std::vector<Eigen::Vector3d> pointsFrom(const JsonReader& json, std::size_t count) {
  return countedList(json, count, [](const JsonReader& row) { return row.vector3(); });
}

std::vector<Eigen::Quaterniond> rotationsFrom(const JsonReader& json, std::size_t count) {
  return countedList(json, count, [](const JsonReader& row) { return row.quaternion(); });
}

}  // namespace fieldtrue::correctors
