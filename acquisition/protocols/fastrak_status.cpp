#include "acquisition/protocols/fastrak_status.h"

#include <array>
#include <charconv>
#include <cstdio>
#include <utility>

#include "calib/core/trimmed.h"

namespace fieldtrue::acquisition {
namespace {

constexpr std::size_t kStatusBytes = 55;
constexpr std::size_t kShortStatusBytes = 54;
constexpr unsigned kReservedFlags = 0x3F0;
constexpr std::string_view kErrorMark = "*ERROR*";

std::optional<unsigned> hex(std::string_view text) {
  unsigned value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<FastrakStatus> parseStatus(std::string_view bytes) {
  if (bytes[0] != '2' || bytes[2] != 'S' || bytes.substr(10, 2) != "F3" || !bytes.ends_with("\r\n"))
    return std::nullopt;
  const auto flags = hex(bytes.substr(3, 3));
  const auto sensors = hex(bytes.substr(12, 1));
  if (!flags || !sensors) return std::nullopt;
  FastrakStatus status;
  status.station = bytes[1] - '0';
  status.format = (*flags & 1u) ? FastrakFormat::kBinary : FastrakFormat::kAscii;
  status.unit = (*flags & 2u) ? FastrakUnit::kCentimetre : FastrakUnit::kInch;
  status.compensation = (*flags & 4u) != 0;
  status.continuous = (*flags & 8u) != 0;
  status.self_test_error = trimmed(bytes.substr(6, 3));
  status.sensors = *sensors;
  status.version = trimmed(bytes.substr(15, 6));
  status.identity = trimmed(bytes.substr(21));
  return status;
}

constexpr std::pair<int, const char*> kRefusals[] = {
    {-1, "a parameter is missing"},        {-2, "a parameter is not numeric"}, {-3, "a parameter is out of range"},
    {-5, "the command buffer overflowed"}, {-99, "the command is unknown"},
};

constexpr std::pair<char, const char*> kErrorLetters[] = {
    {'a', "sensor self-calibration limit (a)"},
    {'b', "sensor self-calibration limit (b)"},
    {'c', "sensor self-calibration limit (c)"},
    {'d', "sensor self-calibration limit (d)"},
    {'e', "sensor self-calibration limit (e)"},
    {'f', "sensor self-calibration limit (f)"},
    {'g', "sensor self-calibration limit (g)"},
    {'j', "signal saturated: the sensor is too close to the transmitter"},
    {'k', "signal too low: the sensor is too far from the transmitter"},
    {'l', "the largest signal element is zero: the sensor or the transmitter is not connected"},
    {'m', "checksum of the tracker's EEPROM"},
    {'s', "the position of the unit was reset"},
    {'t', "fault in the compensation table"},
    {'u', "outside the bounds of the compensation table"},
    {'v', "CRT synchronisation lost"},
    {'w', "write to the tracker's EEPROM failed"},
    {'x', "outside the position envelope"},
    {'y', "outside the angular envelope"},
};

}  // namespace

std::string encodeStatus(const FastrakStatus& status) {
  const unsigned flags = kReservedFlags | (status.format == FastrakFormat::kBinary ? 1u : 0u) |
                         (status.unit == FastrakUnit::kCentimetre ? 2u : 0u) | (status.compensation ? 4u : 0u) |
                         (status.continuous ? 8u : 0u);
  std::array<char, 80> text{};
  std::snprintf(text.data(), text.size(), "2%dS%03X%3.3s F3%X  %-6.6s%-32.32s\r\n", status.station, flags,
                status.self_test_error.c_str(), status.sensors & 0xFu, status.version.c_str(), status.identity.c_str());
  return text.data();
}

std::optional<FastrakStatus> findStatus(std::string_view bytes) {
  for (std::size_t end = bytes.find('\n'); end != std::string_view::npos; end = bytes.find('\n', end + 1)) {
    for (const std::size_t length : {kStatusBytes, kShortStatusBytes}) {
      if (end + 1 < length) continue;
      if (auto status = parseStatus(bytes.substr(end + 1 - length, length))) return status;
    }
  }
  return std::nullopt;
}

std::string encodeRefusal(const FastrakRefusal& refusal) {
  return "2" + std::to_string(refusal.station) + " E" + std::string(kErrorMark) + refusal.command +
         std::string(kErrorMark) + " EC " + std::to_string(refusal.code) + " " + refusalMeaning(refusal.code) + "\r\n";
}

std::optional<FastrakRefusal> findRefusal(std::string_view bytes) {
  const std::size_t first = bytes.find(kErrorMark);
  if (first == std::string_view::npos) return std::nullopt;
  const std::size_t command = first + kErrorMark.size();
  const std::size_t second = bytes.find(kErrorMark, command);
  if (second == std::string_view::npos || bytes.find('\n', second) == std::string_view::npos) return std::nullopt;
  FastrakRefusal refusal;
  if (first >= 3 && bytes[first - 2] == ' ') refusal.station = bytes[first - 3] - '0';
  refusal.command = trimmed(bytes.substr(command, second - command));
  const std::size_t code = bytes.find("EC", second);
  if (code != std::string_view::npos) {
    const std::size_t digits = bytes.find_first_not_of(' ', code + 2);
    if (digits != std::string_view::npos) {
      std::from_chars(bytes.data() + digits, bytes.data() + bytes.size(), refusal.code);
    }
  }
  return refusal;
}

std::string refusalMeaning(int code) {
  for (const auto& [known, text] : kRefusals) {
    if (known == code) return text;
  }
  return "error " + std::to_string(code);
}

std::string errorMeaning(char letter) {
  if (letter == ' ') return {};
  for (const auto& [known, text] : kErrorLetters) {
    if (known == letter) return text;
  }
  if (letter >= 'A' && letter <= 'Z') return std::string("self-test or hardware error (") + letter + ")";
  return "error letter " + std::string(1, letter) + ", which the manual does not list";
}

std::string fastrakStatusMeaning(const std::string& status) {
  return status.size() == 1 ? errorMeaning(status[0]) : commonStatusMeaning(status);
}

std::optional<std::string> findReadBack(std::string_view bytes, char letter, int station) {
  const std::string head = {'2', static_cast<char>('0' + station), letter};
  const std::size_t start = bytes.find(head);
  if (start == std::string_view::npos) return std::nullopt;
  const std::size_t end = bytes.find('\n', start);
  if (end == std::string_view::npos) return std::nullopt;
  return std::string(trimmed(bytes.substr(start + head.size(), end - start - head.size())));
}

}  // namespace fieldtrue::acquisition
