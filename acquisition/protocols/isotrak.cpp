#include "acquisition/protocols/isotrak.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "acquisition/protocols/little_endian.h"
#include "calib/core/trimmed.h"

namespace fieldtrue::acquisition {
namespace {

constexpr std::size_t kSevenBytes = 7;
constexpr std::size_t kIsotrakHeadBytes = 3;
constexpr unsigned char kHighestBit = 0x80;
constexpr char kIsotrakFirst = static_cast<char>('0' | kHighestBit);
constexpr char kStylusPressed = '@';
constexpr char kStylusReleased = '*';

bool hasHighestBit(char byte) { return (static_cast<unsigned char>(byte) & kHighestBit) != 0; }

/// What one count of an item's words is worth [m, deg, 1].
struct IsotrakScale {
  int item;
  double per_count;
};
constexpr IsotrakScale kIsotrakScales[] = {{2, kIsotrakStep_m}, {4, 180.0 / 32768.0}, {11, 1.0 / 32767.0}};

const IsotrakScale* isotrakScale(int item) {
  const auto found = std::find_if(std::begin(kIsotrakScales), std::end(kIsotrakScales),
                                  [item](const IsotrakScale& scale) { return scale.item == item; });
  return found == std::end(kIsotrakScales) ? nullptr : &*found;
}

bool isIsotrakMark(char c) {
  return c == ' ' || c == kStylusPressed || c == kStylusReleased || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

bool isIsotrakHead(std::string_view record) {
  return record.size() >= kIsotrakHeadBytes && record[0] == '0' && record[1] >= '1' &&
         record[1] < '1' + kIsotrakStations && isIsotrakMark(record[2]);
}

/// Builds with a stylus tell its button where others tell errors.
void takeMark(char mark, FastrakRecord& record) {
  const bool is_stylus = mark == kStylusPressed || mark == kStylusReleased;
  record.error = is_stylus ? ' ' : mark;
  if (is_stylus) record.stylus_pressed = mark == kStylusPressed;
}

Sample isotrakSample(const FastrakRecord& record) {
  return sampleOfNumbers(record, record.station - 1, record.error == ' ' ? std::string() : std::string(1, record.error),
                         kIsotrakUnitTolerance);
}

double wordAt(const char* bytes) { return static_cast<std::int16_t>(littleEndian16(bytes)); }

void appendWord(std::string& out, double counts) {
  const auto word = static_cast<std::int16_t>(std::clamp(std::round(counts), -32767.0, 32767.0));
  appendLittleEndian16(out, static_cast<std::uint16_t>(word));
}

}  // namespace

std::string isotrakPacked(std::string_view bytes) {
  std::string wire;
  for (std::size_t at = 0; at < bytes.size(); at += kSevenBytes) {
    const std::string_view group = bytes.substr(at, kSevenBytes);
    unsigned highest = 0;
    for (std::size_t i = 0; i < group.size(); ++i) {
      wire += static_cast<char>(group[i] & 0x7F);
      highest |= hasHighestBit(group[i]) ? 1u << i : 0u;
    }
    wire += static_cast<char>(highest);
  }
  if (!wire.empty()) wire[0] = static_cast<char>(wire[0] | kHighestBit);
  return wire;
}

std::optional<std::string> isotrakUnpacked(std::string_view wire) {
  if (wire.empty() || !hasHighestBit(wire[0]) || std::any_of(wire.begin() + 1, wire.end(), hasHighestBit))
    return std::nullopt;
  std::string bytes;
  for (std::size_t at = 0; at < wire.size(); at += kSevenBytes + 1) {
    const std::string_view group = wire.substr(at, kSevenBytes + 1);
    const unsigned highest = static_cast<unsigned char>(group.back());
    const std::size_t count = group.size() - 1;
    if (count == 0 || highest >> count != 0) return std::nullopt;
    for (std::size_t i = 0; i < count; ++i) {
      const unsigned low = static_cast<unsigned char>(group[i]) & 0x7Fu;
      bytes += static_cast<char>(low | ((highest >> i & 1u) != 0 ? kHighestBit : 0u));
    }
  }
  return bytes;
}

Result<std::size_t> isotrakRecordBytes(std::span<const int> items) {
  std::size_t bytes = kIsotrakHeadBytes;
  for (const int id : items) {
    const FastrakItem* item = findFastrakItem(id);
    if (!item || (item->literal.empty() && !isotrakScale(id))) {
      return fail(ErrorCode::kBadInput, "An Isotrak II has no known binary form of output item " + std::to_string(id) +
                                            "; known are 0, 1, 2, 4 and 11");
    }
    bytes += item->literal.size() + 2 * static_cast<std::size_t>(item->values);
  }
  return bytes + (bytes + kSevenBytes - 1) / kSevenBytes;
}

std::optional<FastrakRecord> decodeIsotrakRecord(std::string_view wire, std::span<const int> items) {
  const auto length = isotrakRecordBytes(items);
  if (!length || wire.size() != *length) return std::nullopt;
  const auto bytes = isotrakUnpacked(wire);
  if (!bytes || !isIsotrakHead(*bytes)) return std::nullopt;
  FastrakRecord record;
  record.station = (*bytes)[1] - '0';
  takeMark((*bytes)[2], record);
  std::size_t at = kIsotrakHeadBytes;
  for (const int id : items) {
    const FastrakItem& item = *findFastrakItem(id);
    if (bytes->compare(at, item.literal.size(), item.literal) != 0) return std::nullopt;
    at += item.literal.size();
    std::array<double, 4> values{};
    for (std::size_t i = 0; i < static_cast<std::size_t>(item.values); ++i, at += 2) {
      values[i] = wordAt(bytes->data() + at) * isotrakScale(id)->per_count;
    }
    if (item.store) item.store(record, values.data(), 1.0);
  }
  return record;
}

std::string encodeIsotrakRecord(const FastrakRecord& record, std::span<const int> items) {
  std::string bytes = {'0', static_cast<char>('0' + record.station), record.error};
  for (const int id : items) {
    const FastrakItem& item = *findFastrakItem(id);
    bytes += item.literal;
    std::array<double, 4> values{};
    if (item.load) item.load(record, values.data(), 1.0);
    for (std::size_t i = 0; i < static_cast<std::size_t>(item.values); ++i) {
      appendWord(bytes, values[i] / isotrakScale(id)->per_count);
    }
  }
  return isotrakPacked(bytes);
}

std::string encodeIsotrakStatus(int station, unsigned flags, const std::string& version) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "2%dS%03X         %-4.4s\r\n", station, flags & 0xFFFu, version.c_str());
  return text.data();
}

