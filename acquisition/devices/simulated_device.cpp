#include "acquisition/devices/simulated_device.h"

#include <algorithm>

#include "calib/core/declare.h"

namespace fieldtrue::acquisition {
namespace {

FastrakSetup driverSetup(double speed, double rate_hz) {
  FastrakSetup setup;
  setup.name = "simulated tracker";
  setup.tells_version = false;
  setup.where = "the simulated line";
  setup.device_text = "simulated";
  setup.hemisphere = "tracked";
  setup.may_reset = false;
  setup.rate_hz = rate_hz;
  const auto scaled = [speed](int ms) { return std::max(2, static_cast<int>(ms / std::max(1.0, speed))); };
  LineTimings& t = setup.timings;
  t.settle_ms = scaled(t.settle_ms);
  t.clear_ms = scaled(t.clear_ms);
  t.command_ms = scaled(t.command_ms / 4);
  t.quiet_ms = scaled(t.quiet_ms);
  t.stop_quiet_ms = scaled(t.stop_quiet_ms);
  return setup;
}

}  // namespace

std::vector<Setting> simulatedSettings() {
  Setting fault =
      declare::choice("fault", "Fault", {"none"}, "none", "What the emulated tracker does wrong on purpose.");
  for (const auto& row : emulatorFaults()) {
    if (!row.needs_count && row.isOf("fastrak")) fault.choices.push_back(row.id);
  }
  return {
      declare::number("speed", "Speed", {0.1, 100.0}, 1.0, "The tracker's seconds per second."),
      declare::integer("seed", "Seed", {0.0, 2147483647.0}, 1, "Noise and placing errors follow from it."),
      declare::number("travel_s", "Travel", {0.0, 60.0, "s"}, 1.0,
                      "Time the operator takes from one place to the next."),
      declare::number("tremor_m", "Tremor", {0.0, 0.05, "m"}, OperatorHabits{}.tremor_m,
                      "Amplitude of the hand while carrying."),
      fault,
  };
}

Result<SimulatedSetup> simulatedSetup(const Settings& settings) {
  SimulatedSetup setup;
  setup.speed = numberSetting(settings, "speed");
  setup.seed = static_cast<std::uint64_t>(integerSetting(settings, "seed"));
  setup.habits.travel_s = numberSetting(settings, "travel_s");
  setup.habits.tremor_m = numberSetting(settings, "tremor_m");
  const std::string& fault = choiceSetting(settings, "fault");
  if (fault == "none") return setup;
  auto faults = parseFaults(fault);
  if (!faults) return tl::unexpected(faults.error());
  setup.faults = *faults;
  return setup;
}

Result<std::unique_ptr<SimulatedDevice>> SimulatedDevice::make(const simulation::Scene& scene,
                                                               const SimulatedSetup& setup) {
  FT_TRY_VOID(simulation::TrackerSimulator::make(scene, setup.seed));
  return std::unique_ptr<SimulatedDevice>(
      new SimulatedDevice(scene, setup, driverSetup(setup.speed, scene.tracker.rate_hz)));
}

SimulatedDevice::SimulatedDevice(const simulation::Scene& scene, const SimulatedSetup& setup,
                                 const FastrakSetup& driver)
    : LineDevice(
          driver, [driver](Transport& line) { return std::make_unique<FastrakStartup>(line, driver); },
          [this] { return plugIn(); }, setup.speed),
      scene_(scene),
      simulated_(setup) {}

Result<std::unique_ptr<Transport>> SimulatedDevice::plugIn() {
  delete emulator_;
  emulator_ = nullptr;
  jig_ = nullptr;
  FT_TRY(auto simulator, simulation::TrackerSimulator::make(scene_, simulated_.seed));
  auto jig = std::make_unique<SimulatedJig>(std::move(simulator), simulated_.habits, simulated_.seed);
  jig_ = jig.get();
  auto [host_end, device_end] = LoopbackTransport::pair();
  FastrakEmulatorOptions options;
  options.faults = simulated_.faults;
  options.seed = simulated_.seed;
  options.identity = "simulated: " + scene_.name;
  auto emulator = emulatorOnLine<FastrakEmulatorCore>(std::move(jig), std::move(device_end), options, simulated_.speed);
  emulator->setParent(this);
  FT_TRY_VOID(emulator->start());
  emulator_ = emulator.release();
  if (asked_) jig_->guideTo(*asked_, 0.0);
  return std::move(host_end);
}

void SimulatedDevice::guideTo(const Pose& reference_from_sensor) {
  asked_ = reference_from_sensor;
  if (jig_) jig_->guideTo(reference_from_sensor, emulator_->time_s());
}

TableMetadata SimulatedDevice::describe() const {
  TableMetadata metadata = LineDevice::describe();
  metadata.tracker = "simulated tracker in " + scene_.name;
  metadata.transmitter_model = "dipole";
  // How the emulated line was set up says nothing of this tracker, and names another.
  std::erase_if(metadata.other, [](const auto& entry) { return entry.first.starts_with("fastrak_"); });
  metadata.setup = {{"tracker_kind", "simulated"}, {"room", scene_.name}};
  metadata.excitation = scene_.tracker.excitation;
  metadata.carrier_hz = scene_.tracker.carrier_hz;
  metadata.rate_hz = scene_.tracker.rate_hz;
  metadata.rig = scene_.rig.name;
  metadata.jig_tolerance_m = scene_.rig.tolerance_m;
  metadata.jig_tolerance_rad = scene_.rig.tolerance_rad;
  if (scene_.tracker.quantum_m > 0.0) metadata.quantum_m = scene_.tracker.quantum_m;
  return metadata;
}

}  // namespace fieldtrue::acquisition
