#pragma once

#include <string>
#include <string_view>

namespace fieldtrue::testing {

/// Bytes written as they would be noted from a line analyser: literal text with `<hex>` for the rest, e.g. "01 <0000 20
/// 41>".
inline std::string bytes(std::string_view text) {
  std::string out;
  bool hex = false;
  int digits = 0;
  unsigned value = 0;
  for (const char c : text) {
    if (c == '<' || c == '>') {
      hex = c == '<';
    } else if (!hex) {
      out += c;
    } else if (c != ' ') {
      value = value * 16 + static_cast<unsigned>(c <= '9' ? c - '0' : (c | 0x20) - 'a' + 10);
      if (++digits == 2) {
        out += static_cast<char>(value);
        digits = 0;
        value = 0;
      }
    }
  }
  return out;
}

/// Station 1 of a recorded exchange with a VRPN client: 10, -5, 2.5 in and the quaternion of az 30, el 10, roll -20
/// deg, in the list 2,11,0. The floats are IEEE-754 written out by another program.
inline constexpr std::string_view kVrpnBinary = "01 <00002041 0000A0C0 00002040><3E97713F F5D941BE 72331C3D 8D7D893E> ";
inline constexpr std::string_view kVrpnAscii = "01   10.00  -5.00   2.50 0.9437-0.1893 0.0381 0.2685 ";

}  // namespace fieldtrue::testing
