#pragma once

#include <optional>
#include <string>
#include <vector>

#include "acquisition/transports/usb_adapters.h"

namespace fieldtrue::acquisition {

/// The USB adapters on which trackers were found or connected before, kept for the user: plugged in elsewhere they get
/// another port, and are known all the same.
class KnownAdapters {
 public:
  struct Row {
    UsbAdapter adapter;
    std::string line;    ///< Where it was last: "/dev/ttyUSB0".
    std::string device;  ///< The tracker on it: "fastrak:/dev/ttyUSB0@115200".
  };

  /// Those of this user, in the folder of settings.
  static KnownAdapters ofUser();
  /// @param path of a file that need not be there; one that cannot be read counts as empty
  explicit KnownAdapters(std::string path);

  const std::vector<Row>& rows() const { return rows_; }
  /// Keeps what is on an adapter; one without a serial number cannot be known again. What cannot be written is not
  /// kept: nothing depends on it.
  void remember(const UsbAdapter& adapter, const std::string& line, const std::string& device);
  /// What is known of the line's adapter, in a sentence; empty = nothing.
  std::string noteOn(const std::string& line, const std::optional<UsbAdapter>& adapter) const;
  /// Where the adapter that was last on a line is now, if that line is gone or another adapter's.
  /// @return none where it is where it was, not known, or not plugged in
  std::optional<std::string> movedTo(const std::string& line, const std::string& system_folder = "/sys") const;

 private:
  std::string path_;
  std::vector<Row> rows_;
};

}  // namespace fieldtrue::acquisition
