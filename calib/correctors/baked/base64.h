#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fieldtrue::correctors {

/// Bytes as text with padding. @source RFC 4648, section 4
std::string toBase64(std::span<const std::uint8_t> bytes);

/// The inverse; none for text of another form (length, letters, padding).
std::optional<std::vector<std::uint8_t>> fromBase64(std::string_view text);

/// Single-precision numbers as four bytes each, least significant first, whatever the machine's own order.
std::vector<std::uint8_t> littleEndianBytes(std::span<const float> values);
/// The inverse. @param bytes a multiple of four
std::vector<float> fromLittleEndianBytes(std::span<const std::uint8_t> bytes);

}  // namespace fieldtrue::correctors