std::optional<IsotrakStatus> findIsotrakStatus(std::string_view bytes) {
  constexpr std::size_t kStatusLength = 21;
  const auto is_printable = [](char c) { return c >= ' ' && c < 0x7F; };
  for (std::size_t end = bytes.find("\r\n"); end != std::string_view::npos; end = bytes.find("\r\n", end + 1)) {
    if (end + 2 < kStatusLength) continue;
    const std::string_view record = bytes.substr(end + 2 - kStatusLength, kStatusLength - 2);
    if (record[0] != '2' || record[1] < '1' || record[1] > '2' || record[2] != 'S') continue;
    if (!std::all_of(record.begin(), record.end(), is_printable)) continue;
    IsotrakStatus status;
    status.text = trimmed(record.substr(3));
    const std::string last_word = status.text.substr(status.text.find_last_of(' ') + 1);
    if (last_word.find('.') != std::string::npos) status.version = last_word;
    return status;
  }
  return std::nullopt;
}

std::optional<unsigned> findIsotrakStations(std::string_view bytes) {
  const auto text = findReadBack(bytes, 'l', 1);
  if (!text || text->size() < static_cast<std::size_t>(kIsotrakStations)) return std::nullopt;
  unsigned on = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(kIsotrakStations); ++i) {
    if ((*text)[i] != '0' && (*text)[i] != '1') return std::nullopt;
    on |= (*text)[i] == '1' ? 1u << i : 0u;
  }
  return on;
}

