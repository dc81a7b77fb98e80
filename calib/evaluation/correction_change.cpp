#include "calib/evaluation/correction_change.h"

#include <algorithm>
#include <cmath>

#include "calib/core/statistics.h"
#include "calib/core/units.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::evaluation {

namespace {

using calibration::Corrector;

/// Between two corrected positions, rigid motion included.
double wholeChange_mm(const Eigen::Vector3d& first_m, const Eigen::Vector3d& second_m) {
  return kMmPerM * (second_m - first_m).norm();
}

double size_mm(const ChangeAt& change) { return kMmPerM * change.change_m.norm(); }

/// The change at a reading once the rigid motion is taken out of it.
ChangeAt changeAt(const Reading& reading, const Eigen::Vector3d& first_m, const Eigen::Vector3d& second_m,
                  const Pose& second_from_first) {
  return {first_m, second_from_first.orientation.conjugate() * (second_m - second_from_first * first_m), reading.held};
}

/// RMS of what both state of their uncertainty together; none where one states none.
std::optional<double> expectedChange_mm(const Corrector& first, const Corrector& second,
                                        const std::vector<Reading>& readings) {
  double sum_m2 = 0.0;
  for (const Reading& reading : readings) {
    const auto first_m = uncertainty_m(first, reading), second_m = uncertainty_m(second, reading);
    if (!first_m || !second_m) return std::nullopt;
    sum_m2 += *first_m * *first_m + *second_m * *second_m;
  }
  return kMmPerM * std::sqrt(sum_m2 / static_cast<double>(readings.size()));
}

/// What takes one set of orientations to another: the rig's turn before them, the mounting's behind.
struct SharedTurn {
  Eigen::Quaterniond of_rig = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond of_mounting = Eigen::Quaterniond::Identity();

  Eigen::Quaterniond operator()(const Eigen::Quaterniond& q) const { return of_rig * q * of_mounting; }
};

/// By turns: each the mean of what the other leaves. A sensor that is held in one way tells only both together.
SharedTurn fitSharedTurn(const std::vector<Eigen::Quaterniond>& from, const std::vector<Eigen::Quaterniond>& to,
                         bool is_held_in_several) {
  // Each step leaves a third or so of what the one before left, once the sensor is held in a handful of ways.
  constexpr int kSteps = 20;
  SharedTurn shared;
  std::vector<Eigen::Quaterniond> turns(from.size());
  for (int step = 0; step < (is_held_in_several ? kSteps : 1); ++step) {
    for (std::size_t i = 0; i < from.size(); ++i) turns[i] = to[i] * (from[i] * shared.of_mounting).conjugate();
    shared.of_rig = meanRotation(turns);
    if (!is_held_in_several) break;
    for (std::size_t i = 0; i < from.size(); ++i) turns[i] = (shared.of_rig * from[i]).conjugate() * to[i];
    shared.of_mounting = meanRotation(turns);
  }
  return shared;
}

}  // namespace

void measureField(const Corrector& first, const Corrector& second, const CommonReadings& common,
                  CalibrationDifference& to) {
  const std::vector<Reading> readings = common.all();
  std::vector<Eigen::Vector3d> by_first_m, by_second_m;
  std::vector<double> whole_mm;
  for (const Reading& reading : readings) {
    by_first_m.push_back(correctedBy(first, reading).position_m);
    by_second_m.push_back(correctedBy(second, reading).position_m);
    whole_mm.push_back(wholeChange_mm(by_first_m.back(), by_second_m.back()));
  }
  to.n_points = common.points_m.size();
  to.n_orientations = common.held.size();
  to.is_held_seen_by_both = common.is_held_seen_by_both;
  to.whole_rms_mm = rootMeanSquare(whole_mm);
  const auto whole_at = [&](const Reading& reading) {
    return wholeChange_mm(correctedBy(first, reading).position_m, correctedBy(second, reading).position_m);
  };
  to.whole_max_mm = whole_at(worstReading(first, second, common, whole_mm, whole_at));
  // Fewer points, or points on a line, tell no rotation: then nothing is taken out.
  const Pose second_from_first = fitRigid(by_first_m, by_second_m).value_or(Pose{});
  const Eigen::Vector3d middle_m = pointSpread(by_first_m).center_m;
  to.moved_mm = kMmPerM * (second_from_first * middle_m - middle_m).norm();
  to.turned_deg = kDegPerRad * angleBetween_rad(second_from_first.orientation, Eigen::Quaterniond::Identity());
  std::vector<double> change_mm;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const ChangeAt change = changeAt(readings[i], by_first_m[i], by_second_m[i], second_from_first);
    change_mm.push_back(size_mm(change));
    if (i % common.readingsAPlace() == 0)
      to.points.push_back(change);
    else if (change_mm.back() > size_mm(to.points.back()))
      to.points.back() = change;
  }
  const auto change_at = [&](const Reading& reading) {
    return changeAt(reading, correctedBy(first, reading).position_m, correctedBy(second, reading).position_m,
                    second_from_first);
  };
  to.points.push_back(change_at(worstReading(first, second, common, change_mm,
                                             [&](const Reading& reading) { return size_mm(change_at(reading)); })));
  to.worst = to.points.size() - 1;
  to.max_mm = size_mm(to.points.back());
  to.rms_mm = rootMeanSquare(change_mm);
  to.p95_mm = quantile(change_mm, 0.95);
  to.expected_mm = expectedChange_mm(first, second, readings);
}

void measureOrientation(const Corrector& first, const Corrector& second, const CommonReadings& common,
                        CalibrationDifference& to) {
  if (first.choice().orientation_id == "none" && second.choice().orientation_id == "none") return;
  std::vector<Eigen::Quaterniond> by_first, by_second;
  for (const Reading& reading : common.all()) {
    by_first.push_back(correctedBy(first, reading).orientation);
    by_second.push_back(correctedBy(second, reading).orientation);
  }
  const SharedTurn shared = fitSharedTurn(by_first, by_second, common.held.size() > 1);
  std::vector<double> angles_deg, shared_deg;
  for (std::size_t i = 0; i < by_first.size(); ++i) {
    angles_deg.push_back(kDegPerRad * angleBetween_rad(by_second[i], shared(by_first[i])));
    shared_deg.push_back(kDegPerRad * angleBetween_rad(by_first[i], shared(by_first[i])));
  }
  to.angle_rms_deg = rootMeanSquare(angles_deg);
  const auto angle_at_deg = [&](const Reading& reading) {
    return kDegPerRad *
           angleBetween_rad(correctedBy(second, reading).orientation, shared(correctedBy(first, reading).orientation));
  };
  to.angle_max_deg = angle_at_deg(worstReading(first, second, common, angles_deg, angle_at_deg));
  to.angle_shared_deg = rootMeanSquare(shared_deg);
}

}  // namespace fieldtrue::evaluation
