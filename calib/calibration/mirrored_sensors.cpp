#include "calib/calibration/mirrored_sensors.h"

#include <vector>

#include "calib/geometry/geometry.h"
#include "calib/tables/table_sensors.h"

namespace fieldtrue::calibration {
namespace {

std::vector<int> mirroredSensors(std::span<const Node> nodes) {
  std::vector<int> mirrored;
  for (const int sensor : sensorsOf(nodes)) {
    std::vector<Eigen::Vector3d> p_true_m, p_tracked_m;
    for (const Node& node : nodesOfSensor(nodes, sensor)) {
      p_true_m.push_back(node.reference_from_sensor.position_m);
      p_tracked_m.push_back(node.tracker_from_sensor.position_m);
    }
    if (isMirrorImage(p_true_m, p_tracked_m)) mirrored.push_back(sensor);
  }
  return mirrored;
}

}  // namespace

std::string mirroredText(std::span<const Node> nodes) {
  const std::vector<int> mirrored = mirroredSensors(nodes);
  if (mirrored.empty()) return {};
  const std::string whose = sensorsOf(nodes).size() > 1 ? " of " + sensorsText(mirrored) : "";
  return "the readings" + whose +
         " are a mirror image of their places: an axis has the wrong sign, or two are exchanged";
}

}  // namespace fieldtrue::calibration
