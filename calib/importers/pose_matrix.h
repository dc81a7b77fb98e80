#pragma once

#include <Eigen/Core>
#include <string>

namespace fieldtrue::importers {

/// What keeps a 4x4 matrix from being a pose, empty when nothing. Programs print few digits: a rotation may be off by
/// 1e-2 an element.
std::string wrongWithPose(const Eigen::Matrix4d& matrix);

}  // namespace fieldtrue::importers
