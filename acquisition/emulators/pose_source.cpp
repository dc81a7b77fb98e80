#include "acquisition/emulators/pose_source.h"

#include <algorithm>

#include "calib/core/error.h"

namespace fieldtrue::acquisition {

StandingSource::StandingSource(std::vector<Pose> tracker_from_sensor, double rate_hz)
    : poses_(std::move(tracker_from_sensor)), rate_hz_(rate_hz) {
  FT_CHECK(!poses_.empty() && poses_.size() <= kMostSensors);
}

unsigned StandingSource::sensors() const { return static_cast<unsigned>((std::uint64_t{1} << poses_.size()) - 1u); }

std::optional<double> StandingSource::due_s(std::uint64_t cycle, int active) const {
  return static_cast<double>(cycle) * active / rate_hz_;
}

std::vector<Sample> StandingSource::read(std::uint64_t, std::span<const int> sensors, double time_s) {
  return readNow(sensors, time_s);
}

std::vector<Sample> StandingSource::readNow(std::span<const int> sensors, double time_s) {
  std::vector<Sample> samples;
  for (const int sensor : sensors) {
    const auto index = static_cast<std::size_t>(sensor);
    if (index < poses_.size()) samples.push_back({time_s, sensor, poses_[index], {}});
  }
  return samples;
}

ReplaySource::ReplaySource(const SampleTable& table) {
  FT_CHECK(!table.rows.empty());
  for (const auto& row : table.rows) {
    rows_.push_back(row.sample);
    // That a take was given up is no word of the tracker's.
    if (row.node < 0 && row.sample.status.starts_with("cancelled:")) rows_.back().status.clear();
  }
  // Readings between the places stand after those at the places, and a place taken again among its neighbours.
  std::stable_sort(rows_.begin(), rows_.end(), [](const Sample& a, const Sample& b) { return a.time_s < b.time_s; });
  for (const Sample& row : rows_) due_s_.push_back(row.time_s - rows_.front().time_s);
}

unsigned ReplaySource::sensors() const {
  unsigned map = 0;
  for (const auto& row : rows_) {
    if (row.sensor >= 0 && row.sensor < static_cast<int>(kMostSensors)) map |= 1u << row.sensor;
  }
  return map;
}

std::optional<double> ReplaySource::due_s(std::uint64_t cycle, int) const {
  return cycle < due_s_.size() ? std::optional(due_s_[cycle]) : std::nullopt;
}

std::vector<Sample> ReplaySource::read(std::uint64_t cycle, std::span<const int> sensors, double) {
  const Sample& row = rows_.at(cycle);
  if (std::find(sensors.begin(), sensors.end(), row.sensor) == sensors.end()) return {};
  return {row};
}

std::vector<Sample> ReplaySource::readNow(std::span<const int> sensors, double) {
  std::vector<Sample> samples;
  for (const int sensor : sensors) {
    const auto row = std::find_if(rows_.begin(), rows_.end(), [sensor](const auto& r) { return r.sensor == sensor; });
    if (row != rows_.end()) samples.push_back(*row);
  }
  return samples;
}

double ReplaySource::rate_hz() const {
  return due_s_.back() > 0.0 ? static_cast<double>(rows_.size() - 1) / due_s_.back() : 0.0;
}

}  // namespace fieldtrue::acquisition
