#include "acquisition/protocols/ndi.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <utility>

#include "acquisition/protocols/pose_numbers.h"
#include "calib/core/trimmed.h"
#include "calib/core/units.h"

namespace fieldtrue::acquisition {
namespace {

constexpr std::array<std::uint16_t, 256> ndiCrcTable() {
  constexpr unsigned kPolynomial = 0xA001;
  std::array<std::uint16_t, 256> table{};
  for (unsigned i = 0; i < table.size(); ++i) {
    unsigned crc = i;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1u) != 0 ? crc >> 1 ^ kPolynomial : crc >> 1;
    table[i] = static_cast<std::uint16_t>(crc);
  }
  return table;
}
constexpr std::array<std::uint16_t, 256> kNdiCrcTable = ndiCrcTable();

constexpr std::pair<char, int> kRateDigits[] = {{'0', 9600},   {'1', 14400},  {'2', 19200},
                                                {'3', 38400},  {'4', 57600},  {'5', 115200},
                                                {'A', 230400}, {'6', 921600}, {'7', 1228739}};

constexpr std::pair<int, const char*> kNdiErrors[] = {
    {0x01, "the command is unknown to this firmware"},
    {0x02, "the command is too long"},
    {0x03, "the command is too short"},
    {0x04, "the CRC of the command was wrong: the line is disturbed"},
    {0x05, "the command took too long"},
    {0x06, "the new line settings could not be set"},
    {0x07, "the number of parameters is wrong"},
    {0x08, "the port handle is invalid"},
    {0x09, "the tracking priority is invalid"},
    {0x0A, "the LED is invalid"},
    {0x0B, "the state of the LED is invalid"},
    {0x0C, "the command is not possible in this mode: tracking is on, or not"},
    {0x0D, "no tool is at this port handle"},
    {0x0E, "the port handle is not initialised"},
    {0x0F, "the port handle is not enabled"},
    {0x10, "the system is not initialised"},
    {0x11, "tracking could not be stopped"},
    {0x12, "tracking could not be started"},
    {0x13, "the tool could not be initialised: its memory is empty or unknown; give its definition by rom=FILE"},
    {0x14, "the calibration of the sensor or field generator is invalid"},
    {0x15, "the measuring system could not be initialised"},
    {0x19, "the firmware's version could not be read"},
    {0x1A, "internal error of the measuring system"},
    {0x1D, "the tool's memory could not be searched for"},
    {0x1E, "the tool's memory could not be read"},
    {0x1F, "the tool's memory could not be written"},
    {0x20, "the tool's memory could not be selected"},
    {0x22, "no camera parameters fit the tool's wavelength"},
    {0x23, "a parameter is out of range"},
    {0x28, "the hardware has changed: a card or a tool was taken away or added"},
    {0x29, "the firmware is damaged"},
    {0x2A, "no memory is left: too many tools"},
    {0x2B, "the port handle was never handed out"},
    {0x2C, "the tool of this port handle is gone"},
    {0x2D, "all port handles are handed out"},
    {0x2E, "the port description is invalid"},
    {0x2F, "the port has a handle already"},
    {0x31, "the state of an output is invalid"},
    {0xF1, "too much infrared light from elsewhere"},
    {0xF4, "the unit's memory could not be read"},
    {0xF5, "the unit's memory could not be written"},
    {0xF6, "the unit's memory could not be erased"},
};

constexpr std::pair<unsigned, const char*> kSystemBits[] = {
    {0x001, "its parts are out of step"},
    {0x002, "too much interference: infrared light, or another field"},
    {0x004, "a CRC inside the system was wrong"},
    {0x008, "it went on after an internal error"},
    {0x010, "hardware failure: the maker must see it"},
    {0x020, "its hardware has changed"},
    {0x040, "a tool was plugged in; connect again to read it"},
    {0x080, "a tool was unplugged"},
    {0x100, "it has a message of its diagnosis"},
    {0x200, "it is too cold or too hot"},
};

/// Cuts pieces of fixed width from the front of a text; once it is too short or not as it must be, `good` is false.
class NdiColumns {
 public:
  explicit NdiColumns(std::string_view text) : rest_(text) {}
  std::string_view take(std::size_t width) {
    good_ = good_ && rest_.size() >= width;
    if (!good_) return {};
    const std::string_view piece = rest_.substr(0, width);
    rest_.remove_prefix(width);
    return piece;
  }
  unsigned hex(std::size_t width) {
    const auto value = ndiNumber(take(width));
    good_ = good_ && value.has_value();
    return value.value_or(0);
  }
  /// Sign and digits. @param scale of the last digit
  double number(std::size_t width, double scale) {
    const std::string_view piece = take(width);
    good_ = good_ && (piece[0] == '+' || piece[0] == '-');
    long value = 0;
    for (std::size_t i = 1; good_ && i < width; ++i) {
      good_ = piece[i] >= '0' && piece[i] <= '9';
      value = 10 * value + (piece[i] - '0');
    }
    return good_ ? static_cast<double>(piece[0] == '-' ? -value : value) * scale : 0.0;
  }
  bool skip(std::string_view word) {
    if (!good_ || !rest_.starts_with(word)) return false;
    rest_.remove_prefix(word.size());
    return true;
  }
  void require(std::string_view word) { good_ = skip(word); }
  bool good() const { return good_; }
  bool ended() const { return good_ && rest_.empty(); }

