#include "acquisition/protocols/liberty.h"

#include <algorithm>
#include <cctype>
#include <cstring>

#include "acquisition/protocols/command_text.h"
#include "acquisition/protocols/little_endian.h"
#include "acquisition/protocols/plain_number.h"
#include "calib/core/error.h"

namespace fieldtrue::acquisition {
namespace {

constexpr LibertyMake kLibertyMakes[] = {
    {"liberty", "Polhemus Liberty", "Liberty", "LY", 16, 240.0},
    {"patriot", "Polhemus Patriot", "Patriot", "PA", 2, 60.0},
};

Eigen::Vector3d vectorOf(const double* v) { return {v[0], v[1], v[2]}; }

void spread(const std::optional<Eigen::Vector3d>& from, double* to, double scale) {
  const Eigen::Vector3d v = from.value_or(Eigen::Vector3d::Zero()) / scale;
  std::copy(v.data(), v.data() + 3, to);
}

void storePlace(LibertyRecord& r, const double* v, double metres) { r.position_m = vectorOf(v) * metres; }
void loadPlace(const LibertyRecord& r, double* v, double metres) { spread(r.position_m, v, metres); }
void storeAngles(LibertyRecord& r, const double* v, double) { r.euler_deg = vectorOf(v); }
void loadAngles(const LibertyRecord& r, double* v, double) { spread(r.euler_deg, v, 1.0); }
void storeMatrix(LibertyRecord& r, const double* v, double) {
  for (std::size_t row = 0; row < 3; ++row) r.direction_cosines[row] = vectorOf(v + 3 * row);
}
void loadMatrix(const LibertyRecord& r, double* v, double) {
  for (std::size_t row = 0; row < 3; ++row) spread(r.direction_cosines[row], v + 3 * row, 1.0);
}
void storeTurn(LibertyRecord& r, const double* v, double) {
  r.quaternion_wxyz = Eigen::Vector4d(v[0], v[1], v[2], v[3]);
}
void loadTurn(const LibertyRecord& r, double* v, double) {
  const Eigen::Vector4d q = r.quaternion_wxyz.value_or(Eigen::Vector4d::Zero());
  std::copy(q.data(), q.data() + 4, v);
}
void storeTime(LibertyRecord& r, const double* v, double) { r.time_ms = static_cast<std::uint32_t>(v[0]); }
void loadTime(const LibertyRecord& r, double* v, double) { v[0] = r.time_ms; }
void storeFrame(LibertyRecord& r, const double* v, double) { r.frame = static_cast<std::uint32_t>(v[0]); }
void loadFrame(const LibertyRecord& r, double* v, double) { v[0] = r.frame; }
void storeStylusFlag(LibertyRecord& r, const double* v, double) { r.stylus = static_cast<std::uint32_t>(v[0]); }
void loadStylusFlag(const LibertyRecord& r, double* v, double) { v[0] = r.stylus; }
void storeDistortion(LibertyRecord& r, const double* v, double) {
  r.distortion = static_cast<std::int32_t>(static_cast<std::uint32_t>(v[0]));
}
void loadDistortion(const LibertyRecord& r, double* v, double) {
  v[0] = static_cast<double>(static_cast<std::uint32_t>(r.distortion));
}

/// The maker's list of data types: 3 and 5 are 2 and 4 with more digits in ASCII and the same in binary.
constexpr LibertyItem kLibertyItems[] = {
    {0, " ", 0, false, 0, nullptr, nullptr},
    {1, "\r\n", 0, false, 0, nullptr, nullptr},
    {2, {}, 3, false, 3, storePlace, loadPlace},
    {3, {}, 3, false, 6, storePlace, loadPlace},
    {4, {}, 3, false, 3, storeAngles, loadAngles},
    {5, {}, 3, false, 6, storeAngles, loadAngles},
    {6, {}, 9, false, 5, storeMatrix, loadMatrix},
    {7, {}, 4, false, 5, storeTurn, loadTurn},
    {8, {}, 1, true, 0, storeTime, loadTime},
    {9, {}, 1, true, 0, storeFrame, loadFrame},
    {10, {}, 1, true, 0, storeStylusFlag, loadStylusFlag},
    {11, {}, 1, true, 0, storeDistortion, loadDistortion},
};

const LibertyItem* findLibertyItem(int id) {
  const auto found = std::find_if(std::begin(kLibertyItems), std::end(kLibertyItems),
                                  [id](const LibertyItem& item) { return item.id == id; });
  return found == std::end(kLibertyItems) ? nullptr : &*found;
}

bool isTag(std::string_view tag) {
  return std::any_of(std::begin(kLibertyMakes), std::end(kLibertyMakes),
                     [tag](const LibertyMake& make) { return make.tag == tag; });
}

bool isRecordCommand(char command) { return command == 'C' || command == 'P' || command == 'c' || command == 'p'; }

/// The frame at the beginning of the bytes, where all of it is there.
std::optional<LibertyFrame> frameAt(std::string_view bytes) {
  if (bytes.size() < kLibertyHeaderBytes || !isTag(bytes.substr(0, 2))) return std::nullopt;
  const std::size_t payload = littleEndian16(bytes.data() + 6);
  if (bytes.size() < kLibertyHeaderBytes + payload) return std::nullopt;
  return LibertyFrame{std::string(bytes.substr(0, 2)), static_cast<unsigned char>(bytes[2]), bytes[3], bytes[4],
                      std::string(bytes.substr(kLibertyHeaderBytes, payload))};
}

bool isGood(char error) { return error == ' ' || error == '\0'; }

template <class Accept>
std::optional<LibertyFrame> findFrame(std::string_view bytes, Accept accept) {
  for (std::size_t at = 0; at + kLibertyHeaderBytes <= bytes.size(); ++at) {
    auto frame = frameAt(bytes.substr(at));
    if (frame && accept(*frame)) return frame;
  }
  return std::nullopt;
}

std::string atStation(const std::string& letter, const std::string& station, const std::vector<std::string>& fields) {
  std::vector<std::string> all = fields;
  all.insert(all.begin(), station);
  return letter + joinedByCommas(all) + '\r';
}

}  // namespace

std::span<const LibertyMake> libertyMakes() { return kLibertyMakes; }
std::span<const LibertyItem> libertyItems() { return kLibertyItems; }

const LibertyMake& libertyMake(std::string_view id) {
  const auto found = std::find_if(std::begin(kLibertyMakes), std::end(kLibertyMakes),
                                  [id](const LibertyMake& make) { return make.id == id; });
  FT_CHECK(found != std::end(kLibertyMakes));
  return *found;
}

std::string encode(const LibertyFrame& frame) {
  std::string out = frame.tag;
  out += static_cast<char>(frame.station);
  out += frame.command;
  out += frame.error;
  out += '\0';
  appendLittleEndian16(out, static_cast<std::uint16_t>(frame.payload.size()));
  return out + frame.payload;
}

std::optional<LibertyFrame> findLibertyFrame(std::string_view bytes, char command) {
  return findFrame(bytes, [command](const LibertyFrame& frame) { return frame.command == command; });
}

std::optional<LibertyFrame> findLibertyRefusal(std::string_view bytes) {
  return findFrame(bytes, [](const LibertyFrame& frame) {
    return !isGood(frame.error) && !isRecordCommand(frame.command) && frame.payload.size() < 256;
  });
}

std::string libertyIdentity(const LibertyFrame& who) {
  std::string text;
  bool is_new_line = false;
  for (const char c : who.payload) {
    const bool printable = static_cast<unsigned char>(c) >= 0x20 && static_cast<unsigned char>(c) < 0x7F;
    is_new_line = is_new_line || c == '\r' || c == '\n';
    if (!printable || (text.empty() && c == ' ')) continue;
    if (is_new_line && !text.empty()) text += ", ";
    is_new_line = false;
    text += c;
  }
  return text.erase(text.find_last_not_of(' ') + 1);
}

std::optional<unsigned> libertyPlugged(const LibertyFrame& answer) {
  if (answer.payload.size() < 2) return std::nullopt;
  return littleEndian16(answer.payload.data());
}

Result<std::size_t> libertyPayloadBytes(std::span<const int> items) {
  std::size_t bytes = 0;
  for (const int id : items) {
    const LibertyItem* item = findLibertyItem(id);
    if (!item) return fail(ErrorCode::kBadInput, "A Liberty has no output item " + std::to_string(id));
    bytes += item->literal.size() + 4 * static_cast<std::size_t>(item->values);
  }
  return bytes;
}

std::optional<LibertyRecord> decodeLibertyRecord(const LibertyFrame& frame, std::span<const int> items,
                                                 double metres_per_unit) {
  const auto bytes = libertyPayloadBytes(items);
  if (!bytes || frame.payload.size() != *bytes) return std::nullopt;
  LibertyRecord record;
  record.station = frame.station;
  record.error = frame.error;
  const char* at = frame.payload.data();
  for (const int id : items) {
    const LibertyItem& item = *findLibertyItem(id);
    if (!item.literal.empty() && std::memcmp(at, item.literal.data(), item.literal.size()) != 0) return std::nullopt;
    at += item.literal.size();
    std::array<double, 9> values{};
    for (std::size_t i = 0; i < static_cast<std::size_t>(item.values); ++i, at += 4) {
      values[i] = item.whole ? littleEndian32(at) : littleEndianFloat(at);
    }
    if (item.store) item.store(record, values.data(), metres_per_unit);
  }
  return record;
}

std::string encodeLibertyPayload(const LibertyRecord& record, std::span<const int> items, double metres_per_unit) {
  std::string out;
  for (const int id : items) {
    const LibertyItem& item = *findLibertyItem(id);
    out += item.literal;
    std::array<double, 9> values{};
    if (item.load) item.load(record, values.data(), metres_per_unit);
    for (std::size_t i = 0; i < static_cast<std::size_t>(item.values); ++i) {
      if (item.whole) {
        appendLittleEndian32(out, static_cast<std::uint32_t>(values[i]));
      } else {
        appendLittleEndianFloat(out, values[i]);
      }
    }
  }
  return out;
}

std::string encodeLibertyText(const LibertyRecord& record, std::span<const int> items, double metres_per_unit) {
  constexpr int kColumns = 9;
  std::string out = (record.station < 10 ? "0" : "") + std::to_string(record.station);
  out += record.error;
  out += ' ';
  for (const int id : items) {
    const LibertyItem& item = *findLibertyItem(id);
    out += item.literal;
    std::array<double, 9> values{};
    if (item.load) item.load(record, values.data(), metres_per_unit);
    for (std::size_t i = 0; i < static_cast<std::size_t>(item.values); ++i) {
      out += fixedText(values[i], item.decimals, item.decimals > 5 ? kColumns + 3 : kColumns);
    }
  }
  return out;
}

std::string libertyStatusMeaning(const std::string& status) {
  return status.size() == 1 ? manualErrorMeaning(status) : commonStatusMeaning(status);
}

Result<LibertyParser> LibertyParser::make(Settings settings) {
  if (settings.stations.empty()) return fail(ErrorCode::kBadInput, "No station is switched on; at least one is needed");
  FT_CHECK(isTag(settings.tag));
  LibertyParser parser;
  FT_TRY(parser.payload_, libertyPayloadBytes(settings.items));
  parser.settings_ = std::move(settings);
  return parser;
}

FrameMatch LibertyParser::match(std::string_view rest, std::vector<Reading>& out) const {
  const std::string_view begun = rest.substr(0, 2);
  if (!std::string_view(settings_.tag).starts_with(begun)) return FrameMatch::none();
  if (rest.size() < kLibertyHeaderBytes) return FrameMatch::more();
  const int station = static_cast<unsigned char>(rest[2]);
  const auto& on = settings_.stations;
  if (!isRecordCommand(rest[3]) || std::find(on.begin(), on.end(), station) == on.end()) return FrameMatch::none();
  if (littleEndian16(rest.data() + 6) != payload_) return FrameMatch::none();
  const std::size_t length = kLibertyHeaderBytes + payload_;
  if (rest.size() < length) return FrameMatch::more();
  const auto frame = frameAt(rest);
  const auto record = frame ? decodeLibertyRecord(*frame, settings_.items, settings_.metres_per_unit) : std::nullopt;
  if (!record) return FrameMatch::none();
  Reading reading;
  reading.sample =
      sampleOfNumbers(*record, station - 1, isGood(record->error) ? std::string() : std::string(1, record->error));
  if (std::find(settings_.items.begin(), settings_.items.end(), 8) != settings_.items.end()) {
    reading.unit_s = record->time_ms * 1e-3;
  }
  out.push_back(std::move(reading));
  return FrameMatch::frame(length);
}

void LibertyParser::add(std::string_view bytes, std::vector<Reading>& out) {
  finder_.add(bytes, [this, &out](std::string_view rest) { return match(rest, out); });
}

void LibertyCommandReader::add(std::string_view bytes, std::vector<LibertyCommand>& out) {
  constexpr std::size_t kLongestLine = 256;
  const auto flush = [&] {
    if (line_.empty()) return;
    LibertyCommand command;
    command.letter = static_cast<char>(std::toupper(static_cast<unsigned char>(line_[0])));
    if (line_.size() > 1) command.fields = splitAtCommas(std::string_view(line_).substr(1));
    out.push_back(std::move(command));
    line_.clear();
  };
  for (const char c : bytes) {
    if (c == '\r' || c == '\n') {
      flush();
    } else if (line_.empty() && (c == 'P' || c == 'p')) {
      out.push_back({'P', {}});
    } else if (!line_.empty() || c != ' ') {
      line_ += c;
      if (line_.size() >= kLongestLine) flush();
    }
  }
}

namespace liberty {

std::string point() { return "P"; }
std::string continuous() { return "C\r"; }
std::string binary(bool on) { return on ? "F1\r" : "F0\r"; }
std::string centimetres(bool on) { return on ? "U1\r" : "U0\r"; }
std::string who() { return std::string(1, kLibertyWho) + "\r"; }
std::string stations() { return std::string(1, kLibertyStations) + "0\r"; }
std::string stationActive(int station, bool on) {
  return atStation(std::string(1, kLibertyStations), std::to_string(station), {on ? "1" : "0"});
}
std::string reinitialise() { return std::string(1, kLibertyReinitialise) + "\r"; }
std::string outputList(std::span<const int> items) {
  std::vector<std::string> fields;
  for (const int item : items) fields.push_back(std::to_string(item));
  return atStation("O", "*", fields);
}
std::string hemisphere(int station, const Eigen::Vector3d& towards) {
  return atStation("H", std::to_string(station), commandNumbers({towards}));
}
std::string resetAlignment() { return "R*\r"; }
std::string unBoresight() { return std::string(1, kLibertyUnBoresight) + "*\r"; }
std::string resetTime() { return "Q0\r"; }
std::string filter(char letter, const std::array<double, 4>& values) {
  FT_CHECK(letter == 'X' || letter == 'Y');
  std::vector<std::string> fields;
  for (const double value : values) fields.push_back(commandNumber(value));
  return letter + joinedByCommas(fields) + '\r';
}

}  // namespace liberty
}  // namespace fieldtrue::acquisition