std::string isotrakStatusMeaning(const std::string& status) {
  return status.size() == 1 ? manualErrorMeaning(status) : commonStatusMeaning(status);
}

Result<IsotrakParser> IsotrakParser::make(Settings settings) {
  if (settings.stations.empty()) return fail(ErrorCode::kBadInput, "No station is switched on; at least one is needed");
  IsotrakParser parser;
  if (settings.format == FastrakFormat::kAscii) {
    FastrakStreamSettings text;
    text.format = FastrakFormat::kAscii;
    text.unit = settings.unit;
    text.records_to_lock = settings.single ? 1 : 2;
    text.stylus_in_status = true;
    for (const int station : settings.stations) text.items.at(static_cast<std::size_t>(station - 1)) = settings.items;
    FT_TRY(parser.text_, FastrakParser::make(text));
  } else {
    FT_TRY(parser.record_bytes_, isotrakRecordBytes(settings.items));
  }
  parser.settings_ = std::move(settings);
  return parser;
}

void IsotrakParser::add(std::string_view bytes, std::vector<Reading>& out) {
  if (!text_) return finder_.add(bytes, [this, &out](std::string_view rest) { return match(rest, out); });
  std::vector<FastrakRecord> records;
  text_->add(bytes, records);
  for (FastrakRecord& record : records) {
    takeMark(record.error, record);
    out.push_back({isotrakSample(record), std::nullopt});
  }
}

FrameMatch IsotrakParser::match(std::string_view rest, std::vector<Reading>& out) {
  std::optional<FastrakRecord> record;
  const FrameMatch found = look(rest, record);
  if (!record) {
    locked_ = locked_ && found.kind == FrameMatch::Kind::kMore;
    return found;
  }
  if (!locked_ && !settings_.single) {
    // Believed once another begins behind it.
    if (rest.size() == record_bytes_) return FrameMatch::more();
    if (rest[record_bytes_] != kIsotrakFirst) return FrameMatch::none();
  }
  locked_ = true;
  out.push_back({isotrakSample(*record), std::nullopt});
  return found;
}

FrameMatch IsotrakParser::look(std::string_view rest, std::optional<FastrakRecord>& record) const {
  if (rest[0] != kIsotrakFirst) return FrameMatch::none();
  const std::string_view begun = rest.substr(1, record_bytes_ - 1);
  if (std::any_of(begun.begin(), begun.end(), hasHighestBit)) return FrameMatch::none();
  if (rest.size() < record_bytes_) return FrameMatch::more();
  record = decodeIsotrakRecord(rest.substr(0, record_bytes_), settings_.items);
  const auto& on = settings_.stations;
  if (record && std::find(on.begin(), on.end(), record->station) == on.end()) record.reset();
  return record ? FrameMatch::frame(record_bytes_) : FrameMatch::none();
}

bool looksLikeIsotrakStream(std::string_view bytes) {
  constexpr int kRecords = 6;
  int in_a_row = 0;
  std::size_t length = 0;
  const auto next = [bytes](std::size_t from) {
    while (from < bytes.size() && !hasHighestBit(bytes[from])) ++from;
    return from;
  };
  for (std::size_t at = next(0); at < bytes.size();) {
    const std::size_t end = next(at + 1);
    if (end == bytes.size()) return false;
    const auto record = isotrakUnpacked(bytes.substr(at, end - at));
    const bool fits = record && isIsotrakHead(*record) && record->size() > kIsotrakHeadBytes;
    in_a_row = !fits ? 0 : in_a_row > 0 && end - at == length ? in_a_row + 1 : 1;
    if (in_a_row == kRecords) return true;
    length = end - at;
    at = end;
  }
  return false;
}

namespace isotrak {

FastrakCommand outputList(std::span<const int> items) {
  FastrakCommand command{'O', std::nullopt, {}, {}};
  for (const int item : items) command.fields.push_back(std::to_string(item));
  return command;
}

}  // namespace isotrak
}  // namespace fieldtrue::acquisition