 private:
  std::string_view rest_;
  bool good_ = true;
};

constexpr double kQuaternionScale = 1e-4;
constexpr double kPositionScale_mm = 1e-2;
constexpr double kErrorScale_mm = 1e-4;

void readTransform(NdiColumns& columns, NdiTool& tool) {
  for (double& q : tool.quaternion_wxyz) q = columns.number(6, kQuaternionScale);
  for (double& x_mm : tool.position_mm) x_mm = columns.number(7, kPositionScale_mm);
  tool.error_mm = columns.number(6, kErrorScale_mm);
}

NdiTool readTool(NdiColumns& columns) {
  NdiTool tool;
  tool.handle = static_cast<int>(columns.hex(2));
  if (columns.skip("UNOCCUPIED")) {
    tool.state = NdiState::kUnoccupied;
    columns.require("\n");
    return tool;
  }
  if (columns.skip("DISABLED")) {
    tool.state = NdiState::kDisabled;
    if (columns.skip("\n")) return tool;
  } else if (!columns.skip("MISSING")) {
    tool.state = NdiState::kValid;
    readTransform(columns, tool);
  }
  tool.port_status = columns.hex(8);
  tool.frame = columns.hex(8);
  columns.require("\n");
  return tool;
}

std::string signedText(double value, double scale, int digits) {
  const long steps = std::lround(value / scale);
  std::string text = std::to_string(std::abs(steps));
  if (text.size() < static_cast<std::size_t>(digits))
    text.insert(0, static_cast<std::size_t>(digits) - text.size(), '0');
  return (steps < 0 ? "-" : "+") + text;
}

std::string transformText(const NdiTool& tool) {
  std::string text;
  for (const double q : tool.quaternion_wxyz) text += signedText(q, kQuaternionScale, 5);
  for (const double x_mm : tool.position_mm) text += signedText(x_mm, kPositionScale_mm, 6);
  return text + signedText(tool.error_mm, kErrorScale_mm, 5);
}

constexpr unsigned char kBxValid = 1, kBxMissing = 2, kBxDisabled = 4;

template <class Number>
void appendNumber(std::string& bytes, Number number) {
  static_assert(std::endian::native == std::endian::little);
  std::array<char, sizeof(Number)> raw{};
  std::memcpy(raw.data(), &number, raw.size());
  bytes.append(raw.data(), raw.size());
}

/// Takes little-endian numbers from the front; once there are too few bytes, `good` is false.
class NdiBytes {
 public:
  explicit NdiBytes(std::string_view bytes) : rest_(bytes) {}
  template <class Number>
  Number take() {
    Number number{};
    good_ = good_ && rest_.size() >= sizeof(Number);
    if (!good_) return number;
    std::memcpy(&number, rest_.data(), sizeof(Number));
    rest_.remove_prefix(sizeof(Number));
    return number;
  }
  bool good() const { return good_; }
  bool ended() const { return good_ && rest_.empty(); }

