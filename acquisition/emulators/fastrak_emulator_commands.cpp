#include <algorithm>

#include "acquisition/emulators/fastrak_emulator_core.h"
#include "acquisition/protocols/command_text.h"
#include "acquisition/protocols/plain_number.h"

namespace fieldtrue::acquisition {
namespace {

enum RefusalCode { kMissing = -1, kNotNumeric = -2, kOutOfRange = -3, kBufferFull = -5, kUnknown = -99 };

/// A setting that is nothing but numbers.
struct NumberSetting {
  char letter;
  bool of_station;
  bool length;  ///< In the unit of length, so that it is converted when the unit changes.
  int decimals;
  std::vector<double> defaults;
};

const std::vector<NumberSetting>& numberSettings() {
  static const std::vector<NumberSetting> kSettings = {
      {'H', true, false, 2, {1, 0, 0}},
      {'G', true, false, 2, {0, 0, 0}},
      {'A', true, true, 2, {0, 0, 0, 1, 0, 0, 0, 1, 0}},
      {'r', true, false, 2, {0, 0, 0}},
      {'N', true, true, 3, {0, 0, 0}},
      {'e', true, false, 0, {0}},
      {'I', true, true, 2, {0}},
      {'V', true, true, 2, {390, 390, 390, -390, -390, -390}},
      {'Q', true, false, 2, {180, 90, 180, -180, -90, -180}},
      {'v', false, false, 3, {0.2, 0.2, 0.8, 0.95}},
      {'x', false, false, 3, {0.2, 0.2, 0.8, 0.95}},
  };
  return kSettings;
}

const NumberSetting& numberSetting(char letter) {
  const auto& rows = numberSettings();
  const auto row = std::find_if(rows.begin(), rows.end(), [letter](const auto& s) { return s.letter == letter; });
  FT_CHECK(row != rows.end());
  return *row;
}

std::string column(double value, int decimals) { return fixedText(value, decimals, 7); }

/// The filter macros: 2 none, 3 low, 4 medium, 5 heavy.
std::optional<std::vector<double>> filterMacro(double level) {
  if (level == 2.0) return std::vector<double>{0, 1, 0, 0};
  if (level == 3.0) return std::vector<double>{0.2, 0.2, 0.8, 0.8};
  if (level == 4.0) return std::vector<double>{0.2, 0.2, 0.8, 0.95};
  if (level == 5.0) return std::vector<double>{0.05, 0.05, 0.8, 0.98};
  return std::nullopt;
}

}  // namespace

FastrakEmulatorCore::Setup FastrakEmulatorCore::factorySetup() const {
  Setup setup;
  setup.identity = options_.identity;
  for (int station = 1; station <= stations_; ++station) {
    const auto index = static_cast<std::size_t>(station - 1);
    setup.active[index] = plugged(station - 1);
    setup.items[index] = {2, 4, 1};
    for (const auto& row : numberSettings()) {
      if (row.of_station) setup.numbers[{row.letter, station}] = row.defaults;
    }
  }
  for (const auto& row : numberSettings()) {
    if (!row.of_station) setup.numbers[{row.letter, 0}] = row.defaults;
  }
  return setup;
}

const std::map<char, FastrakEmulatorCore::Handler>& FastrakEmulatorCore::handlers() {
  using Core = FastrakEmulatorCore;
  static const std::map<char, Handler> kHandlers = {
      {'P', &Core::sendPoint},
      {'S', &Core::sendStatus},
      {'C', &Core::setContinuous},
      {'c', &Core::setContinuous},
      {'F', &Core::setFlag},
      {'f', &Core::setFlag},
      {'U', &Core::setFlag},
      {'u', &Core::setFlag},
      {'D', &Core::setFlag},
      {'d', &Core::setFlag},
      {'O', &Core::setOutputList},
      {'l', &Core::setActive},
      {'B', &Core::setBoresight},
      {'b', &Core::setBoresight},
      {'R', &Core::resetAlignment},
      {'H', &Core::setNumbers},
      {'G', &Core::setNumbers},
      {'A', &Core::setNumbers},
      {'r', &Core::setNumbers},
      {'N', &Core::setNumbers},
      {'e', &Core::setNumbers},
      {'I', &Core::setNumbers},
      {'V', &Core::setNumbers},
      {'Q', &Core::setNumbers},
      {'v', &Core::setNumbers},
      {'x', &Core::setNumbers},
      {'X', &Core::setIdentity},
      {'W', &Core::restart},
      {kFastrakReinitialise, &Core::restart},
      {kFastrakSave, &Core::restart},
      {kFastrakXoff, &Core::flow},
      {kFastrakXon, &Core::flow},
      {'o', &Core::accept},
      {'y', &Core::accept},
      {'Y', &Core::accept},
      {'t', &Core::accept},
      {'T', &Core::accept},
  };
  return kHandlers;
}

void FastrakEmulatorCore::obey(const FastrakCommand& command, std::vector<EmulatedOutput>& out) {
  constexpr std::size_t kLongest = 254;
  if (command.text.size() >= kLongest) return refuse(command, kBufferFull, out);
  const auto handler = handlers().find(command.letter);
  const bool lacks = letters_it_lacks_.find(command.letter) != std::string::npos;
  if (lacks || handler == handlers().end()) return refuse(command, kUnknown, out);
  (this->*handler->second)(command, out);
}

void FastrakEmulatorCore::refuse(const FastrakCommand& command, int code, std::vector<EmulatedOutput>& out) const {
  constexpr std::size_t kEchoed = 40;
  out.push_back(
      {encodeRefusal({command.station.value_or(1), (command.letter + command.text).substr(0, kEchoed), code}), false});
}

std::optional<int> FastrakEmulatorCore::stationOf(const FastrakCommand& command,
                                                  std::vector<EmulatedOutput>& out) const {
  if (command.station && *command.station >= 1 && *command.station <= stations_) return command.station;
  refuse(command, command.station ? kOutOfRange : command.text.empty() ? kMissing : kNotNumeric, out);
  return std::nullopt;
}

void FastrakEmulatorCore::answerReadBack(char letter, int station, const std::string& text,
                                         std::vector<EmulatedOutput>& out) const {
  out.push_back({std::string{'2', static_cast<char>('0' + station), letter} + text + "\r\n", false});
}

void FastrakEmulatorCore::setFlag(const FastrakCommand& command, std::vector<EmulatedOutput>&) {
  switch (command.letter) {
    case 'F':
    case 'f':
      setup_.format = command.letter == 'f' ? FastrakFormat::kBinary : FastrakFormat::kAscii;
      break;
    case 'U':
    case 'u':
      changeUnit(command.letter == 'u' ? FastrakUnit::kCentimetre : FastrakUnit::kInch);
      break;
    default:
      setup_.compensation = command.letter == 'D';
  }
}

void FastrakEmulatorCore::changeUnit(FastrakUnit unit) {
  const double factor = metresPer(setup_.unit) / metresPer(unit);
  for (auto& [key, values] : setup_.numbers) {
    if (!numberSetting(key.first).length) continue;
    for (double& value : values) value *= factor;
  }
  setup_.unit = unit;
}

void FastrakEmulatorCore::sendPoint(const FastrakCommand&, std::vector<EmulatedOutput>& out) {
  send(source_->readNow(activeSensors(), now_s_), true, out);
}

void FastrakEmulatorCore::sendStatus(const FastrakCommand&, std::vector<EmulatedOutput>& out) {
  out.push_back({statusRecord(), false});
}

void FastrakEmulatorCore::setContinuous(const FastrakCommand& command, std::vector<EmulatedOutput>&) {
  const bool on = command.letter == 'C';
  if (on && !setup_.continuous) beginStream();
  setup_.continuous = on;
}

void FastrakEmulatorCore::setOutputList(const FastrakCommand& command, std::vector<EmulatedOutput>& out) {
  const auto station = stationOf(command, out);
  if (!station) return;
  auto& items = setup_.items[static_cast<std::size_t>(*station - 1)];
  if (command.fields.empty()) {
    std::string text;
    for (const int item : items) text += (item < 10 ? " " : "") + std::to_string(item);
    return answerReadBack('O', *station, text, out);
  }
  const auto wanted = changedList(items, command.fields, command, out);
  if (!wanted) return;
  if (!fastrakLayout(*wanted, FastrakFormat::kBinary)) return refuse(command, kOutOfRange, out);
  items = *wanted;
}

std::optional<std::vector<int>> FastrakEmulatorCore::changedList(std::vector<int> items,
                                                                 const std::vector<std::string>& fields,
                                                                 const FastrakCommand& command,
                                                                 std::vector<EmulatedOutput>& out) const {
  items.resize(std::max(fields.size(), fields.front().empty() ? items.size() : 0));
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (fields[i].empty()) continue;
    const auto number = fieldNumber(fields[i]);
    if (!number) {
      refuse(command, kNotNumeric, out);
      return std::nullopt;
    }
    items[i] = static_cast<int>(*number);
  }
  return items;
}

