#pragma once

#include <string>

#include "calib/core/error.h"

namespace fieldtrue::acquisition {

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

}  // namespace fieldtrue::acquisition
