#pragma once

#include <array>
#include <string>
#include <vector>

#include "acquisition/devices/line_device.h"
#include "acquisition/devices/tracker_probe.h"
#include "acquisition/protocols/liberty.h"
#include "calib/simulation/scene.h"

namespace fieldtrue::acquisition {

/// How a Liberty or Patriot is to be set up.
struct LibertySetup : LineSetup {
  explicit LibertySetup(const LibertyMake& which = libertyMake("liberty")) : make_row(&which) {
    id = which.id;
    make = which.make;
    name = which.name;
  }
  const LibertyMake* make_row;
  std::vector<int> stations;      ///< Empty = those plugged in.
  std::string hemisphere = "+x";  ///< "+x" ... "-z" or "tracked".
  std::string filter = "off";     ///< "off", "low", "medium", "heavy".
  bool raw_frame = true;          ///< Resets alignment and boresight.
};

/// The output list the driver asks for: time stamp, position, quaternion, tail mark.
inline constexpr std::array<int, 4> kLibertyDriverItems = {8, 2, 7, 1};

/// How a Liberty or a Patriot is found on a line.
TrackerProbe libertyProbe();
TrackerProbe patriotProbe();

/// Their streams, from the stations that are on. @error kBadInput
Result<StreamPlan> libertyStream(const StreamSettings& settings);
Result<StreamPlan> patriotStream(const StreamSettings& settings);

std::vector<Setting> libertySettings();
std::vector<Setting> patriotSettings();
/// @error kBadInput
Result<std::unique_ptr<TrackerDevice>> makeLiberty(const std::string& address, const simulation::Scene& scene);
Result<std::unique_ptr<TrackerDevice>> makePatriot(const std::string& address, const simulation::Scene& scene);

/// Brings a Liberty or Patriot from any state to binary frames in centimetres that carry its clock.
class LibertyStartup : public TrackerStartup {
  Q_OBJECT
 public:
  LibertyStartup(Transport& line, const LibertySetup& setup);
  void run() override;
  StreamPlan stream() const override;
  std::string farewell() const override;

 private:
  void whoCame(const LibertyFrame& who);
  void stationsCame(unsigned plugged);
  std::vector<std::string> commands(unsigned plugged) const;
  void verify();
  void settled();

  LibertySetup liberty_;
};

}  // namespace fieldtrue::acquisition
