#pragma once

#include <memory>
#include <string>

#include "calib/core/error.h"

namespace fieldtrue {

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
  virtual void sendBreak(int milliseconds) = 0;
};

/// Through libserialport: real serial lines.
std::unique_ptr<LineDriver> makeSerialPortDriver();
/// Through termios: ptys, and ttys that libserialport refuses.
std::unique_ptr<LineDriver> makeTermiosDriver();

/// Whether the path leads to a pseudo-terminal.
bool isPseudoTerminal(const std::string& path);
/// Whether libserialport knows the name as a serial port.
bool isSerialPort(const std::string& path);
/// The name libserialport knows: symbolic links (/dev/serial/by-id/...) followed.
std::string resolvedPath(const std::string& path);

/// One sentence for the system's reason why a line could not be opened.
/// @param system_error an errno value
Error lineOpenError(const std::string& path, int system_error);
/// Takes the line for this process. @error kDevice naming who has it, where that can be known
Result<void> lockLine(const std::string& path, int descriptor);

}  // namespace fieldtrue
