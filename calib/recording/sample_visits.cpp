#include "calib/recording/sample_visits.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "calib/core/statistics.h"
#include "calib/core/units.h"

namespace fieldtrue::recording {

namespace {

constexpr double kOutlierSds = 8.0;
constexpr double kFinest_m = 1e-6;

using StopKey = std::tuple<int, int, int>;

bool isGood(const SampleRow& row) {
  const Pose& pose = row.sample.tracker_from_sensor;
  return row.node >= 0 && row.sample.status.empty() && std::isfinite(row.sample.time_s) &&
         pose.position_m.allFinite() && pose.orientation.coeffs().allFinite() && pose.orientation.norm() > 1e-6 &&
         !isMissingMark(pose.position_m.cwiseAbs().maxCoeff());
}

std::vector<const Sample*> withoutOutliers(const std::vector<const Sample*>& samples) {
  Eigen::Vector3d middle_m;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Sample* sample : samples) values.push_back(sample->tracker_from_sensor.position_m[axis]);
    middle_m[axis] = median(std::move(values));
  }
  std::vector<double> distances_m;
  for (const Sample* sample : samples) {
    distances_m.push_back((sample->tracker_from_sensor.position_m - middle_m).norm());
  }
  const double limit_m = kOutlierSds * std::max(kSdPerMad * median(distances_m), kFinest_m);
  std::vector<const Sample*> left;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (distances_m[i] <= limit_m) left.push_back(samples[i]);
  }
  return left;
}

SampleVisit visitOf(const StopKey& key, const std::vector<const Sample*>& samples) {
  SampleVisit visit;
  std::tie(visit.node, visit.sensor, visit.visit) = key;
  std::vector<Eigen::Quaterniond> rotations;
  for (const Sample* sample : samples) {
    visit.times_s.push_back(sample->time_s);
    visit.mean_m += sample->tracker_from_sensor.position_m / static_cast<double>(samples.size());
    rotations.push_back(sample->tracker_from_sensor.orientation.normalized());
  }
  const Eigen::Quaterniond mean = meanRotation(rotations);
  visit.deviations.resize(static_cast<Eigen::Index>(samples.size()), 6);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    visit.deviations.block<1, 3>(row, 0) = (samples[i]->tracker_from_sensor.position_m - visit.mean_m).transpose();
    visit.deviations.block<1, 3>(row, 3) = rotationVector_rad(rotations[i] * mean.conjugate()).transpose();
  }
  return visit;
}

}  // namespace

std::vector<SampleVisit> sampleVisits(const SampleTable& samples, std::size_t fewest) {
  std::map<StopKey, std::vector<const Sample*>> stops;
  for (const SampleRow& row : samples.rows) {
    if (isGood(row)) stops[{row.node, row.sample.sensor, row.visit}].push_back(&row.sample);
  }
  std::vector<SampleVisit> visits;
  for (auto& [key, readings] : stops) {
    if (readings.size() < fewest) continue;
    std::stable_sort(readings.begin(), readings.end(),
                     [](const Sample* a, const Sample* b) { return a->time_s < b->time_s; });
    const std::vector<const Sample*> good = withoutOutliers(readings);
    if (good.size() >= fewest) visits.push_back(visitOf(key, good));
  }
  return visits;
}

std::optional<double> sampleRate_hz(const std::vector<SampleVisit>& visits, const TableMetadata& metadata) {
  std::vector<double> steps_s;
  for (const SampleVisit& visit : visits) {
    for (std::size_t i = 1; i < visit.times_s.size(); ++i) steps_s.push_back(visit.times_s[i] - visit.times_s[i - 1]);
  }
  const double step_s = steps_s.empty() ? 0.0 : median(std::move(steps_s));
  if (step_s <= 0.0) return metadata.rate_hz;
  // Times printed to the millisecond know the rate less well than the file's own statement of it.
  const double measured_hz = 1.0 / step_s;
  const bool agrees = metadata.rate_hz && std::abs(*metadata.rate_hz - measured_hz) < 0.1 * measured_hz;
  return agrees ? metadata.rate_hz : std::optional(measured_hz);
}

}  // namespace fieldtrue::recording
