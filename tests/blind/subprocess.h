#pragma once

#include <optional>
#include <string>
#include <vector>

namespace blind {

/// How a program ended and what it printed.
struct Finished {
  int exit_status = 0;  ///< 128 + signal when it was killed, 127 when it could not be started.
  std::string output;   ///< Its standard output.
};

/// Runs a program to its end; its standard error is dropped. May be called from several threads at once.
/// @param words path of the program, then its arguments
/// @param limit_s after so long it is killed; none: it may take for ever
Finished runProgram(const std::vector<std::string>& words, std::optional<double> limit_s = std::nullopt);

}  // namespace blind
