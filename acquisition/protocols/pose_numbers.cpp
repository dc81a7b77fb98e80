#include "acquisition/protocols/pose_numbers.h"

#include <cmath>

#include "calib/core/units.h"

namespace fieldtrue::acquisition {
namespace {

/// Readings at or beyond this are markers of a missing reading (-3.7e28 in recordings), not lengths or angles.
constexpr double kMissingAbove = 1e9;

bool isReading(const auto& v) { return v.allFinite() && v.cwiseAbs().maxCoeff() < kMissingAbove; }

enum class OrientationCheck { kGood, kMissing, kDamaged, kNone };

OrientationCheck orientationOf(const PoseNumbers& numbers, double unit_tolerance, Eigen::Quaterniond& orientation) {
  if (numbers.quaternion_wxyz) {
    const Eigen::Vector4d& q = *numbers.quaternion_wxyz;
    if (!isReading(q)) return OrientationCheck::kMissing;
    if (std::abs(q.norm() - 1.0) > unit_tolerance) return OrientationCheck::kDamaged;
    orientation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
    return OrientationCheck::kGood;
  }
  const auto& rows = numbers.direction_cosines;
  if (rows[0] && rows[1] && rows[2]) {
    Eigen::Matrix3d matrix;
    for (Eigen::Index i = 0; i < 3; ++i) matrix.row(i) = rows[static_cast<std::size_t>(i)]->transpose();
    if (!matrix.allFinite() || matrix.cwiseAbs().maxCoeff() >= kMissingAbove) return OrientationCheck::kMissing;
    if ((matrix * matrix.transpose() - Eigen::Matrix3d::Identity()).norm() > 2.0 * unit_tolerance ||
        matrix.determinant() < 0.0) {
      return OrientationCheck::kDamaged;
    }
    orientation = Eigen::Quaterniond(matrix).normalized();
    return OrientationCheck::kGood;
  }
  if (numbers.euler_deg) {
    constexpr double kRadPerDeg = 0.017453292519943295769;
    if (!isReading(*numbers.euler_deg)) return OrientationCheck::kMissing;
    if (numbers.euler_deg->cwiseAbs().maxCoeff() > 360.0) return OrientationCheck::kDamaged;
    orientation = rotationFromEuler(*numbers.euler_deg * kRadPerDeg);
    return OrientationCheck::kGood;
  }
  return OrientationCheck::kNone;
}

}  // namespace

Sample sampleOfNumbers(const PoseNumbers& numbers, int sensor, std::string status, double unit_tolerance) {
  constexpr double kFarthest_m = 50.0;
  Sample sample;
  sample.sensor = sensor;
  sample.status = std::move(status);
  const auto unusable = [&sample](const char* why) {
    if (sample.status.empty()) sample.status = why;
    sample.tracker_from_sensor = Pose{};
    return sample;
  };
  const OrientationCheck check = orientationOf(numbers, unit_tolerance, sample.tracker_from_sensor.orientation);
  if (check == OrientationCheck::kMissing) return unusable(kStatusMissing);
  if (numbers.position_m) {
    if (!isReading(*numbers.position_m)) return unusable(kStatusMissing);
    if (numbers.position_m->norm() > kFarthest_m) return unusable(kStatusDamaged);
    sample.tracker_from_sensor.position_m = *numbers.position_m;
  }
  return check == OrientationCheck::kDamaged ? unusable(kStatusDamaged) : sample;
}

PoseNumbers numbersOfPose(const Pose& tracker_from_sensor) {
  PoseNumbers numbers;
  numbers.position_m = tracker_from_sensor.position_m;
  const Eigen::Quaterniond q = canonical(tracker_from_sensor.orientation);
  numbers.euler_deg = eulerFromRotation_rad(q) * kDegPerRad;
  const Eigen::Matrix3d matrix = q.toRotationMatrix();
  for (Eigen::Index row = 0; row < 3; ++row) {
    numbers.direction_cosines[static_cast<std::size_t>(row)] = matrix.row(row).transpose();
  }
  numbers.quaternion_wxyz = Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
  return numbers;
}

std::string commonStatusMeaning(const std::string& status) {
  if (status == kStatusMissing) return "the tracker sent no reading";
  if (status == kStatusDamaged) return "the record was damaged on the line";
  if (status == kStatusFlipped) return "mirrored through the transmitter: the hemisphere is set wrong";
  return status;
}

std::string manualErrorMeaning(const std::string& letter) {
  return "the tracker reports error " + letter + ", listed under error codes in its manual";
}

}  // namespace fieldtrue::acquisition