void FastrakEmulatorCore::refuseAsOutOfRange(const FastrakCommand& command, std::vector<EmulatedOutput>& out) const {
  refuse(command, kOutOfRange, out);
}

void FastrakEmulatorCore::setActive(const FastrakCommand& command, std::vector<EmulatedOutput>& out) {
  const auto station = stationOf(command, out);
  if (!station) return;
  if (command.fields.empty()) {
    std::string text;
    for (std::size_t i = 0; i < static_cast<std::size_t>(stations_); ++i) text += setup_.active[i] ? '1' : '0';
    return answerReadBack('l', *station, text, out);
  }
  const std::string& value = command.fields.front();
  if (value != "0" && value != "1") return refuse(command, kOutOfRange, out);
  const auto index = static_cast<std::size_t>(*station - 1);
  setup_.active[index] = value == "1" && plugged(*station - 1);
}

void FastrakEmulatorCore::setBoresight(const FastrakCommand& command, std::vector<EmulatedOutput>& out) {
  const auto station = stationOf(command, out);
  if (!station) return;
  auto& zero = setup_.boresight[static_cast<std::size_t>(*station - 1)];
  zero.reset();
  const int sensor = *station - 1;
  const auto readings = source_->readNow(std::span(&sensor, 1), now_s_);
  if (command.letter == 'B' && !readings.empty())
    zero = reported(*station, readings[0].tracker_from_sensor).orientation;
}

