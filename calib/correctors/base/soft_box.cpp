#include "calib/correctors/base/soft_box.h"

#include <cmath>

namespace fieldtrue::correctors {

SoftBox SoftBox::around(std::span<const Eigen::Vector3d> p_m, double reach) {
  SoftBox box{p_m.front(), p_m.front(), 0.0};
  for (const Eigen::Vector3d& p : p_m) {
    box.low_m = box.low_m.cwiseMin(p);
    box.high_m = box.high_m.cwiseMax(p);
  }
  box.reach_m = reach * box.longest_m();
  return box;
}

Eigen::Vector3d SoftBox::held_m(const Eigen::Vector3d& p_m) const {
  const Eigen::Vector3d nearest_m = p_m.cwiseMax(low_m).cwiseMin(high_m);
  if (nearest_m == p_m || reach_m <= 0.0) return nearest_m;
  const Eigen::Vector3d beyond_m = p_m - nearest_m;
  return nearest_m + reach_m * (beyond_m / reach_m).array().tanh().matrix();
}

Eigen::Vector3d SoftBox::slope(const Eigen::Vector3d& p_m) const {
  const Eigen::Vector3d nearest_m = p_m.cwiseMax(low_m).cwiseMin(high_m);
  if (nearest_m == p_m) return Eigen::Vector3d::Ones();
  if (reach_m <= 0.0) return (p_m.array() == nearest_m.array()).cast<double>().matrix();
  return 1.0 - ((p_m - nearest_m) / reach_m).array().tanh().square();
}

}  // namespace fieldtrue::correctors
