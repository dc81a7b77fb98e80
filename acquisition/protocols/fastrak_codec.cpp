#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <utility>

#include "acquisition/protocols/fastrak_items.h"
#include "acquisition/protocols/little_endian.h"
#include "acquisition/protocols/plain_number.h"

namespace fieldtrue::acquisition {
namespace {

constexpr double kPowersOfTen[] = {1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6};
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

bool isDigit(char c) { return c >= '0' && c <= '9'; }

/// Digits with a point before the last `decimals` of them; leading blanks, then an optional sign, then digits only.
std::optional<double> parseFixed(std::string_view text, int decimals) {
  const std::size_t point = text.size() - static_cast<std::size_t>(decimals) - 1;
  if (text[point] != '.') return std::nullopt;
  std::size_t i = 0;
  while (i < point && text[i] == ' ') ++i;
  const bool negative = i < point && text[i] == '-';
  if (negative || (i < point && text[i] == '+')) ++i;
  double digits = 0.0;
  for (; i < text.size(); ++i) {
    if (i == point) continue;
    if (!isDigit(text[i])) return std::nullopt;
    digits = digits * 10.0 + (text[i] - '0');
  }
  const double value = digits / kPowersOfTen[decimals];
  return negative ? -value : value;
}

std::optional<double> parsePlain(std::string_view text, int decimals) {
  if (text.find_first_not_of('*') == std::string_view::npos) return kNan;
  return parseFixed(text, decimals);
}

/// `Sx.xxxxxESxx` and a blank.
std::optional<double> parseExtended(std::string_view text) {
  if (text.back() != ' ') return std::nullopt;
  if (text.substr(0, 12).find_first_not_of('*') == std::string_view::npos) return kNan;
  const auto mantissa = parseFixed(text.substr(0, 8), 5);
  const char sign = text[9];
  if (!mantissa || text[8] != 'E' || (sign != '+' && sign != '-' && sign != ' ')) return std::nullopt;
  if (!isDigit(text[10]) || !isDigit(text[11])) return std::nullopt;
  const int exponent = (text[10] - '0') * 10 + (text[11] - '0');
  return *mantissa * std::pow(10.0, sign == '-' ? -exponent : exponent);
}

/// 14 bits of a two's complement word, seven in each byte, low byte first.
double packedWord(const char* bytes) {
  const unsigned low = static_cast<unsigned char>(bytes[0]) & 0x7Fu;
  const unsigned high = static_cast<unsigned char>(bytes[1]) & 0x7Fu;
  return static_cast<double>(static_cast<std::int16_t>(static_cast<std::uint16_t>(low << 2 | high << 9))) / 32768.0;
}

void appendPackedWord(std::string& out, double fraction, bool first) {
  const double scaled = std::clamp(std::round(fraction * 8192.0), -8192.0, 8191.0) * 4.0;
  const auto word = static_cast<std::uint16_t>(static_cast<std::int16_t>(scaled));
  out += static_cast<char>((word >> 2 & 0x7F) | (first ? 0x80 : 0));
  out += static_cast<char>(word >> 9 & 0x7F);
}

bool isPackedLength(const FastrakItem& item) { return item.id == 18; }

std::optional<double> decodeNumber(const char* bytes, const FastrakItem& item, FastrakFormat format) {
  if (item.packed_scale > 0.0) return packedWord(bytes) * item.packed_scale;
  if (format == FastrakFormat::kBinary) return littleEndianFloat(bytes);
  return item.extended ? parseExtended({bytes, 13}) : parsePlain({bytes, 7}, item.decimals);
}

bool decodeField(std::string_view bytes, const FastrakLayout::Field& field, FastrakFormat format, double scale,
                 FastrakRecord& record) {
  const FastrakItem& item = *field.item;
  const char* at = bytes.data() + field.offset;
  if (!item.literal.empty()) return std::memcmp(at, item.literal.data(), item.literal.size()) == 0;
  std::array<double, 4> values{};
  if (item.values == 1) {
    if (at[0] != ' ' || (at[1] != '0' && at[1] != '1')) return false;
    values[0] = at[1] - '0';
  } else {
    const auto count = static_cast<std::size_t>(item.values);
    const std::size_t width = field.width / count;
    for (std::size_t i = 0; i < count; ++i) {
      const auto number = decodeNumber(at + i * width, item, format);
      if (!number) return false;
      values[i] = *number;
    }
  }
  item.store(record, values.data(), isPackedLength(item) ? 1.0 : scale);
  return true;
}

void appendAscii(std::string& out, const FastrakItem& item, double value) {
  if (item.extended) {
    out += exponentText(value, 5) + ' ';
    return;
  }
  const double limit = 1000.0 / kPowersOfTen[std::max(0, item.decimals - 2)] - 1.0 / kPowersOfTen[item.decimals];
  out += fixedText(std::clamp(value, -limit, limit), item.decimals, 7);
}

}  // namespace

bool decodeRecord(std::string_view bytes, const FastrakLayout& layout, FastrakUnit unit, FastrakRecord& record) {
  if (bytes.size() != layout.bytes || bytes[0] != '0' || bytes[1] < '1' || bytes[1] > '4') return false;
  record.station = bytes[1] - '0';
  record.error = bytes[2];
  const double scale = metresPer(unit);
  for (const auto& field : layout.fields) {
    if (!decodeField(bytes, field, layout.format, scale, record)) return false;
  }
  return true;
}

std::optional<FastrakRecord> decodeRecord(std::string_view bytes, const FastrakLayout& layout, FastrakUnit unit) {
  std::optional<FastrakRecord> record(std::in_place);
  if (!decodeRecord(bytes, layout, unit, *record)) record.reset();
  return record;
}

std::string encodeRecord(const FastrakRecord& record, const FastrakLayout& layout, FastrakUnit unit) {
  std::string out;
  out.reserve(layout.bytes);
  out += '0';
  out += static_cast<char>('0' + record.station);
  out += record.error;
  bool first_packed = true;
  for (const auto& field : layout.fields) {
    const FastrakItem& item = *field.item;
    out += item.literal;
    if (!item.literal.empty()) continue;
    std::array<double, 4> values{};
    item.load(record, values.data(), isPackedLength(item) ? 1.0 : metresPer(unit));
    if (item.values == 1) {
      out += values[0] != 0.0 ? " 1" : " 0";
      continue;
    }
    for (int i = 0; i < item.values; ++i) {
      const double v = values[static_cast<std::size_t>(i)];
      if (item.packed_scale > 0.0) {
        appendPackedWord(out, v / item.packed_scale, std::exchange(first_packed, false));
      } else if (layout.format == FastrakFormat::kBinary) {
        appendLittleEndianFloat(out, v);
      } else {
        appendAscii(out, item, v);
      }
    }
  }
  return out;
}

}  // namespace fieldtrue::acquisition
