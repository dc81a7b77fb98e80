#include "tests/support/matchers.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <sstream>

namespace fieldtrue::testing {

namespace {

const Eigen::IOFormat kRow(10, 0, ", ", "; ", "", "", "(", ")");

std::string quaternionText(const Eigen::Quaterniond& q) {
  std::ostringstream text;
  text.precision(10);
  text << "(w " << q.w() << ", x " << q.x() << ", y " << q.y() << ", z " << q.z() << ")";
  return text.str();
}

Match matchOf(bool ok, const std::ostringstream& text) { return {ok, QByteArray::fromStdString(text.str())}; }

std::ostringstream stream() {
  std::ostringstream text;
  text.precision(10);
  return text;
}

}  // namespace

Match near(const Eigen::Vector3d& seen_m, const Eigen::Vector3d& expected_m, double tolerance_m) {
  const double distance_m = (seen_m - expected_m).norm();
  std::ostringstream text = stream();
  text << "seen " << seen_m.transpose().format(kRow) << " m, expected " << expected_m.transpose().format(kRow)
       << " m, apart " << distance_m * 1e3 << " mm, allowed " << tolerance_m * 1e3 << " mm";
  return matchOf(distance_m <= tolerance_m, text);
}

Match near(double seen, double expected, double tolerance) {
  std::ostringstream text = stream();
  text << "seen " << seen << ", expected " << expected << ", apart " << seen - expected << ", allowed " << tolerance;
  return matchOf(std::abs(seen - expected) <= tolerance, text);
}

Match near(const Eigen::Quaterniond& seen, const Eigen::Quaterniond& expected, double tolerance_rad) {
  const double angle_rad = angleBetween_rad(seen, expected);
  std::ostringstream text = stream();
  text << "seen " << quaternionText(seen) << ", expected " << quaternionText(expected) << ", apart " << angle_rad
       << " rad, allowed " << tolerance_rad << " rad";
  return matchOf(angle_rad <= tolerance_rad, text);
}

Match near(const Pose& seen, const Pose& expected, double tolerance_m, double tolerance_rad) {
  const Match position = near(seen.position_m, expected.position_m, tolerance_m);
  const Match orientation = near(seen.orientation, expected.orientation, tolerance_rad);
  return {position.ok && orientation.ok, "position: " + position.text + "\norientation: " + orientation.text};
}

Match nearMatrix(const Eigen::MatrixXd& seen, const Eigen::MatrixXd& expected, double tolerance) {
  std::ostringstream text = stream();
  const bool same_shape = seen.rows() == expected.rows() && seen.cols() == expected.cols();
  const double apart = same_shape && seen.size() > 0 ? (seen - expected).cwiseAbs().maxCoeff() : 0.0;
  text << "seen " << seen.format(kRow) << ", expected " << expected.format(kRow) << ", largest difference " << apart
       << ", allowed " << tolerance;
  return matchOf(same_shape && apart <= tolerance, text);
}

Match sameBits(double seen, double expected) {
  std::ostringstream text = stream();
  text.precision(17);
  text << "seen " << seen << ", expected the same bits as " << expected;
  return matchOf(std::bit_cast<std::uint64_t>(seen) == std::bit_cast<std::uint64_t>(expected), text);
}

Match sameBits(const Pose& seen, const Pose& expected) {
  for (int axis = 0; axis < 3; ++axis) {
    const Match match = sameBits(seen.position_m[axis], expected.position_m[axis]);
    if (!match) return {false, "position[" + QByteArray::number(axis) + "]: " + match.text};
  }
  for (int part = 0; part < 4; ++part) {
    const Match match = sameBits(seen.orientation.coeffs()[part], expected.orientation.coeffs()[part]);
    if (!match) return {false, "orientation coefficient " + QByteArray::number(part) + ": " + match.text};
  }
  return {true, "same bits"};
}

Match holdsAll(const std::string& message, const QList<QByteArray>& fragments) {
  const QByteArray text = QByteArray::fromStdString(message);
  for (const QByteArray& fragment : fragments) {
    if (!text.contains(fragment)) return {false, "\"" + text + "\" does not say \"" + fragment + "\""};
  }
  return {true, text};
}

}  // namespace fieldtrue::testing
