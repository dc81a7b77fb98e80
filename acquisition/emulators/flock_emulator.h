#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "acquisition/emulators/emulated_unit.h"
#include "acquisition/protocols/flock_commands.h"

namespace fieldtrue::acquisition {

struct FlockEmulatorOptions : EmulatedUnitOptions {
  bool extended_range = false;    ///< Address 1 is a controller with the 144 in transmitter, birds follow it.
  bool standalone = false;        ///< One bird with address 0: no prefix, no flock.
  double rate_hz = 103.3;         ///< As delivered.
  double configure_time_s = 0.5;  ///< Silence after auto-configure.
  FlockAddressing addressing = FlockAddressing::kNormal;
  FlockConventions conventions;  ///< How this firmware writes a pose.

  FlockEmulatorOptions() {
    version = {3, 67};
    identity = "6DFOB     ";
  }
};

/// A Flock of Birds without its line: the master and the birds behind it. Hemisphere, angle align, reference frame,
/// scale, record mode, report rate, group mode and sleep act on what is sent; other parameters are kept and read back.
/// Between two measurements a bird that is asked says what it said. One that cannot be measured says what it said too,
/// and notes the error.
class FlockEmulatorCore : public EmulatedUnit {
 public:
  FlockEmulatorCore(std::unique_ptr<PoseSource> source, const FlockEmulatorOptions& options = {});

  bool streaming() const override { return streaming_ || data_ready_; }

  bool group() const { return group_; }
  bool configured() const { return configured_; }
  bool asleep() const { return asleep_; }
  int lastError() const { return error_; }
  /// A parameter of a bird as last set. @param address 1 and up
  const std::string& parameter(int number, int address) const { return birds_.at(address).parameters.at(number); }
  const FlockMode& mode(int address) const { return *birds_.at(address).mode; }

 private:
  struct Bird {
    int sensor = -1;  ///< Of the pose source; -1 = the extended range controller.
    const FlockMode* mode = nullptr;
    std::map<int, std::string> parameters;
    std::string last_record;
  };

  void hear(std::string_view bytes, Out& out) override;
  std::vector<int> activeSensors() const override;
  void send(const std::vector<Sample>& samples, bool every, Out& out) override;
  int sharing(std::size_t) const override { return 1; }

  void obey(const FlockCommand& command, Out& out);
  void setUp(Bird& bird, const FlockCommand& command);
  void examine(const Bird& bird, int address, int number, Out& out);
  std::string valueOf(const Bird& bird, int address, int number);
  std::string statusOf(const Bird& bird, int address) const;
  std::string flockStatus() const;
  void change(Bird& bird, const FlockCommand& command);
  void configure(int units);
  void note(int error, int where = 0);
  void startStream();
  void sendPoint(int address, Out& out);
  void measure();
  void sendRecord(int address, const Sample& read, Out& out);
  Pose reported(const Bird& bird, const Pose& tracker_from_sensor) const;
  FlockLayout layout(const Bird& bird) const;
  std::vector<int> reportingAddresses() const;
  Bird& birdAt(int address);

  FlockEmulatorOptions flock_;
  FlockCommandReader reader_;
  std::map<int, Bird> birds_;
  std::vector<Sample> measured_;  ///< Of the cycle that polled records say.
  std::int64_t measured_cycle_ = -1;
  bool group_ = false;
  bool configured_ = false;
  bool streaming_ = false;
  bool data_ready_ = false;
  bool asleep_ = false;
  int report_every_ = 1;
  int reports_held_ = 0;  ///< Cycles until the next report.
  int error_ = 0;
  int error_where_ = 0;
  double stream_began_s_ = 0.0;
  double configured_from_s_ = 0.0;
};

/// An emulated Flock on a pty or a TCP port, not yet started.
/// @error kBadInput when neither or both lines are named, or the recording is empty or holds other sensors than 0 to
/// 12;
///        the scene's errors
Result<std::unique_ptr<EmulatorRunner>> makeFlockEmulator(const Emulation& emulation);

}  // namespace fieldtrue::acquisition
