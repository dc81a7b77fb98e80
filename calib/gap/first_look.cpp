#include "calib/gap/first_look.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <vector>

#include "calib/geometry/spacing.h"

namespace fieldtrue::gap {
namespace {

constexpr std::size_t kWorthIt = 3;  ///< Times the places of a first look.

bool counts(const Node& node) {
  return node.role != NodeRole::kSkipped && node.reference_from_sensor.position_m.allFinite() &&
         node.tracker_from_sensor.position_m.allFinite();
}

}  // namespace

std::optional<CalibrationTable> firstLook(const CalibrationTable& table) {
  std::map<int, Eigen::Vector3d> place_m;
  for (const Node& node : table.nodes)
    if (counts(node)) place_m.emplace(node.node, node.reference_from_sensor.position_m);
  if (place_m.size() < kWorthIt * kFirstLookPlaces) return {};
  std::vector<int> numbers;
  std::vector<Eigen::Vector3d> places_m;
  for (const auto& [number, at_m] : place_m) {
    numbers.push_back(number);
    places_m.push_back(at_m);
  }
  std::set<int> chosen;
  for (const std::size_t place : spreadPlaces(places_m, kFirstLookPlaces)) chosen.insert(numbers[place]);
  CalibrationTable part{table.metadata, {}};
  std::copy_if(table.nodes.begin(), table.nodes.end(), std::back_inserter(part.nodes),
               [&](const Node& node) { return counts(node) && chosen.contains(node.node); });
  return part;
}

}  // namespace fieldtrue::gap
