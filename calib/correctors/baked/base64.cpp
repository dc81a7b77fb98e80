#include "calib/correctors/baked/base64.h"

#include <array>
#include <bit>

#include "calib/core/error.h"

namespace fieldtrue::correctors {
namespace {

constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr std::uint32_t kNoLetter = 64;

constexpr std::array<std::uint32_t, 256> letterValues() {
  std::array<std::uint32_t, 256> values{};
  values.fill(kNoLetter);
  for (std::size_t i = 0; i < kLetters.size(); ++i)
    values[static_cast<std::uint8_t>(kLetters[i])] = static_cast<std::uint32_t>(i);
  return values;
}

}  // namespace

std::string toBase64(std::span<const std::uint8_t> bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < count ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kLetters[group >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

std::optional<std::vector<std::uint8_t>> fromBase64(std::string_view text) {
  static constexpr std::array<std::uint32_t, 256> kValues = letterValues();
  if (text.size() % 4 != 0) return std::nullopt;
  std::size_t padding = 0;
  while (padding < 2 && padding < text.size() && text[text.size() - 1 - padding] == '=') ++padding;
  std::vector<std::uint8_t> bytes;
  bytes.reserve(text.size() / 4 * 3);
  for (std::size_t i = 0; i < text.size(); i += 4) {
    const std::size_t letters = i + 4 == text.size() ? 4 - padding : 4;
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint32_t value = k < letters ? kValues[static_cast<std::uint8_t>(text[i + k])] : 0U;
      if (value == kNoLetter) return std::nullopt;
      group = group << 6 | value;
    }
    for (std::size_t k = 0; k + 1 < letters; ++k) bytes.push_back(static_cast<std::uint8_t>(group >> (16 - 8 * k)));
    // Bits beyond the last byte are zero in what toBase64 writes.
    if (letters < 4 && (group & (letters == 2 ? 0xFFFFU : 0xFFU)) != 0) return std::nullopt;
  }
  return bytes;
}

std::vector<std::uint8_t> littleEndianBytes(std::span<const float> values) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(4 * values.size());
  for (const float value : values) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    for (std::uint32_t shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<std::uint8_t>(bits >> shift));
  }
  return bytes;
}

std::vector<float> fromLittleEndianBytes(std::span<const std::uint8_t> bytes) {
  FT_CHECK(bytes.size() % 4 == 0);
  std::vector<float> values;
  values.reserve(bytes.size() / 4);
  for (std::size_t i = 0; i < bytes.size(); i += 4) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 4; ++k) bits |= static_cast<std::uint32_t>(bytes[i + k]) << (8 * k);
    values.push_back(std::bit_cast<float>(bits));
  }
  return values;
}

}  // namespace fieldtrue::correctors
