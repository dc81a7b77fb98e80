#pragma once

#include <optional>
#include <string>

#include "acquisition/transports/usb_adapters.h"

namespace fieldtrue::acquisition {

/// The address of a line that is opened again and again: where its USB adapter is plugged in elsewhere, or got another
/// name, the line is where the adapter is.
class FollowedLine {
 public:
  /// @param address as makeTransport reads it
  /// @param system_folder where the kernel shows its devices
  explicit FollowedLine(std::string address, std::string system_folder = "/sys");

  /// The address to open now. What was behind the path when this was first asked is what is followed; a line that is on
  /// no adapter, or on one without a serial number, stays where it is.
  std::string now();

 private:
  std::string path_;
  std::string rate_;  ///< "@115200", or nothing.
  std::string system_folder_;
  std::optional<UsbAdapter> adapter_;
};

}  // namespace fieldtrue::acquisition
