#pragma once

#include <string>
#include <string_view>

namespace fieldtrue::calibration {

/// FNV-1a, 64 bit, as 16 lower-case hexadecimal digits. Finds damage, not forgery.
/// @source Fowler, Noll, Vo 1991
std::string fnv1a64(std::string_view bytes);

}  // namespace fieldtrue::calibration
