#pragma once

#include <istream>
#include <memory>
#include <string>

#include "calib/core/error.h"

namespace fieldtrue {

/// Longest line of a table; a row has some hundred characters, and a file without line ends must not fill the memory.
inline constexpr std::size_t kLongestLine = 1 << 20;

/// Reads a text line by line, without line ends (LF or CRLF) and the byte-order mark.
class LineReader {
 public:
  /// @param name stands in messages
  LineReader(std::istream& in, std::string name);

  /// @return false at the end
  /// @error kBadInput for a line longer than kLongestLine, naming it; kIo
  Result<bool> next(std::string& line);
  int number() const { return number_; }  ///< Of the line read last, from 1; 0 before the first.
  bool hasNewline() const { return has_newline_; }
  const std::string& name() const { return name_; }

 private:
  std::istream* in_;
  std::string name_;
  std::unique_ptr<char[]> buffer_;
  int number_ = 0;
  bool has_newline_ = true;
};

}  // namespace fieldtrue
