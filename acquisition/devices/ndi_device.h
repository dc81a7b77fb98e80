#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "acquisition/devices/line_device.h"
#include "acquisition/devices/tracker_probe.h"
#include "acquisition/protocols/ndi.h"
#include "calib/simulation/scene.h"

namespace fieldtrue::acquisition {

/// The kinds of NDI systems that differ in what they are.
struct NdiSystem {
  const char* id = "";    ///< Of the setting `system`.
  const char* word = "";  ///< In what the system says of itself; empty = any.
  double frame_hz = kNdiPolarisRate_hz;
  const char* transmitter_model = "optical";
  const char* excitation = "";
};
/// By the setting, or by what the system says of itself where that is `auto`.
const NdiSystem& ndiSystem(const std::string& setting, const std::string& told);

/// How an NDI system is to be set up. `baud` is the speed it is brought to.
struct NdiSetup : LineSetup {
  NdiSetup() {
    id = "ndi";
    make = "NDI";
    name = "NDI tracker";
    excitation = "";
    transmitter_model = "unknown";
  }
  std::vector<int> stations;  ///< Tools in the order of their handles; empty = all.
  std::string system = "auto";
  std::string reply = "auto";  ///< "auto", "bx", "tx".
  double frame_hz = 0.0;       ///< Of the frame counter; 0 = the system's.
  NdiGate gate{2.0, true};
  struct Rom {
    std::string path;
    std::string content;
  };
  std::vector<Rom> roms;  ///< Definitions of tools without a cable.
  int break_ms = 300;
  int after_break_ms = 3000;  ///< Longest wait for what a break is answered with.
  int speed_ms = 100;         ///< After the speed was changed.
};

/// How an NDI system is found on a line.
TrackerProbe ndiProbe();

/// Its stream, from its tools and how they are asked for. @error kBadInput
Result<StreamPlan> ndiStream(const StreamSettings& settings);

/// The settings of an NDI system as data, for registry, forms and command line.
std::vector<Setting> ndiSettings();
/// An NDI system at an address. @error kBadInput, kIo for a definition file
Result<std::unique_ptr<TrackerDevice>> makeNdi(const std::string& address, const simulation::Scene& scene);

/// Brings an NDI system from any state to tracking: break or reset, speed, tool definitions, handles initialised and
/// enabled, BX or TX.
class NdiStartup : public TrackerStartup {
  Q_OBJECT
 public:
  NdiStartup(Transport& line, const NdiSetup& setup);
  void run() override;
  StreamPlan stream() const override;
  std::string farewell() const override;

 private:
  using Then = std::function<void()>;
  using Replied = std::function<void(const NdiReply&)>;
  void sendBreak(Then then);
  void callOut();
  void chooseSpeed();
  void checkSpeed();
  void say(std::string_view command, const std::string& arguments, Replied then);
  void identify();
  void systemKnown();
  void freeHandles();
  void freeNext(std::vector<NdiHandle> handles);
  void writeDefinition(std::size_t which);
  void writeChunk(std::size_t which, const std::vector<std::string>& commands, std::size_t next);
  void initialiseHandles();
  void initialiseNext(std::vector<NdiHandle> handles);
  void enableHandles();
  void enableNext(std::vector<NdiHandle> handles);
  void enabledHandles();
  void startTracking();
  void tryBinary();
  void settled();
  std::string hex(int handle) const { return ndiHex(static_cast<unsigned>(handle), 2); }
  void failWithReply(const QString& what, const NdiReply& reply);
  std::map<int, int> sensors() const;

  NdiSetup ndi_;
  bool has_rate_ = false;
  bool binary_ = true;
  std::string told_;  ///< What the system says of itself.
  std::string firmware_;
  std::vector<int> handles_;  ///< Enabled, ascending.
  std::set<int> tried_;       ///< Handles that were initialised, or could not be.
};

}  // namespace fieldtrue::acquisition
