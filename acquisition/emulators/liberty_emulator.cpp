#include "acquisition/emulators/liberty_emulator.h"

#include <cmath>

#include "acquisition/protocols/command_text.h"
#include "acquisition/protocols/little_endian.h"
#include "acquisition/protocols/plain_number.h"
#include "calib/core/units.h"

namespace fieldtrue::acquisition {
namespace {

constexpr std::size_t kWhoTextBytes = 196;  ///< In the ASCII format, as stock clients read it.

/// Bit 0 = station 1, as the answer to ^U has it.
std::uint16_t stationBits(const std::vector<int>& sensors) {
  unsigned bits = 0;
  for (const int sensor : sensors) bits |= 1u << sensor;
  return static_cast<std::uint16_t>(bits);
}

std::string floats(const std::vector<double>& values) {
  std::string out;
  for (const double value : values) appendLittleEndianFloat(out, value);
  return out;
}

std::string columns(const std::vector<double>& values) {
  std::string out;
  for (const double value : values) out += fixedText(value, 3, 9);
  return out;
}

Result<std::unique_ptr<EmulatorRunner>> makeOf(const Emulation& emulation, const LibertyMake& make) {
  return makeEmulator<LibertyEmulator>(emulation, {make.name, make.most_stations, make.rate_hz},
                                       LibertyEmulatorOptions(make));
}

}  // namespace

LibertyEmulator::LibertyEmulator(std::unique_ptr<PoseSource> source, const LibertyEmulatorOptions& options)
    : EmulatedUnit(std::move(source), options), make_(*options.make) {
  setup_ = factorySetup();
  continuous_ = options_.faults.already_streaming;
  if (continuous_) record_command_ = 'C';
}

LibertyEmulator::Setup LibertyEmulator::factorySetup() const {
  Setup setup;
  for (int station = 1; station <= make_.most_stations; ++station) {
    if (plugged(station - 1)) setup.stations[station].active = true;
  }
  return setup;
}

const std::map<char, LibertyEmulator::Handler>& LibertyEmulator::handlers() {
  using Unit = LibertyEmulator;
  static const std::map<char, Handler> kHandlers = {
      {'F', &Unit::setFormat},
      {'U', &Unit::setUnits},
      {'P', &Unit::sendPoint},
      {'C', &Unit::sendContinuously},
      {kLibertyWho, &Unit::tellWho},
      {kLibertyStations, &Unit::stationState},
      {'O', &Unit::setOutput},
      {'H', &Unit::setHemisphere},
      {'N', &Unit::setTip},
      {'A', &Unit::setAlignment},
      {'R', &Unit::resetAlignment},
      {'B', &Unit::setBoresight},
      {kLibertyUnBoresight, &Unit::resetBoresight},
      {'X', &Unit::setFilter},
      {'Y', &Unit::setFilter},
      {'Q', &Unit::resetCounters},
      {kLibertyReinitialise, &Unit::restart},
      {'I', &Unit::accept},
      {'L', &Unit::accept},
      {'T', &Unit::accept},
  };
  return kHandlers;
}

void LibertyEmulator::hear(std::string_view bytes, Out& out) {
  std::vector<LibertyCommand> commands;
  reader_.add(bytes, commands);
  for (const LibertyCommand& command : commands) {
    obey(command, out);
    if (silent()) return;
  }
}

void LibertyEmulator::obey(const LibertyCommand& command, Out& out) {
  const auto handler = handlers().find(command.letter);
  if (handler == handlers().end()) return refuse(command, "Invalid Command", out);
  (this->*handler->second)(command, out);
}

void LibertyEmulator::reply(char command, int station, const std::string& binary, const std::string& text,
                            Out& out) const {
  if (setup_.binary) return answer(encode(LibertyFrame{std::string(make_.tag), station, command, ' ', binary}), out);
  const char shown = command < ' ' ? static_cast<char>(command + 0x60) : command;
  answer((station < 10 ? "0" : "") + std::to_string(station) + shown + "  " + text + "\r\n", out);
}

void LibertyEmulator::refuse(const LibertyCommand& command, const std::string& why, Out& out) const {
  const std::string text = "*ERROR* " + why + "\r\n";
  if (setup_.binary) return answer(encode(LibertyFrame{std::string(make_.tag), 0, command.letter, 'a', text}), out);
  answer("00" + std::string(1, command.letter) + "a " + text, out);
}

std::vector<int> LibertyEmulator::stationsOf(const LibertyCommand& command, Out& out) const {
  std::vector<int> stations;
  const std::string name = command.fields.empty() ? "" : command.fields.front();
  const auto number = fieldNumber(name);
  for (const auto& [station, unused] : setup_.stations) {
    if (name == "*" || (number && *number == station)) stations.push_back(station);
  }
  if (stations.empty()) refuse(command, "Invalid Station", out);
  return stations;
}

std::optional<std::vector<double>> LibertyEmulator::numbersOf(const LibertyCommand& command, std::size_t skipped,
                                                              Out& out) const {
  std::vector<double> numbers;
  for (std::size_t i = skipped; i < command.fields.size(); ++i) {
    const auto number = fieldNumber(command.fields[i]);
    if (!number) {
      refuse(command, "Invalid Parameter", out);
      return std::nullopt;
    }
    numbers.push_back(*number);
  }
  return numbers;
}

void LibertyEmulator::setFormat(const LibertyCommand& command, Out& out) {
  const auto numbers = numbersOf(command, 0, out);
  if (!numbers) return;
  if (numbers->size() != 1 || (numbers->front() != 0.0 && numbers->front() != 1.0)) {
    return refuse(command, "Invalid Parameter", out);
  }
  setup_.binary = numbers->front() == 1.0;
}

void LibertyEmulator::setUnits(const LibertyCommand& command, Out& out) {
  const auto numbers = numbersOf(command, 0, out);
  if (!numbers) return;
  if (numbers->size() != 1 || (numbers->front() != 0.0 && numbers->front() != 1.0)) {
    return refuse(command, "Invalid Parameter", out);
  }
  const double before = metresPerUnit();
  setup_.metric = numbers->front() == 1.0;
  for (auto& [station, setup] : setup_.stations) setup.tip *= before / metresPerUnit();
}

void LibertyEmulator::sendPoint(const LibertyCommand&, Out& out) {
  if (continuous_) {
    continuous_ = false;
    return;
  }
  record_command_ = 'P';
  send(source_->readNow(activeSensors(), now_s_), true, out);
}

void LibertyEmulator::sendContinuously(const LibertyCommand&, Out&) {
  if (!continuous_) beginStream();
  record_command_ = 'C';
  continuous_ = true;
}

void LibertyEmulator::tellWho(const LibertyCommand&, Out& out) {
  std::string text = options_.identity + "\r\nversion " + options_.version + "\r\n" + std::to_string(make_.rate_hz) +
                     " Hz, " + std::to_string(make_.most_stations) + " stations\r\n";
  if (setup_.binary) {
    std::string head(8, '\0');
    head[0] = static_cast<char>(make_.most_stations);
    return answer(encode(LibertyFrame{std::string(make_.tag), 0, kLibertyWho, ' ', head + text}), out);
  }
  text = "00v  " + text;
  text.resize(kWhoTextBytes - 2, ' ');
  answer(text + "\r\n", out);
}

void LibertyEmulator::stationState(const LibertyCommand& command, Out& out) {
  if (command.fields.size() >= 2) {
    const auto numbers = numbersOf(command, 1, out);
    if (!numbers) return;
    for (const int station : stationsOf(command, out)) stationSetup(station).active = numbers->front() != 0.0;
    return;
  }
  std::vector<int> there;
  for (const auto& [station, unused] : setup_.stations) there.push_back(station - 1);
  std::string binary;
  appendLittleEndian16(binary, stationBits(there));
  appendLittleEndian16(binary, stationBits(activeSensors()));
  reply(kLibertyStations, 0, binary,
        std::to_string(stationBits(there)) + "," + std::to_string(stationBits(activeSensors())), out);
}

void LibertyEmulator::setOutput(const LibertyCommand& command, Out& out) {
  const auto numbers = numbersOf(command, 1, out);
  if (!numbers) return;
  const std::vector<int> items(numbers->begin(), numbers->end());
  if (items.empty() || !libertyPayloadBytes(items)) return refuse(command, "Invalid Parameter", out);
  for (const int station : stationsOf(command, out)) stationSetup(station).items = items;
}

void LibertyEmulator::setHemisphere(const LibertyCommand& command, Out& out) {
  const auto numbers = numbersOf(command, 1, out);
  if (!numbers) return;
  for (const int station : stationsOf(command, out)) {
    Eigen::Vector3d& towards = stationSetup(station).hemisphere;
    const std::vector<double> now(towards.begin(), towards.end());
    if (numbers->empty()) {
      reply('H', station, floats(now), columns(now), out);
    } else if (numbers->size() == 3) {
      towards = {(*numbers)[0], (*numbers)[1], (*numbers)[2]};
    } else {
      return refuse(command, "Invalid Parameter", out);
    }
  }
}

void LibertyEmulator::setTip(const LibertyCommand& command, Out& out) {
  const auto numbers = numbersOf(command, 1, out);
  if (!numbers) return;
  if (numbers->size() != 3) return refuse(command, "Invalid Parameter", out);
  for (const int station : stationsOf(command, out)) {
    stationSetup(station).tip = {(*numbers)[0], (*numbers)[1], (*numbers)[2]};
  }
}

void LibertyEmulator::setAlignment(const LibertyCommand& command, Out& out) {
  const auto numbers = numbersOf(command, 1, out);
  if (!numbers) return;
  if (numbers->size() != 9) return refuse(command, "Invalid Parameter", out);
  const Eigen::Map<const Eigen::Matrix3d> points(numbers->data());
  const Eigen::Vector3d x = points.col(1) - points.col(0);
  const Eigen::Vector3d z = x.cross(points.col(2) - points.col(0));
  if (x.norm() < 1e-9 || z.norm() < 1e-9) return refuse(command, "Invalid Parameter", out);
  Eigen::Matrix3d axes;
  axes << x.normalized(), z.cross(x).normalized(), z.normalized();
  for (const int station : stationsOf(command, out)) {
    stationSetup(station).tracker_from_aligned = {points.col(0) * metresPerUnit(), Eigen::Quaterniond(axes)};
  }
}

void LibertyEmulator::resetAlignment(const LibertyCommand& command, Out& out) {
  for (const int station : stationsOf(command, out)) stationSetup(station).tracker_from_aligned = Pose{};
}

void LibertyEmulator::setBoresight(const LibertyCommand& command, Out& out) {
  for (const int station : stationsOf(command, out)) {
    const int sensor = station - 1;
    const auto readings = source_->readNow(std::span(&sensor, 1), now_s_);
    stationSetup(station).boresight.reset();
    if (!readings.empty()) {
      stationSetup(station).boresight = reported(station, readings[0].tracker_from_sensor).orientation;
    }
  }
}

void LibertyEmulator::resetBoresight(const LibertyCommand& command, Out& out) {
  for (const int station : stationsOf(command, out)) stationSetup(station).boresight.reset();
}

void LibertyEmulator::setFilter(const LibertyCommand& command, Out& out) {
  const auto numbers = numbersOf(command, 0, out);
  if (!numbers) return;
  std::array<double, 4>& values = setup_.filters[command.letter];
  if (numbers->empty()) {
    const std::vector<double> now(values.begin(), values.end());
    return reply(command.letter, 0, floats(now), columns(now), out);
  }
  if (numbers->size() != 4) return refuse(command, "Invalid Parameter", out);
  std::copy(numbers->begin(), numbers->end(), values.begin());
}

void LibertyEmulator::resetCounters(const LibertyCommand&, Out&) {
  zero_s_ = now_s_;
  frame_ = 0;
}

void LibertyEmulator::restart(const LibertyCommand&, Out&) {
  setup_ = factorySetup();
  continuous_ = false;
  zero_s_ = now_s_;
  frame_ = 0;
  beginSilence();
}

std::vector<int> LibertyEmulator::activeSensors() const {
  std::vector<int> sensors;
  for (const auto& [station, setup] : setup_.stations) {
    if (setup.active) sensors.push_back(station - 1);
  }
  return sensors;
}

Pose LibertyEmulator::reported(int station, const Pose& tracker_from_sensor) const {
  const StationSetup& setup = stationSetup(station);
  Pose pose = inverse(setup.tracker_from_aligned) * inHemisphere(tracker_from_sensor, setup.hemisphere);
  pose.position_m += pose.orientation * (setup.tip * metresPerUnit());
  if (setup.boresight) pose.orientation = pose.orientation * setup.boresight->conjugate();
  return pose;
}

void LibertyEmulator::send(const std::vector<Sample>& samples, bool, Out& out) {
  ++frame_;
  const double stamp_ms = std::floor((reading_s_ - zero_s_) * 1000.0 + 1e-6);
  for (const Sample& read : samples) {
    const int station = read.sensor + 1;
    const Sample sample = misread(read);
    LibertyRecord sent;
    static_cast<PoseNumbers&>(sent) = numbersOfPose(
        flipped(source_->recorded() ? sample.tracker_from_sensor : reported(station, sample.tracker_from_sensor)));
    sent.station = station;
    if (!sample.status.empty()) sent.error = sample.status.size() == 1 ? sample.status[0] : 'k';
    sent.time_ms = static_cast<std::uint32_t>(static_cast<std::int64_t>(stamp_ms));
    sent.frame = frame_;
    const auto& items = stationSetup(station).items;
    if (setup_.binary) {
      record(encode(LibertyFrame{std::string(make_.tag), station, record_command_, sent.error,
                                 encodeLibertyPayload(sent, items, metresPerUnit())}),
             out);
    } else {
      record(encodeLibertyText(sent, items, metresPerUnit()), out);
    }
  }
}

Result<std::unique_ptr<EmulatorRunner>> makeLibertyEmulator(const Emulation& emulation) {
  return makeOf(emulation, libertyMake("liberty"));
}
Result<std::unique_ptr<EmulatorRunner>> makePatriotEmulator(const Emulation& emulation) {
  return makeOf(emulation, libertyMake("patriot"));
}

}  // namespace fieldtrue::acquisition
