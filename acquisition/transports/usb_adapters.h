#pragma once

#include <optional>
#include <string>
#include <vector>

namespace fieldtrue::acquisition {

/// What a USB adapter says of itself; its serial number tells it from others of its kind.
struct UsbAdapter {
  int vendor = 0;
  int product = 0;
  std::string serial;       ///< Empty where it has none.
  std::string description;  ///< Its own words: "FTDI USB-RS232 Cable".

  /// Whether both are one device: without a serial number nobody can tell.
  bool isSame(const UsbAdapter& other) const;
};

/// A port of this machine on a USB adapter.
struct UsbPort {
  std::string path;  ///< "/dev/ttyUSB0".
  UsbAdapter adapter;
};

/// The adapter behind a port; none for other lines.
/// @param path links are followed
/// @param system_folder where the kernel shows its devices
std::optional<UsbAdapter> usbAdapterOf(const std::string& path, const std::string& system_folder = "/sys");
/// Every port on a USB adapter, by path.
std::vector<UsbPort> usbPorts(const std::string& system_folder = "/sys");
/// Where the adapter is now. @return none where it is not plugged in, or has no serial number
std::optional<std::string> portOf(const UsbAdapter& adapter, const std::string& system_folder = "/sys");

}  // namespace fieldtrue::acquisition
