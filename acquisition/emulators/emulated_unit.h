#pragma once

#include <memory>
#include <random>
#include <string>
#include <vector>

#include "acquisition/emulators/emulated_tracker.h"
#include "acquisition/emulators/emulation.h"
#include "acquisition/emulators/emulator_runner.h"
#include "acquisition/emulators/pose_source.h"

namespace fieldtrue::acquisition {

/// What an emulated tracker is, whatever its make.
struct EmulatedUnitOptions {
  double reset_silence_s = 10.0;  ///< After a restart.
  std::string version;
  std::string identity;
  EmulatorFaults faults;
  std::uint64_t seed = 1;
};

/// What emulated trackers have in common: a source of readings, the stream's own time, silence after a restart, and
/// the faults that are in the readings. What is left to a tracker is to read its commands and to write its records.
class EmulatedUnit : public EmulatedTracker {
 public:
  EmulatedUnit(std::unique_ptr<PoseSource> source, EmulatedUnitOptions options);

  void receive(std::string_view bytes, double time_s, std::vector<EmulatedOutput>& out) final;
  bool tick(double time_s, std::vector<EmulatedOutput>& out, int most_cycles = 256) final;

  PoseSource& source() { return *source_; }
  /// Data records sent so far.
  std::uint64_t records() const { return records_; }

 protected:
  using Out = std::vector<EmulatedOutput>;

  /// Takes what the host sent, cut anywhere; returns early where silent() becomes true.
  virtual void hear(std::string_view bytes, Out& out) = 0;
  /// Sensors that are switched on, counted from 0, ascending.
  virtual std::vector<int> activeSensors() const = 0;
  /// The records of one cycle. @param every false: only what the tracker would send by itself
  virtual void send(const std::vector<Sample>& samples, bool every, Out& out) = 0;
  /// Active sensors that share the tracker's rate; 1 where each has all of it.
  virtual int sharing(std::size_t active) const { return static_cast<int>(active); }

  /// The next cycle is the first of a stream.
  void beginStream();
  /// Hears and says nothing for as long as a restart takes.
  void beginSilence();
  bool silent() const { return now_s_ < silent_until_s_; }
  void answer(std::string bytes, Out& out) const { out.push_back({std::move(bytes), false}); }
  void record(std::string bytes, Out& out);

  /// Numbered from 0, for those plugged in.
  bool plugged(int sensor) const { return (source_->sensors() >> sensor & 1u) != 0; }
  /// The reading with the faults of readings in it; its pose is what the tracker would find without a hemisphere.
  Sample misread(Sample sample);
  /// The last fault of a pose, after the tracker's own settings acted on it.
  Pose flipped(Pose pose) const;

  std::unique_ptr<PoseSource> source_;
  EmulatedUnitOptions options_;
  double now_s_ = 0.0;
  double reading_s_ = 0.0;  ///< When the readings that are being sent were made, by the tracker's clock.
  bool paused_ = false;

 private:
  std::mt19937_64 random_;
  double stream_start_s_ = 0.0;
  double silent_until_s_ = 0.0;
  std::uint64_t cycle_ = 0;
  std::uint64_t records_ = 0;
};

/// When faults that come and go are there: one second of every four, never in the first three of a stream.
bool faultySecond(double streaming_s);

/// A dipole's field is the same at p and -p: the tracker picks the side it was told.
/// @param towards zero = it follows the sensor
Pose inHemisphere(Pose tracker_from_sensor, const Eigen::Vector3d& towards);

/// What an emulator of a make is over.
struct EmulatedMake {
  std::string name;      ///< "Fastrak", for messages.
  int most_sensors = 1;  ///< It can have.
  double rate_hz = 0.0;  ///< Its own; 0 = the scene's.
};

/// Where the readings come from: the recording, or the scene's tracker in the hands of somebody who walks about.
/// @error kBadInput when the recording is empty or holds sensors the make has not; the scene's errors
Result<std::unique_ptr<PoseSource>> makeSource(const Emulation& emulation, const EmulatedMake& make);
/// The pty or the TCP port. @error kBadInput when neither or both are named
Result<std::unique_ptr<EmulatorEndpoint>> makeEndpoint(const Emulation& emulation);

/// An emulated tracker on a pty or a TCP port, not yet started. `endpoint().address()` is what a host opens once it is.
/// @param options the make's own, to which the emulation's faults and seed are added
/// @error of makeSource and makeEndpoint
template <class Unit, class Options>
Result<std::unique_ptr<EmulatorRunner>> makeEmulator(const Emulation& emulation, const EmulatedMake& make,
                                                     Options options) {
  FT_TRY(auto endpoint, makeEndpoint(emulation));
  FT_TRY(auto source, makeSource(emulation, make));
  options.faults = emulation.faults;
  options.seed = emulation.seed;
  return std::make_unique<EmulatorRunner>(std::make_unique<Unit>(std::move(source), options), std::move(endpoint),
                                          emulation.faults, emulation.speed);
}

/// An emulated tracker at one end of a line inside this process.
template <class Unit, class Options>
std::unique_ptr<EmulatorRunner> emulatorOnLine(std::unique_ptr<PoseSource> source,
                                               std::unique_ptr<LoopbackTransport> device_end, const Options& options,
                                               TrackerClock clock = {}) {
  return std::make_unique<EmulatorRunner>(std::make_unique<Unit>(std::move(source), options),
                                          std::make_unique<LoopbackEndpoint>(std::move(device_end)), options.faults,
                                          std::move(clock));
}

}  // namespace fieldtrue::acquisition
