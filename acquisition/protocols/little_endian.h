#pragma once

#include <bit>
#include <cstdint>
#include <string>

namespace fieldtrue::acquisition {

/// Numbers of two and four bytes, low byte first, whatever the computer's own order.
inline std::uint16_t littleEndian16(const char* bytes) {
  const auto at = [bytes](int i) { return static_cast<unsigned>(static_cast<unsigned char>(bytes[i])); };
  return static_cast<std::uint16_t>(at(0) | at(1) << 8);
}

inline std::uint32_t littleEndian32(const char* bytes) {
  return littleEndian16(bytes) | static_cast<std::uint32_t>(littleEndian16(bytes + 2)) << 16;
}

inline double littleEndianFloat(const char* bytes) {
  return static_cast<double>(std::bit_cast<float>(littleEndian32(bytes)));
}

inline void appendLittleEndian16(std::string& out, std::uint16_t value) {
  out += static_cast<char>(value & 0xFFu);
  out += static_cast<char>(value >> 8);
}

inline void appendLittleEndian32(std::string& out, std::uint32_t value) {
  appendLittleEndian16(out, static_cast<std::uint16_t>(value & 0xFFFFu));
  appendLittleEndian16(out, static_cast<std::uint16_t>(value >> 16));
}

inline void appendLittleEndianFloat(std::string& out, double value) {
  appendLittleEndian32(out, std::bit_cast<std::uint32_t>(static_cast<float>(value)));
}

}  // namespace fieldtrue::acquisition