 private:
  std::string_view rest_;
  bool good_ = true;
};

NdiTool readBinaryTool(NdiBytes& bytes) {
  NdiTool tool;
  tool.handle = bytes.take<std::uint8_t>();
  const auto state = bytes.take<std::uint8_t>();
  if (state != kBxValid && state != kBxMissing) {
    tool.state = state == kBxDisabled ? NdiState::kDisabled : NdiState::kUnoccupied;
    return tool;
  }
  if (state == kBxValid) {
    tool.state = NdiState::kValid;
    for (double& q : tool.quaternion_wxyz) q = static_cast<double>(bytes.take<float>());
    for (double& x_mm : tool.position_mm) x_mm = static_cast<double>(bytes.take<float>());
    tool.error_mm = static_cast<double>(bytes.take<float>());
  }
  tool.port_status = bytes.take<std::uint32_t>();
  tool.frame = bytes.take<std::uint32_t>();
  return tool;
}

constexpr int kCrcDigits = 4;
constexpr std::uint16_t kBxStart = 0xA5C4;

/// The text of a line whose CRC is right.
std::optional<std::string_view> checkedLine(std::string_view line) {
  if (line.size() < kCrcDigits) return std::nullopt;
  const std::string_view text = line.substr(0, line.size() - kCrcDigits);
  return line.substr(text.size()) == ndiHex(ndiCrc(text), kCrcDigits) ? std::optional(text) : std::nullopt;
}

}  // namespace

std::uint16_t ndiCrc(std::string_view bytes, std::uint16_t crc) {
  for (const char c : bytes) {
    crc = static_cast<std::uint16_t>(crc >> 8 ^ kNdiCrcTable[(crc ^ static_cast<unsigned char>(c)) & 0xFFu]);
  }
  return crc;
}

std::string ndiHex(unsigned value, int digits) {
  std::string text(static_cast<std::size_t>(digits), '0');
  for (auto digit = text.rbegin(); digit != text.rend(); ++digit, value >>= 4)
    *digit = "0123456789ABCDEF"[value & 0xFu];
  return text;
}

std::optional<unsigned> ndiNumber(std::string_view hex) {
  unsigned value = 0;
  const auto [end, error] = std::from_chars(hex.data(), hex.data() + hex.size(), value, 16);
  if (hex.empty() || error != std::errc() || end != hex.data() + hex.size()) return std::nullopt;
  return value;
}

std::string ndiCommand(std::string_view name, std::string_view arguments) {
  return encodeNdiReply(std::string(name) + ":" + std::string(arguments));
}

std::optional<char> ndiRateDigit(int baud) {
  for (const auto& [digit, rate] : kRateDigits) {
    if (rate == baud) return digit;
  }
  return std::nullopt;
}

int ndiRateOfDigit(char digit) {
  for (const auto& [known, rate] : kRateDigits) {
    if (known == digit) return rate;
  }
  return 0;
}

std::vector<int> ndiRates() {
  std::vector<int> rates;
  for (const auto& [digit, rate] : kRateDigits) rates.push_back(rate);
  return rates;
}

std::string encodeNdiReply(std::string_view text) { return std::string(text) + ndiHex(ndiCrc(text), 4) + "\r"; }

std::string ndiErrorText(int code) { return "ERROR" + ndiHex(static_cast<unsigned>(code), 2); }

