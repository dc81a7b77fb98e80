#pragma once

#include <memory>
#include <string>
#include <vector>

#include "acquisition/devices/line_device.h"
#include "acquisition/devices/openigtlink_survey.h"
#include "acquisition/devices/tracker_probe.h"
#include "calib/core/settings.h"
#include "calib/simulation/scene.h"

namespace fieldtrue::acquisition {

/// How the poses of an OpenIGTLink server are to be read.
struct IgtlSetup : LineSetup {
  IgtlSetup();
  std::vector<std::string> devices;  ///< Names in the order of the sensors; empty = all that send poses, by name.
  bool asks = true;                  ///< Asks for tracking data where nothing comes by itself.
  int listen_ms = 1000;              ///< For a first pose, before it asks and after.
  int survey_ms = 1000;              ///< From the first pose on, to learn who sends what.
  /// Sensors so far; shared by the startups of one device, so that numbers stay when it is started again.
  std::shared_ptr<std::vector<IgtlSource>> sources = std::make_shared<std::vector<IgtlSource>>();
};

std::vector<Setting> openigtlinkSettings();
/// How a server is found: by what it sends, or by its answer to a question for its state.
TrackerProbe openigtlinkProbe();
/// Its stream, from the sensors and how they are sent. @error kBadInput
Result<StreamPlan> openigtlinkStream(const StreamSettings& settings);
/// @param address HOST, HOST:PORT or tcp:HOST:PORT, then settings; the port is 18944 where none is given. @error
/// kBadInput
Result<std::unique_ptr<TrackerDevice>> makeOpenigtlink(const std::string& address, const simulation::Scene& scene);

/// Listens to what a server sends, asks for tracking data where it sends no poses by itself, and chooses the sensors.
class IgtlStartup : public TrackerStartup {
  Q_OBJECT
 public:
  IgtlStartup(Transport& line, const IgtlSetup& setup);
  void run() override;
  StreamPlan stream() const override;
  std::string farewell() const override;

 private:
  void listen(const std::string& ask, std::function<void()> when_silent);
  void survey();
  void choose();
  void failSilent();

  IgtlSetup igtl_;
  IgtlSurvey survey_;
  QElapsedTimer clock_;
  bool stamped_ = false;
};

}  // namespace fieldtrue::acquisition