void FastrakEmulatorCore::resetAlignment(const FastrakCommand& command, std::vector<EmulatedOutput>& out) {
  const auto station = stationOf(command, out);
  if (!station) return;
  setup_.numbers[{'A', *station}] = numberSetting('A').defaults;
  setup_.tracker_from_aligned[static_cast<std::size_t>(*station - 1)] = Pose{};
}

void FastrakEmulatorCore::setNumbers(const FastrakCommand& command, std::vector<EmulatedOutput>& out) {
  const NumberSetting& row = numberSetting(command.letter);
  const auto station = row.of_station ? stationOf(command, out) : std::optional(0);
  if (!station) return;
  std::vector<double>& values = setup_.numbers[{row.letter, *station}];
  if (command.fields.empty()) {
    std::string text;
    for (const double value : values) text += column(value, row.decimals);
    return answerReadBack(row.letter, std::max(1, *station), text, out);
  }
  if (command.fields.size() > row.defaults.size()) return refuse(command, kOutOfRange, out);
  std::vector<double> wanted = values;
  for (std::size_t i = 0; i < command.fields.size(); ++i) {
    if (command.fields[i].empty()) continue;
    const auto number = fieldNumber(command.fields[i]);
    if (!number) return refuse(command, kNotNumeric, out);
    wanted[i] = *number;
  }
  if (!row.of_station && command.fields.size() == 1) wanted = filterMacro(wanted[0]).value_or(wanted);
  values = wanted;
  if (row.letter == 'A') realign(*station);
}

void FastrakEmulatorCore::realign(int station) {
  const std::vector<double>& v = numbers('A', station);
  const Eigen::Vector3d origin(v[0], v[1], v[2]);
  const Eigen::Vector3d x = Eigen::Vector3d(v[3], v[4], v[5]) - origin;
  const Eigen::Vector3d z = x.cross(Eigen::Vector3d(v[6], v[7], v[8]) - origin);
  if (x.norm() < 1e-9 || z.norm() < 1e-9) return;
  Eigen::Matrix3d axes;
  axes << x.normalized(), z.cross(x).normalized(), z.normalized();
  setup_.tracker_from_aligned[static_cast<std::size_t>(station - 1)] = {origin * metresPer(setup_.unit),
                                                                        Eigen::Quaterniond(axes)};
}

void FastrakEmulatorCore::setIdentity(const FastrakCommand& command, std::vector<EmulatedOutput>&) {
  setup_.identity = command.text.substr(0, 32);
}

void FastrakEmulatorCore::restart(const FastrakCommand& command, std::vector<EmulatedOutput>&) {
  if (command.letter == kFastrakSave) {
    saved_ = setup_;
    saved_.continuous = false;
    return;
  }
  setup_ = command.letter == 'W' ? factorySetup() : saved_;
  if (command.letter == kFastrakReinitialise) beginSilence();
  paused_ = false;
  memory_ = {};
}

void FastrakEmulatorCore::flow(const FastrakCommand& command, std::vector<EmulatedOutput>&) {
  paused_ = command.letter == kFastrakXoff;
}

}  // namespace fieldtrue::acquisition
