#pragma once

#include <string>
#include <string_view>

namespace blind {

/// SHA-256 of a byte string as 64 lower-case hexadecimal digits.
/// @param bytes the message, any length
/// @return the digest
/// @source FIPS 180-4 (2015), sections 4.1.2, 5.1.1 and 6.2
std::string sha256Hex(std::string_view bytes);

}  // namespace blind
