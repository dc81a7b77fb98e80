#pragma once

#include <optional>
#include <string>
#include <vector>

#include "acquisition/devices/line_device.h"
#include "acquisition/devices/tracker_probe.h"
#include "acquisition/protocols/isotrak.h"
#include "calib/simulation/scene.h"

namespace fieldtrue::acquisition {

/// What an Isotrak is told to send.
struct IsotrakRecordKind {
  const char* id;
  FastrakFormat format;
  std::vector<int> items;
  double step_m;  ///< Of its positions.
};
const std::vector<IsotrakRecordKind>& isotrakRecordKinds();

/// How an Isotrak II is to be set up.
struct IsotrakSetup : LineSetup {
  IsotrakSetup() {
    id = "isotrak";
    make = "Polhemus Isotrak II";
    name = "Isotrak II";
    timings.reset_ms = 20000;
  }
  std::vector<int> stations;      ///< Empty = those switched on.
  std::string hemisphere = "+x";  ///< "+x" ... "-z" or "tracked".
  std::string filter = "off";     ///< "off", "low", "medium", "heavy".
  bool raw_frame = true;          ///< Resets alignment and boresight.
  const IsotrakRecordKind* record = &isotrakRecordKinds().front();
};

/// How an Isotrak II is found on a line.
TrackerProbe isotrakProbe();
std::vector<Setting> isotrakSettings();
/// Its stream, from the stations that are on and the kind of record. @error kBadInput
Result<StreamPlan> isotrakStream(const StreamSettings& settings);
/// @error kBadInput
Result<std::unique_ptr<TrackerDevice>> makeIsotrak(const std::string& address, const simulation::Scene& scene);

/// Brings an Isotrak II from any state to records of the kind asked for, from the stations asked for.
class IsotrakStartup : public TrackerStartup {
  Q_OBJECT
 public:
  IsotrakStartup(Transport& line, const IsotrakSetup& setup);
  void run() override;
  StreamPlan stream() const override;
  std::string farewell() const override;

 private:
  void answered(const std::string& heard);
  void stationsKnown();
  std::vector<FastrakCommand> commands() const;
  LineStep step(const FastrakCommand& command);
  LineStep askStations();
  LineStep readBack(char letter, const char* fact);
  void verify();
  void settled();

  IsotrakSetup isotrak_;
  IsotrakStatus status_;
  std::optional<unsigned> switched_on_;  ///< Bits of the stations, where it told.
};

}  // namespace fieldtrue::acquisition
