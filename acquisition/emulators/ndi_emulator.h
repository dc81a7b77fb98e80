#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "acquisition/emulators/emulated_unit.h"
#include "acquisition/protocols/ndi.h"

namespace fieldtrue::acquisition {

struct NdiEmulatorOptions : EmulatedUnitOptions {
  double rate_hz = kNdiAuroraRate_hz;  ///< Of its frame counter.
  bool knows_bx = true;                ///< Else BX is refused, as by old firmware.
  int wireless = 0;  ///< So many of the last sensors are tools without a cable: they need a handle and a definition.

  NdiEmulatorOptions() {
    version = "007.000.012";
    identity = "Aurora";
  }
};

/// A measuring system of NDI without its line: port handles, tracking mode and frame counter. Wired tools stand in
/// their ports from the start; a wireless one belongs to the first handle that was asked for and given a definition.
/// Line settings are accepted and act on nothing.
class NdiEmulatorCore : public EmulatedUnit {
 public:
  NdiEmulatorCore(std::unique_ptr<PoseSource> source, const NdiEmulatorOptions& options = {});

  bool streaming() const override { return false; }

  bool tracking() const { return tracking_; }
  int baud() const { return baud_; }
  /// What was written into a handle. @param handle one that there is
  const std::string& definition(int handle) const { return ports_.at(handle).rom; }

 private:
  struct Port {
    int sensor = -1;  ///< -1 = nothing is seen of it.
    bool wired = false, initialised = false, enabled = false;
    std::string rom;
    Sample latest;
    std::uint32_t frame = 0;
    bool was_seen = false;
  };
  enum class Mode { kAny, kSetup, kTracking };
  struct Command {
    const char* name;
    Mode mode;
    std::string (NdiEmulatorCore::*obey)(const std::string& arguments);
  };
  static std::span<const Command> commands();

  void hear(std::string_view bytes, Out& out) override;
  std::vector<int> activeSensors() const override;
  void send(const std::vector<Sample>&, bool, Out&) override {}

  void obey(const std::string& line, Out& out);
  void reply(const std::string& text, Out& out);
  void restart();

  std::string initialise(const std::string&);
  std::string version(const std::string&);
  std::string revision(const std::string&);
  std::string feature(const std::string& name);
  std::string lineSettings(const std::string& settings);
  std::string accept(const std::string&);
  std::string startTracking(const std::string& option);
  std::string stopTracking(const std::string&);
  std::string listHandles(const std::string& option);
  std::string requestHandle(const std::string&);
  std::string freeHandle(const std::string& handle);
  std::string writeDefinition(const std::string& arguments);
  std::string initialiseHandle(const std::string& handle);
  std::string enableHandle(const std::string& arguments);
  std::string disableHandle(const std::string& handle);
  std::string tellHandle(const std::string& arguments);
  std::string sendText(const std::string&);
  std::string sendBinary(const std::string&);

  Port* portOf(const std::string& arguments);
  unsigned statusOf(const Port& port) const;
  bool unplugged(const Port& port) const;
  void measure();
  void keep(const std::vector<Sample>& samples, std::uint32_t frame);
  NdiFrame frame();
  NdiTool toolOf(int handle, Port& port);

  NdiEmulatorOptions ndi_;
  std::string line_;
  std::map<int, Port> ports_;
  bool initialised_ = false;
  bool tracking_ = false;
  double tracking_since_s_ = 0.0;
  std::uint32_t first_frame_ = 0;
  std::uint64_t next_cycle_ = 0;
  int baud_ = kNdiPowerUpBaud;
  std::uint64_t replies_ = 0;
  bool binary_reply_ = false;
};

/// An emulated Aurora on a pty or a TCP port, not yet started.
/// @error kBadInput when neither or both lines are named, or the recording is empty or holds other sensors than 0 to 7;
///        the scene's errors
Result<std::unique_ptr<EmulatorRunner>> makeNdiEmulator(const Emulation& emulation);

}  // namespace fieldtrue::acquisition
