#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "calib/core/calibration_table.h"

namespace fieldtrue::acquisition {

inline constexpr std::size_t kMostSensors = 32;  ///< Of one source.

/// Where an emulated tracker's readings come from.
class PoseSource {
 public:
  virtual ~PoseSource() = default;
  /// Bit 0 = a receiver is plugged into station 1, and so on.
  virtual unsigned sensors() const = 0;
  /// True when the readings are a recording: they are sent as they are, whatever hemisphere or alignment is set.
  virtual bool recorded() const { return false; }
  /// When a cycle of continuous output is due [s after its start]; none when the source has ended.
  /// @param active stations switched on; they share the tracker's rate
  virtual std::optional<double> due_s(std::uint64_t cycle, int active) const = 0;
  /// The readings of a cycle, in ascending order of the sensors, of the sensors asked for.
  /// @param time_s the tracker's clock
  virtual std::vector<Sample> read(std::uint64_t cycle, std::span<const int> sensors, double time_s) = 0;
  /// Readings outside continuous output.
  virtual std::vector<Sample> readNow(std::span<const int> sensors, double time_s) = 0;
};

/// Sensors that stand where they are put.
class StandingSource : public PoseSource {
 public:
  /// @param tracker_from_sensor one for each sensor, at most kMostSensors
  explicit StandingSource(std::vector<Pose> tracker_from_sensor, double rate_hz = 120.0);
  void put(std::size_t sensor, const Pose& tracker_from_sensor) { poses_.at(sensor) = tracker_from_sensor; }
  unsigned sensors() const override;
  std::optional<double> due_s(std::uint64_t cycle, int active) const override;
  std::vector<Sample> read(std::uint64_t cycle, std::span<const int> sensors, double time_s) override;
  std::vector<Sample> readNow(std::span<const int> sensors, double time_s) override;

 private:
  std::vector<Pose> poses_;
  double rate_hz_;
};

/// Plays a recording at the times it was recorded, each row once and in order, from its start whenever continuous
/// output is switched on.
class ReplaySource : public PoseSource {
 public:
  /// @param table at least one row; rows whose time steps back follow the row before them at once
  explicit ReplaySource(const SampleTable& table);
  unsigned sensors() const override;
  bool recorded() const override { return true; }
  std::optional<double> due_s(std::uint64_t cycle, int active) const override;
  std::vector<Sample> read(std::uint64_t cycle, std::span<const int> sensors, double time_s) override;
  std::vector<Sample> readNow(std::span<const int> sensors, double time_s) override;
  /// Mean rate of the recording [Hz]; 0 for a single row.
  double rate_hz() const;

 private:
  std::vector<Sample> rows_;
  std::vector<double> due_s_;
};

}  // namespace fieldtrue::acquisition
