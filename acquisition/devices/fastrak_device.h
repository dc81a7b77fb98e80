#pragma once

#include <array>
#include <string>
#include <vector>

#include "acquisition/devices/line_device.h"
#include "acquisition/devices/tracker_probe.h"
#include "acquisition/protocols/fastrak.h"
#include "calib/simulation/scene.h"

namespace fieldtrue::acquisition {

/// How a Fastrak is to be set up.
struct FastrakSetup : LineSetup {
  FastrakSetup() {
    id = "fastrak";
    make = "Polhemus Fastrak";
    name = "Fastrak";
  }
  bool tells_version = true;         ///< Whether its version belongs to its name.
  double rate_hz = kFastrakRate_hz;  ///< Shared by the stations; other than 120 only for an emulated tracker.
  std::vector<int> stations;         ///< Empty = those plugged in.
  std::string hemisphere = "+x";     ///< "+x" ... "-z" or "tracked".
  std::string filter = "off";        ///< "off", "low", "medium", "heavy".
  bool raw_frame = true;             ///< Resets alignment and boresight.
};

/// The output list the driver asks for: position, quaternion, stylus, tail mark.
inline constexpr std::array<int, 4> kFastrakDriverItems = {2, 11, 16, 1};

/// The settings of a Fastrak as data, for registry, forms and command line.
std::vector<Setting> fastrakSettings();
/// How a Fastrak is found on a line.
TrackerProbe fastrakProbe();
/// Its stream, from the stations that are on. @error kBadInput
Result<StreamPlan> fastrakStream(const StreamSettings& settings);
/// A Fastrak at an address. @error kBadInput
Result<std::unique_ptr<TrackerDevice>> makeFastrak(const std::string& address, const simulation::Scene& scene);

/// Brings a Fastrak from any state to binary records in centimetres with filters and compensation as asked. Works on
/// units that stream already, and looks for another rate where the line has one.
class FastrakStartup : public TrackerStartup {
  Q_OBJECT
 public:
  FastrakStartup(Transport& line, const FastrakSetup& setup);
  void run() override;
  StreamPlan stream() const override;
  std::string farewell() const override;

 private:
  void statusCame(const FastrakStatus& status);
  std::vector<FastrakCommand> commands() const;
  std::vector<FastrakCommand> filterCommands() const;
  LineStep readBack(char letter, const char* name);
  bool noteRefusal(const std::string& heard);
  void verify();
  void settled(const FastrakStatus& status);

  FastrakSetup fastrak_;
};

}  // namespace fieldtrue::acquisition