std::optional<NdiReply> findNdiReply(std::string_view bytes) {
  constexpr std::string_view kError = "ERROR";
  while (true) {
    const std::size_t end = bytes.find('\r');
    if (end == std::string_view::npos) return std::nullopt;
    if (const auto text = checkedLine(bytes.substr(0, end))) {
      NdiReply reply{std::string(*text), std::nullopt};
      if (text->starts_with(kError) && text->size() == kError.size() + 2) {
        if (const auto code = ndiNumber(text->substr(kError.size()))) reply.error = static_cast<int>(*code);
      }
      return reply;
    }
    bytes.remove_prefix(end + 1);
  }
}

std::string ndiErrorMeaning(int code) {
  for (const auto& [known, text] : kNdiErrors) {
    if (known == code) return text;
  }
  return "error " + ndiHex(static_cast<unsigned>(code), 2) + ", which the manual does not list";
}

std::optional<std::vector<NdiHandle>> decodeNdiHandles(std::string_view text) {
  NdiColumns columns(text);
  std::vector<NdiHandle> handles(columns.hex(2));
  for (NdiHandle& handle : handles) {
    handle.handle = static_cast<int>(columns.hex(2));
    handle.status = columns.hex(3);
  }
  return columns.ended() ? std::optional(handles) : std::nullopt;
}

std::string encodeNdiHandles(std::span<const NdiHandle> handles) {
  std::string text = ndiHex(static_cast<unsigned>(handles.size()), 2);
  for (const NdiHandle& handle : handles) {
    text += ndiHex(static_cast<unsigned>(handle.handle), 2) + ndiHex(handle.status, 3);
  }
  return text;
}

std::optional<NdiToolInformation> decodeNdiToolInformation(std::string_view text) {
  NdiColumns columns(text);
  NdiToolInformation information;
  information.type = trimmed(columns.take(8));
  information.manufacturer = trimmed(columns.take(12));
  information.revision = trimmed(columns.take(3));
  information.serial = trimmed(columns.take(8));
  information.status = columns.hex(2);
  return columns.ended() ? std::optional(information) : std::nullopt;
}

std::string encodeNdiToolInformation(const NdiToolInformation& information) {
  const auto column = [](std::string text, std::size_t width) {
    text.resize(width, ' ');
    return text;
  };
  return column(information.type, 8) + column(information.manufacturer, 12) + column(information.revision, 3) +
         column(information.serial, 8) + ndiHex(information.status, 2);
}

std::string encodeNdiTx(const NdiFrame& frame) {
  constexpr std::size_t kTransform = 51;
  std::string text = ndiHex(static_cast<unsigned>(frame.tools.size()), 2);
  for (const NdiTool& tool : frame.tools) {
    text += ndiHex(static_cast<unsigned>(tool.handle), 2);
    if (tool.state == NdiState::kUnoccupied) {
      text += "UNOCCUPIED\n";
      continue;
    }
    const std::string transform = tool.state == NdiState::kValid ? transformText(tool) : "";
    text += tool.state == NdiState::kDisabled ? "DISABLED" : transform.size() == kTransform ? transform : "MISSING";
    text += ndiHex(tool.port_status, 8) + ndiHex(tool.frame, 8) + "\n";
  }
  return text + ndiHex(frame.system_status, 4);
}

std::optional<NdiFrame> decodeNdiTx(std::string_view text) {
  NdiColumns columns(text);
  NdiFrame frame;
  const unsigned tools = columns.hex(2);
  for (unsigned i = 0; i < tools && columns.good(); ++i) frame.tools.push_back(readTool(columns));
  frame.system_status = columns.hex(4);
  return columns.ended() ? std::optional(std::move(frame)) : std::nullopt;
}

