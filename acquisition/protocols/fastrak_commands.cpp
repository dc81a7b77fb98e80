#include "acquisition/protocols/fastrak_commands.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "acquisition/protocols/command_text.h"

namespace fieldtrue::acquisition {
namespace {

using enum FastrakGrammar;

constexpr FastrakCommandKind kKinds[] = {
    {'P', kAtOnce, "one record of each active station"},
    {'C', kAtOnce, "continuous output on"},
    {'c', kAtOnce, "continuous output off"},
    {'F', kAtOnce, "ASCII output"},
    {'f', kAtOnce, "binary output"},
    {'U', kAtOnce, "inches"},
    {'u', kAtOnce, "centimetres"},
    {'S', kAtOnce, "status record"},
    {'D', kAtOnce, "fixed metal compensation on"},
    {'d', kAtOnce, "fixed metal compensation off"},
    {'T', kAtOnce, "built-in test"},
    {'Y', kAtOnce, "external synchronisation"},
    {'t', kAtOnce, "external synchronisation"},
    {'W', kAtOnce, "factory defaults"},
    {kFastrakReinitialise, kAtOnce, "re-initialise"},
    {kFastrakSave, kAtOnce, "save to EEPROM"},
    {kFastrakXoff, kAtOnce, "pause output"},
    {kFastrakXon, kAtOnce, "resume output"},
    {'O', kStation, "output list"},
    {'l', kStation, "station on or off"},
    {'H', kStation, "hemisphere"},
    {'B', kStation, "boresight"},
    {'b', kStation, "un-boresight"},
    {'G', kStation, "boresight reference"},
    {'A', kStation, "alignment frame"},
    {'R', kStation, "reset alignment"},
    {'r', kStation, "transmitter mounting frame"},
    {'N', kStation, "stylus tip offset"},
    {'e', kStation, "stylus button"},
    {'I', kStation, "increment"},
    {'V', kStation, "position envelope"},
    {'Q', kStation, "angular envelope"},
    {'v', kFields, "attitude filter"},
    {'x', kFields, "position filter"},
    {'o', kFields, "line rate"},
    {'y', kFields, "synchronisation mode"},
    {'X', kFreeText, "identification"},
};

FastrakCommand atOnce(char letter) { return {letter, std::nullopt, {}, {}}; }

FastrakCommand forStation(char letter, int station, std::vector<std::string> fields = {}) {
  FT_CHECK(station >= 1 && station <= kFastrakStations);
  return {letter, station, std::move(fields), {}};
}

FastrakCommand withFields(char letter, std::vector<std::string> fields) {
  return {letter, std::nullopt, std::move(fields), {}};
}

FastrakCommand commandOfLine(std::string_view line) {
  FastrakCommand command;
  command.letter = line[0];
  command.text = std::string(line.substr(1));
  const FastrakCommandKind* kind = findFastrakCommand(command.letter);
  if (!kind || kind->grammar == kAtOnce) return command;
  if (kind->grammar == kFreeText) {
    command.fields = {command.text};
    return command;
  }
  if (command.text.empty()) return command;
  command.fields = splitAtCommas(command.text);
  const std::string& first = command.fields.front();
  if (kind->grammar == kStation && first.size() == 1 && first[0] >= '0' && first[0] <= '9') {
    command.station = first[0] - '0';
    command.fields.erase(command.fields.begin());
  }
  return command;
}

}  // namespace

std::span<const FastrakCommandKind> fastrakCommandKinds() { return kKinds; }

const FastrakCommandKind* findFastrakCommand(char letter) {
  const auto found =
      std::find_if(std::begin(kKinds), std::end(kKinds), [letter](const auto& kind) { return kind.letter == letter; });
  return found == std::end(kKinds) ? nullptr : &*found;
}

std::string encode(const FastrakCommand& command) {
  const FastrakCommandKind* kind = findFastrakCommand(command.letter);
  FT_CHECK(kind != nullptr);
  std::string out(1, command.letter);
  if (kind->grammar == kAtOnce) return out;
  if (command.station) out += static_cast<char>('0' + *command.station);
  if (command.station && !command.fields.empty()) out += ',';
  out += joinedByCommas(command.fields);
  return out + '\r';
}

void FastrakCommandReader::add(std::string_view bytes, std::vector<FastrakCommand>& out) {
  constexpr std::size_t kLongestLine = 256;
  const auto flush = [&] {
    if (!line_.empty()) out.push_back(commandOfLine(line_));
    line_.clear();
  };
  for (const char c : bytes) {
    const bool control = c == kFastrakReinitialise || c == kFastrakSave || c == kFastrakXoff || c == kFastrakXon;
    if (c == '\r' || c == '\n') {
      flush();
    } else if (control) {
      if (c == kFastrakReinitialise) line_.clear();
      out.push_back(atOnce(c));
    } else if (line_.empty() && c == ' ') {
      continue;
    } else if (const auto* kind = findFastrakCommand(c); line_.empty() && kind && kind->grammar == kAtOnce) {
      out.push_back(atOnce(c));
    } else {
      line_ += c;
      if (line_.size() >= kLongestLine) flush();
    }
  }
}

namespace fastrak {

FastrakCommand point() { return atOnce('P'); }
FastrakCommand continuous(bool on) { return atOnce(on ? 'C' : 'c'); }
FastrakCommand format(FastrakFormat format) { return atOnce(format == FastrakFormat::kAscii ? 'F' : 'f'); }
FastrakCommand units(FastrakUnit unit) { return atOnce(unit == FastrakUnit::kInch ? 'U' : 'u'); }
FastrakCommand status() { return atOnce('S'); }
FastrakCommand compensation(bool on) { return atOnce(on ? 'D' : 'd'); }
FastrakCommand reinitialise() { return atOnce(kFastrakReinitialise); }
FastrakCommand saveToMemory() { return atOnce(kFastrakSave); }
FastrakCommand factoryDefaults() { return atOnce('W'); }
FastrakCommand pauseOutput() { return atOnce(kFastrakXoff); }
FastrakCommand resumeOutput() { return atOnce(kFastrakXon); }
FastrakCommand selfTest() { return atOnce('T'); }

FastrakCommand outputList(int station, std::span<const int> items) {
  std::vector<std::string> fields;
  for (const int item : items) fields.push_back(std::to_string(item));
  return forStation('O', station, std::move(fields));
}
FastrakCommand stationActive(int station, bool on) { return forStation('l', station, {on ? "1" : "0"}); }
FastrakCommand hemisphere(int station, const Eigen::Vector3d& towards) {
  return forStation('H', station, commandNumbers({towards}));
}
FastrakCommand boresight(int station) { return forStation('B', station); }
FastrakCommand unBoresight(int station) { return forStation('b', station); }
FastrakCommand boresightReference(int station, const Eigen::Vector3d& azimuth_elevation_roll_deg) {
  return forStation('G', station, commandNumbers({azimuth_elevation_roll_deg}));
}
FastrakCommand alignment(int station, const Eigen::Vector3d& origin, const Eigen::Vector3d& on_x,
                         const Eigen::Vector3d& on_y) {
  return forStation('A', station, commandNumbers({origin, on_x, on_y}));
}
FastrakCommand resetAlignment(int station) { return forStation('R', station); }
FastrakCommand transmitterMounting(int station, const Eigen::Vector3d& azimuth_elevation_roll_deg) {
  return forStation('r', station, commandNumbers({azimuth_elevation_roll_deg}));
}
FastrakCommand tipOffset(int station, const Eigen::Vector3d& tip) {
  return forStation('N', station, commandNumbers({tip}));
}
FastrakCommand stylusButton(int station, bool point_mode) { return forStation('e', station, {point_mode ? "1" : "0"}); }
FastrakCommand increment(int station, double distance) { return forStation('I', station, {commandNumber(distance)}); }
FastrakCommand positionEnvelope(int station, const Eigen::Vector3d& max, const Eigen::Vector3d& min) {
  return forStation('V', station, commandNumbers({max, min}));
}
FastrakCommand angularEnvelope(int station, const Eigen::Vector3d& max_deg, const Eigen::Vector3d& min_deg) {
  return forStation('Q', station, commandNumbers({max_deg, min_deg}));
}

namespace {
FastrakCommand filter(char letter, const Filter& f) {
  return withFields(letter, {commandNumber(f.f), commandNumber(f.low), commandNumber(f.high), commandNumber(f.factor)});
}
FastrakCommand macro(char letter, int level) {
  FT_CHECK(level >= 2 && level <= 5);
  return withFields(letter, {std::to_string(level)});
}
}  // namespace

FastrakCommand attitudeFilter(const Filter& f) { return filter('v', f); }
FastrakCommand positionFilter(const Filter& f) { return filter('x', f); }
FastrakCommand attitudeFilterOff() { return withFields('v', {"", "1"}); }
FastrakCommand positionFilterOff() { return withFields('x', {"", "1"}); }
FastrakCommand attitudeFilterMacro(int level) { return macro('v', level); }
FastrakCommand positionFilterMacro(int level) { return macro('x', level); }

FastrakCommand identification(std::string_view text) {
  return {'X', std::nullopt, {std::string(text.substr(0, 32))}, {}};
}

FastrakCommand lineRate(int baud, char parity, int bits, bool hardware_handshake) {
  constexpr std::array kRates = {2400, 4800, 9600, 19200, 38400, 57600, 115200};
  FT_CHECK(std::find(kRates.begin(), kRates.end(), baud) != kRates.end());
  return withFields(
      'o', {std::to_string(baud / 100), std::string(1, parity), std::to_string(bits), hardware_handshake ? "1" : "0"});
}

FastrakCommand readBack(char letter, int station) { return forStation(letter, station); }

}  // namespace fastrak
}  // namespace fieldtrue::acquisition
