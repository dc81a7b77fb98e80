#pragma once

#include <QString>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "acquisition/devices/tracker_device.h"
#include "acquisition/devices/tracker_probe.h"
#include "acquisition/devices/tracker_startup.h"
#include "acquisition/emulators/emulation.h"
#include "acquisition/emulators/emulator_runner.h"
#include "calib/core/error.h"
#include "calib/core/settings.h"
#include "calib/simulation/scene.h"

namespace fieldtrue::acquisition {

/// A device as a person writes it: `kind`, `kind:address` or `kind:address@baud`, e.g. `fastrak:/dev/ttyUSB0@115200`,
/// `fastrak:tcp:localhost:4000`, `simulated:speed=4,seed=2`.
struct DeviceAddress {
  std::string kind;
  std::string address;
};
/// @error kBadInput
Result<DeviceAddress> parseDevice(const std::string& text);

/// 3-D SD of a single unfiltered reading at a distance from the transmitter. Farther away it grows with the fourth
/// power of the distance; nearer it is taken to be the same, for there something else than the receiver decides.
struct TypicalNoise {
  double sd_m = 0.0;
  double range_m = 1.0;
};

/// One row of the device registry.
struct DeviceKind {
  std::string id;
  std::string label;
  std::string address_help;  ///< How to write the address.
  std::string source;
  std::vector<Setting> settings;
  std::vector<std::string> usual_addresses = {};  ///< Offered in place of serial lines, where it is not on one.
  /// How it is found on a line; none where it cannot be.
  std::optional<TrackerProbe> probe = std::nullopt;
  std::vector<KnownUsb> usb = {};  ///< Adapters and sockets that are its own: it is asked first there.
  std::optional<TypicalNoise> noise = std::nullopt;  ///< None where it is not known.
  /// @param address after the first colon; @param scene only used by simulated devices
  Result<std::unique_ptr<TrackerDevice>> (*make)(const std::string& address, const simulation::Scene& scene) = nullptr;
  /// Makes its stream's parser again from what was kept beside a line's bytes; null where it has no line.
  Result<StreamPlan> (*stream)(const StreamSettings& settings) = nullptr;
  /// Its other side, on a pty or a TCP port, not yet started; null where nothing is emulated.
  Result<std::unique_ptr<EmulatorRunner>> (*emulate)(const Emulation& emulation) = nullptr;
};

/// Every kind; the simulated tracker is the first row.
std::span<const DeviceKind> deviceKinds();
/// The kind of an id that can be emulated. @error kBadInput naming those that can
Result<const DeviceKind*> findEmulated(const std::string& id);
/// 3-D SD of a single reading that a tracker of a kind should have at a range [m]; none where it is not known.
std::optional<double> expectedNoise_m(const std::string& kind, double range_m);
/// @error kBadInput naming the known kinds
Result<std::unique_ptr<TrackerDevice>> makeDevice(const std::string& text, const simulation::Scene& scene);

/// Serial lines present on this machine, for the connect page: path and description.
struct SerialLine {
  std::string path;
  std::string description;
};
std::vector<SerialLine> serialLines();

}  // namespace fieldtrue::acquisition
