#include "calib/evaluation/base/figures.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "calib/core/number_text.h"
#include "calib/core/pose.h"

namespace fieldtrue::evaluation {

std::string errorText(double value) {
  return fixedText(value, value >= 9.95 ? (value >= 99.5 ? 0 : 1) : (value >= 0.0995 ? 2 : 4));
}

std::string percentText(double fraction) { return fixedText(100.0 * fraction, std::abs(fraction) < 0.2 ? 1 : 0); }

std::string pointText(const Eigen::Vector3d& point_m) {
  return "(" + fixedText(point_m.x(), 2) + ", " + fixedText(point_m.y(), 2) + ", " + fixedText(point_m.z(), 2) + ") m";
}

std::string turnText(const Eigen::Quaterniond& q) {
  const Eigen::Quaterniond shown = canonical(q);
  return "(w " + fixedText(shown.w(), 2) + ", x " + fixedText(shown.x(), 2) + ", y " + fixedText(shown.y(), 2) +
         ", z " + fixedText(shown.z(), 2) + ")";
}

std::string countText(std::size_t count, const std::string& one, const std::string& several) {
  return std::to_string(count) + " " + (count == 1 ? one : several);
}

}  // namespace fieldtrue::evaluation
