#pragma once

#include <string>
#include <vector>

#include "acquisition/devices/line_device.h"
#include "acquisition/devices/tracker_probe.h"
#include "acquisition/protocols/flock_commands.h"
#include "calib/simulation/scene.h"

namespace fieldtrue::acquisition {

/// How a Flock of Birds is to be set up.
struct FlockSetup : LineSetup {
  FlockSetup() {
    id = "flock";
    make = "Ascension Flock of Birds";
    name = "Flock of Birds";
    excitation = "pulsed_dc";
  }
  std::vector<int> stations;        ///< Birds in the order of their addresses; empty = all that have a receiver.
  std::string addressing = "auto";  ///< Or "normal", "expanded", "super_expanded".
  std::string record = "position_quaternion";
  std::string range = "auto";  ///< Or "36", "72", "144" [in].
  std::string hemisphere = "+x";
  std::string filter = "off";  ///< "off", "on", "as_set".
  bool raw_frame = true;       ///< Clears angle align and reference frame.
  bool drop_repeats = true;
  FlockConventions conventions;
  int pulse_ms = 250;       ///< RTS high: the bird is held in reset.
  int boot_ms = 2000;       ///< After it.
  int configure_ms = 1000;  ///< Between questions whether the birds run, and 300 ms at least around auto-configure.
};

/// How a Flock of Birds is found on a line.
TrackerProbe flockProbe();

/// The settings of a Flock of Birds as data, for registry, forms and command line.
std::vector<Setting> flockSettings();
/// Its stream, from its birds and how their records are made. @error kBadInput
Result<StreamPlan> flockStream(const StreamSettings& settings);
/// A Flock of Birds at an address. @error kBadInput
Result<std::unique_ptr<TrackerDevice>> makeFlock(const std::string& address, const simulation::Scene& scene);

/// Brings a Flock of Birds from any state to a stream: reset by RTS where the line has it, the flock configured where
/// it is not, record mode, side, filters and frames as asked for. Nothing is asked for while it streams.
class FlockStartup : public TrackerStartup {
  Q_OBJECT
 public:
  FlockStartup(Transport& line, const FlockSetup& setup);
  void run() override;
  StreamPlan stream() const override;
  std::string farewell() const override { return flock::point(); }

 private:
  void callOut();
  void modelCame(const std::string& model);
  void unitsKnown();
  bool isConfigured() const;
  void configure();
  void awaitRunning(int tries);
  void setUpBirds();
  void verify();
  void settled();
  LineStep tell(int address, const std::string& command) const;
  LineStep examine(int parameter, std::size_t bytes, std::function<void(const std::string&)> take) const;
  std::vector<int> birdCommandAddresses() const;
  double range_m() const;

  FlockSetup flock_;
  FlockAddressing addressing_ = FlockAddressing::kNormal;
  std::string model_;
  std::string revision_;
  std::vector<FlockUnit> units_;  ///< By address less one; empty where the unit does not tell.
  std::vector<int> receivers_;    ///< Their addresses, ascending; 0 = the bird on the line, which has no flock.
  bool standalone_ = false;
  bool group_ = false;
  int scale_ = 0;
  int crystal_mhz_ = 0;
  int rate_count_ = 0;
  int error_ = 0;
  FlockStatus status_;
};

}  // namespace fieldtrue::acquisition
