#pragma once

#include <string>
#include <vector>

namespace fieldtrue {

/// A serial line libserialport finds on this machine.
struct SerialPortInfo {
  std::string path;
  std::string description;
};
std::vector<SerialPortInfo> listSerialPorts();

}  // namespace fieldtrue
