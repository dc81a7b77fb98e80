#include "calib/importers/pose_matrix.h"

#include <Eigen/LU>

namespace fieldtrue::importers {

std::string wrongWithPose(const Eigen::Matrix4d& matrix) {
  constexpr double kLargestRotationError = 1e-2;
  if (matrix.row(3) != Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0)) return "the last row is not 0 0 0 1";
  const Eigen::Matrix3d R = matrix.topLeftCorner<3, 3>();
  const double error = (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (error > kLargestRotationError || R.determinant() < 0.0) return "its upper left part is not a rotation";
  return {};
}

}  // namespace fieldtrue::importers
