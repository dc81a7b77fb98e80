#pragma once

#include <memory>
#include <string>

#include "calib/core/error.h"

namespace fieldtrue::acquisition {

/// How a local line (a device file) is opened, set and moved; a LocalTransport watches its file descriptor.
class LineDriver {
 public:
  virtual ~LineDriver() = default;
  /// Opens for itself alone, 8 data bits, no parity, 1 stop bit, no flow control, non-blocking.
  /// @return the file descriptor to watch
  /// @error kDevice, one sentence; kUnsupported when this driver cannot handle such a line and another may
  virtual Result<int> open(const std::string& path, int baud) = 0;
  virtual void close() = 0;
  /// @return bytes moved; 0 when none can be now; -1 when the line is gone
  virtual long read(char* to, std::size_t size) = 0;
  virtual long write(const char* from, std::size_t size) = 0;
  virtual bool setBaud(int baud) = 0;  ///< False when the line has no baud rate or refuses it.
  virtual void setRequestToSend(bool on) = 0;
  virtual void setBreak(bool on) = 0;
};

/// Through libserialport: real serial lines.
std::unique_ptr<LineDriver> makeSerialPortDriver();
/// Through termios: ptys, and ttys that libserialport refuses.
std::unique_ptr<LineDriver> makeTermiosDriver();

}  // namespace fieldtrue::acquisition
