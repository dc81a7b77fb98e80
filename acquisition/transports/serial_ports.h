#pragma once

#include <string>
#include <vector>

namespace fieldtrue::acquisition {

/// A serial line libserialport finds on this machine.
struct SerialPortInfo {
  std::string path;
  std::string description;
};
std::vector<SerialPortInfo> listSerialPorts();

}  // namespace fieldtrue::acquisition
