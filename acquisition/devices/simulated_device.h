#pragma once

#include <memory>
#include <optional>

#include "acquisition/devices/fastrak_device.h"
#include "acquisition/emulators/fastrak_emulator_core.h"
#include "acquisition/emulators/simulated_jig.h"
#include "calib/simulation/scene.h"

namespace fieldtrue::acquisition {

struct SimulatedSetup {
  double speed = 1.0;  ///< The tracker's seconds per second.
  std::uint64_t seed = 1;
  OperatorHabits habits;
  EmulatorFaults faults;
};

/// The simulated tracker: a real Fastrak driver over an emulated Fastrak in a scene, with an operator who carries the
/// jig where guideTo says. Sample times are the tracker's seconds.
class SimulatedDevice : public LineDevice {
  Q_OBJECT
 public:
  /// @error of the scene
  static Result<std::unique_ptr<SimulatedDevice>> make(const simulation::Scene& scene, const SimulatedSetup& setup);

  /// The operator travels there in `travel_s`, with a hand that trembles and settles. Call once for each place.
  void guideTo(const Pose& reference_from_sensor) override;
  TableMetadata describe() const override;

 private:
  SimulatedDevice(const simulation::Scene& scene, const SimulatedSetup& setup, const FastrakSetup& driver);
  Result<std::unique_ptr<Transport>> plugIn();

  simulation::Scene scene_;
  SimulatedSetup simulated_;
  EmulatorRunner* emulator_ = nullptr;
  SimulatedJig* jig_ = nullptr;
  std::optional<Pose> asked_;
};

/// Settings of the simulated tracker as data.
std::vector<Setting> simulatedSettings();
/// @param settings resolved from simulatedSettings()
Result<SimulatedSetup> simulatedSetup(const Settings& settings);

}  // namespace fieldtrue::acquisition
