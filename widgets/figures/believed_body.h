#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/effects/effect_body.h"

namespace fieldtrue::widgets {

/// Metal or a loop where it is believed to be, with its 90 % region. Reference frame.
struct BelievedBody {
  effects::DrawnShape shape = effects::DrawnShape::kBall;
  std::string name;
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();  ///< Of a plane: any of its points.
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();   ///< Unit; of plane, plate and loop. A plane's points away.
  Eigen::Vector3d side = Eigen::Vector3d::UnitX();     ///< Unit; along a plate's length.
  double radius_m = 0.0;                               ///< Of ball and loop; 0 = not known.
  double length_m = 0.0;                               ///< Of a plate, along `side`.
  double width_m = 0.0;                                ///< Of a plate.
  Eigen::Matrix3d region_m = Eigen::Matrix3d::Zero();  ///< Columns: half axes of the 90 % region of the centre.
  std::optional<double> nearest_m, farthest_m;         ///< Of a plane: 90 % ends along the normal, from center_m.
};

/// How far off the place may be: the largest half axis, or half interval of a plane.
double largestHalf_m(const BelievedBody& body);

/// "Compact metal, +- 4 cm": the name, and how far off the place may be.
std::string bodyLabel(const BelievedBody& body);

}  // namespace fieldtrue::widgets
