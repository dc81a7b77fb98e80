#pragma once

#include <QString>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "acquisition/devices/tracker_device.h"
#include "calib/core/error.h"
#include "calib/core/settings.h"
#include "calib/simulation/scene.h"

namespace fieldtrue {

/// A device as a person writes it: `kind`, `kind:address` or `kind:address@baud`, e.g. `fastrak:/dev/ttyUSB0@115200`,
/// `fastrak:tcp:localhost:4000`, `simulated:speed=4,seed=2`.
struct DeviceAddress {
  std::string kind;
  std::string address;
};
/// @error kBadInput
Result<DeviceAddress> parseDevice(const std::string& text);

/// One row of the device registry.
struct DeviceKind {
  std::string id;
  std::string label;
  std::string address_help;  ///< How to write the address.
  std::string source;
  std::vector<Setting> settings;
  /// @param address after the first colon; @param scene only used by simulated devices
  Result<std::unique_ptr<TrackerDevice>> (*make)(const std::string& address, const Scene& scene) = nullptr;
};

/// Every kind; the simulated tracker is the first row.
std::span<const DeviceKind> deviceKinds();
/// @error kBadInput naming the known kinds
Result<std::unique_ptr<TrackerDevice>> makeDevice(const std::string& text, const Scene& scene);

/// Serial lines present on this machine, for the connect page: path and description.
struct SerialLine {
  std::string path;
  std::string description;
};
std::vector<SerialLine> serialLines();

}  // namespace fieldtrue