std::string encodeNdiBx(const NdiFrame& frame) {
  std::string data(1, static_cast<char>(frame.tools.size()));
  for (const NdiTool& tool : frame.tools) {
    data += static_cast<char>(tool.handle);
    const bool valid = tool.state == NdiState::kValid;
    const bool seen = valid || tool.state == NdiState::kMissing;
    data += static_cast<char>(valid ? kBxValid : seen ? kBxMissing : kBxDisabled);
    if (!seen) continue;
    if (valid) {
      for (const double q : tool.quaternion_wxyz) appendNumber(data, static_cast<float>(q));
      for (const double x_mm : tool.position_mm) appendNumber(data, static_cast<float>(x_mm));
      appendNumber(data, static_cast<float>(tool.error_mm));
    }
    appendNumber(data, static_cast<std::uint32_t>(tool.port_status));
    appendNumber(data, tool.frame);
  }
  appendNumber(data, static_cast<std::uint16_t>(frame.system_status));
  std::string reply;
  appendNumber(reply, kBxStart);
  appendNumber(reply, static_cast<std::uint16_t>(data.size()));
  appendNumber(reply, ndiCrc(reply));
  reply += data;
  appendNumber(reply, ndiCrc(data));
  return reply;
}

std::optional<std::size_t> ndiBxLength(std::string_view bytes) {
  NdiBytes header(bytes.substr(0, kNdiBxHeader));
  const auto start = header.take<std::uint16_t>();
  const auto length = header.take<std::uint16_t>();
  const auto crc = header.take<std::uint16_t>();
  if (!header.good() || start != kBxStart || crc != ndiCrc(bytes.substr(0, kNdiBxHeader - sizeof crc)))
    return std::nullopt;
  return kNdiBxHeader + length + sizeof crc;
}

std::optional<NdiFrame> decodeNdiBx(std::string_view bytes) {
  const auto length = ndiBxLength(bytes);
  if (!length || *length != bytes.size()) return std::nullopt;
  const std::string_view data = bytes.substr(kNdiBxHeader, bytes.size() - kNdiBxHeader - sizeof(std::uint16_t));
  if (NdiBytes(bytes.substr(kNdiBxHeader + data.size())).take<std::uint16_t>() != ndiCrc(data)) return std::nullopt;
  NdiBytes content(data);
  NdiFrame frame;
  const auto tools = content.take<std::uint8_t>();
  for (int i = 0; i < tools && content.good(); ++i) frame.tools.push_back(readBinaryTool(content));
  frame.system_status = content.take<std::uint16_t>();
  return content.ended() ? std::optional(std::move(frame)) : std::nullopt;
}

std::string ndiSystemMeaning(unsigned status) {
  std::string text;
  for (const auto& [bit, words] : kSystemBits) {
    if ((status & bit) != 0) text += (text.empty() ? "" : "; ") + std::string(words);
  }
  return text;
}

std::string ndiSampleMeaning(const std::string& status) {
  if (status == kStatusMissing) return "the tool is not seen: out of the field or the view, or too fast";
  if (status == kStatusUnplugged) return "the tool is unplugged, or switched off; plug it in and connect again";
  if (status == kStatusOutOfVolume) return "out of the measuring volume (volume=any takes such readings)";
  if (status == kStatusPartlyOutOfVolume) return "partly out of the measuring volume (volume=any takes such readings)";
  if (status == kStatusErrorValue) return "the tracker's own error value is above the limit (max_error_mm)";
  return commonStatusMeaning(status);
}

Reading ndiReading(const NdiTool& tool, int sensor, double frame_hz, const NdiGate& gate) {
  std::string status;
  if (tool.state == NdiState::kMissing) status = kStatusMissing;
  if (tool.state == NdiState::kDisabled || tool.state == NdiState::kUnoccupied) status = kStatusUnplugged;
  Reading reading;
  if (tool.state != NdiState::kUnoccupied && tool.state != NdiState::kDisabled) reading.unit_s = tool.frame / frame_hz;
  PoseNumbers numbers;
  if (tool.state == NdiState::kValid) {
    if (gate.inside_volume && (tool.port_status & ndi_port::kOutOfVolume) != 0) {
      status = kStatusOutOfVolume;
    } else if (gate.inside_volume && (tool.port_status & ndi_port::kPartlyOutOfVolume) != 0) {
      status = kStatusPartlyOutOfVolume;
    } else if (gate.most_error_mm > 0.0 && !(std::abs(tool.error_mm) <= gate.most_error_mm)) {
      status = kStatusErrorValue;
    }
    numbers.position_m = tool.position_mm * kMPerMm;
    numbers.quaternion_wxyz = tool.quaternion_wxyz;
  }
  reading.sample = sampleOfNumbers(numbers, sensor, std::move(status));
  return reading;
}

