#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

/// Numbers as sentences show them, independent of the locale, which a desktop program sets and which may write a
/// decimal comma.
namespace fieldtrue::evaluation {

/// An error in mm or degrees: three significant digits or so.
std::string errorText(double value);

/// Percent of a fraction, without the sign.
std::string percentText(double fraction);

/// "(0.10, -0.25, 1.30) m".
std::string pointText(const Eigen::Vector3d& point_m);
/// "(w 0.50, x 0.50, y -0.50, z 0.50)".
std::string turnText(const Eigen::Quaterniond& q);

/// "1 place", "3 places".
std::string countText(std::size_t count, const std::string& one, const std::string& several);

}  // namespace fieldtrue::evaluation
