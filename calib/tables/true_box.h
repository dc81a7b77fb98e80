#pragma once

#include <Eigen/Geometry>
#include <span>

#include "calib/core/calibration_table.h"

namespace fieldtrue {

/// The box around the true positions of some rows, reference frame [m]; empty for none.
inline Eigen::AlignedBox3d trueBox_m(std::span<const Node> nodes) {
  Eigen::AlignedBox3d box_m;
  for (const Node& node : nodes) box_m.extend(node.reference_from_sensor.position_m);
  return box_m;
}

}  // namespace fieldtrue