void NdiParser::add(std::string_view bytes, std::vector<Reading>& out) {
  finder_.add(bytes,
              [&](std::string_view rest) { return settings_.binary ? matchBinary(rest, out) : matchText(rest, out); });
}

FrameMatch NdiParser::matchBinary(std::string_view rest, std::vector<Reading>& out) {
  constexpr std::string_view kStart = "\xC4\xA5";
  if (!rest.starts_with(kStart.substr(0, std::min(rest.size(), kStart.size())))) {
    // A refusal comes as text; nothing in it can be a reading.
    const std::size_t end = rest.find('\r');
    if (end != std::string_view::npos && checkedLine(rest.substr(0, end))) return FrameMatch::frame(end + 1);
    return FrameMatch::none();
  }
  if (rest.size() < kNdiBxHeader) return FrameMatch::more();
  const auto length = ndiBxLength(rest);
  if (!length) return FrameMatch::none();
  if (rest.size() < *length) return FrameMatch::more();
  // A byte may be missing in it: what follows is looked at byte by byte.
  return take(decodeNdiBx(rest.substr(0, *length)), out) ? FrameMatch::frame(*length) : FrameMatch::none();
}

FrameMatch NdiParser::matchText(std::string_view rest, std::vector<Reading>& out) {
  constexpr std::size_t kLongest = 4096;
  const std::size_t end = rest.find('\r');
  if (end == std::string_view::npos) return rest.size() < kLongest ? FrameMatch::more() : FrameMatch::none();
  const auto text = checkedLine(rest.substr(0, end));
  const bool is_error = text && text->starts_with("ERROR");
  if (!is_error) take(text ? decodeNdiTx(*text) : std::nullopt, out);
  return FrameMatch::frame(end + 1);
}

bool NdiParser::take(const std::optional<NdiFrame>& frame, std::vector<Reading>& out) {
  if (!frame) {
    ++damaged_;
    return false;
  }
  for (const NdiTool& tool : frame->tools) {
    const auto sensor = settings_.sensors.find(tool.handle);
    if (sensor == settings_.sensors.end()) continue;
    Reading reading = ndiReading(tool, sensor->second, settings_.frame_hz, settings_.gate);
    if (!reading.unit_s) {
      if (unplugged_.insert(tool.handle).second) out.push_back(std::move(reading));
      continue;
    }
    unplugged_.erase(tool.handle);
    const auto [last, first] = last_frame_.try_emplace(tool.handle, tool.frame);
    if (!first && std::exchange(last->second, tool.frame) == tool.frame) continue;
    out.push_back(std::move(reading));
  }
  return true;
}

std::vector<std::string> ndiWriteRom(int handle, std::string_view rom) {
  constexpr std::size_t kChunk = 64;
  std::vector<std::string> commands;
  for (std::size_t at = 0; at < rom.size(); at += kChunk) {
    std::string data = ndiHex(static_cast<unsigned>(handle), 2) + ndiHex(static_cast<unsigned>(at), 4);
    for (std::size_t i = at; i < at + kChunk; ++i) {
      data += ndiHex(i < rom.size() ? static_cast<unsigned char>(rom[i]) : 0u, 2);
    }
    commands.push_back(ndiCommand("PVWR", data));
  }
  return commands;
}

}  // namespace fieldtrue::acquisition
