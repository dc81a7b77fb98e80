#include "acquisition/emulators/flock_emulator.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/core/units.h"

namespace fieldtrue::acquisition {
namespace {

namespace parameter = flock_parameter;
using Parameters = std::map<int, std::string>;

constexpr int kCrystal_mhz = 25;
/// Error codes.
constexpr int kUnknownCommand = 6, kNoBirdActive = 8, kNoSuchBird = 13, kNoData = 17, kSaturated = 32;
constexpr double kStuckAfter_s = 3.0;

Parameters factoryParameters(double rate_hz, const std::string& version) {
  Parameters values;
  for (const FlockParameter& row : flockParameters()) {
    if (row.examined_bytes > 0) values[row.number] = std::string(static_cast<std::size_t>(row.examined_bytes), '\0');
  }
  values[parameter::kRevision] = version;
  values[parameter::kCrystal] = flockNumberBytes(kCrystal_mhz);
  values[parameter::kRate] = flockNumberBytes(static_cast<int>(std::lround(rate_hz * 256.0)));
  values[parameter::kRateCount] = flockNumberBytes(flockRateCount(rate_hz, kCrystal_mhz));
  values[parameter::kDataReadyCharacter] = ",";
  values[parameter::kLineFrequency] = {60};
  values[parameter::kSerialNumber] = flockNumberBytes(4711);
  return values;
}

/// Azimuth, elevation and roll of three words, full scale half a turn.
Eigen::Quaterniond rotationOf(const std::string& words) {
  Eigen::Vector3d angles_rad;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const int word = flockNumber(std::string_view(words).substr(static_cast<std::size_t>(2 * i), 2));
    angles_rad[i] = (word >= 0x8000 ? word - 0x10000 : word) / 32768.0 * kPi;
  }
  return rotationFromEuler(angles_rad);
}

}  // namespace

FlockEmulatorCore::FlockEmulatorCore(std::unique_ptr<PoseSource> source, const FlockEmulatorOptions& options)
    : EmulatedUnit(std::move(source), options), flock_(options), reader_(options.addressing) {
  const auto add = [this](int sensor) {
    Bird bird{sensor, findFlockMode("position_angles"), factoryParameters(flock_.rate_hz, flock_.version), {}};
    birds_.emplace(static_cast<int>(birds_.size()) + 1, std::move(bird));
  };
  if (flock_.extended_range) add(-1);
  for (int sensor = 0; sensor < kFlockMostBirds; ++sensor) {
    if (plugged(sensor)) add(sensor);
  }
  configured_ = flock_.standalone || birds_.size() == 1;
  if (options_.faults.already_streaming) {
    configured_ = true;
    group_ = birds_.size() > 1;
    startStream();
  }
}

FlockEmulatorCore::Bird& FlockEmulatorCore::birdAt(int address) {
  const auto found = birds_.find(address);
  return found == birds_.end() ? birds_.begin()->second : found->second;
}

void FlockEmulatorCore::note(int error, int where) {
  error_ = error;
  error_where_ = where;
}

void FlockEmulatorCore::hear(std::string_view bytes, Out& out) {
  if (now_s_ < configured_from_s_) return;
  std::vector<FlockCommand> commands;
  reader_.add(bytes, commands);
  for (const FlockCommand& command : commands) {
    obey(command, out);
    if (now_s_ < configured_from_s_) return;
  }
}

void FlockEmulatorCore::obey(const FlockCommand& command, Out& out) {
  if (command.address > 0 && !birds_.contains(command.address)) return note(kNoSuchBird, command.address);
  Bird& bird = birdAt(command.address);
  switch (command.letter) {
    case 'B':
      streaming_ = false;
      return sendPoint(command.address, out);
    case '@':
      return startStream();
    case '?':
      streaming_ = false;
      return;
    case 'G':
      asleep_ = true;
      return;
    case 'F':
      if (std::exchange(asleep_, false)) beginStream();
      return;
    case '\x13':
    case '\x11':
      paused_ = command.letter == '\x13';
      return;
    case '/':
      streaming_ = group_ = false;
      configured_ = birds_.size() == 1;
      return;
    case 'N':
      return answer(std::string(1, '\0'), out);
    case kFlockExamine:
      return examine(bird, command.address, *command.parameter, out);
    case kFlockChange:
      return change(bird, command);
    default:
      return findFlockCommand(command.letter) ? setUp(bird, command) : note(kUnknownCommand);
  }
}

void FlockEmulatorCore::setUp(Bird& bird, const FlockCommand& command) {
  constexpr std::string_view kReports = "QRST";
  constexpr int kEvery[] = {1, 2, 8, 32};
  if (const FlockMode* mode = findFlockMode(command.letter)) {
    bird.mode = mode;
    bird.last_record.clear();
  }
  if (const auto report = kReports.find(command.letter); report != std::string_view::npos) {
    report_every_ = kEvery[report];
    reports_held_ = 0;
  }
  if (command.letter == 'L') bird.parameters[parameter::kHemisphere] = command.data;
  if (command.letter == 'q') bird.parameters[parameter::kAngleAlign] = command.data;
  if (command.letter == 'r') bird.parameters[parameter::kReferenceFrameAngles] = command.data;
}

void FlockEmulatorCore::examine(const Bird& bird, int address, int number, Out& out) {
  const FlockParameter* row = findFlockParameter(number);
  if (!row || row->examined_bytes == 0) return note(kUnknownCommand);
  answer(valueOf(bird, std::max(1, address), number), out);
}

std::string FlockEmulatorCore::valueOf(const Bird& bird, int address, int number) {
  switch (number) {
    case parameter::kStatus:
      return statusOf(bird, address);
    case parameter::kError:
      return {static_cast<char>(std::exchange(error_, 0))};
    case parameter::kExpandedError:
      return {static_cast<char>(std::exchange(error_, 0)), static_cast<char>(std::exchange(error_where_, 0))};
    case parameter::kModel:
      return flock_.identity;
    case parameter::kAddressing:
      return {static_cast<char>(flockAddressing(flock_.addressing).code)};
    case parameter::kAddress:
      return {static_cast<char>(flock_.standalone ? 0 : address)};
    case parameter::kGroupMode:
      return {group_ ? '\1' : '\0'};
    case parameter::kFlockStatus:
      return flockStatus();
    default:
      return bird.parameters.at(number);
  }
}

std::string FlockEmulatorCore::statusOf(const Bird& bird, int address) const {
  FlockStatus status;
  status.master = address == 1;
  status.initialised = configured_;
  status.error = error_ != 0;
  status.running = configured_ && !asleep_;
  status.expanded = flock_.addressing != FlockAddressing::kNormal;
  status.xoff = paused_;
  status.sleeping = asleep_;
  status.streaming = streaming_;
  status.mode = bird.mode->code;
  return encodeFlockStatus(status);
}

std::string FlockEmulatorCore::flockStatus() const {
  std::string units(static_cast<std::size_t>(flockAddressing(flock_.addressing).status_bytes), '\0');
  for (const auto& [address, bird] : birds_) {
    const FlockUnit unit{true, configured_ && !asleep_, bird.sensor >= 0, bird.sensor < 0, address == 1 ? 1u : 0u};
    units[static_cast<std::size_t>(address - 1)] = static_cast<char>(encodeFlockUnit(unit));
  }
  return units;
}

void FlockEmulatorCore::change(Bird& bird, const FlockCommand& command) {
  const int number = *command.parameter;
  const FlockParameter* row = findFlockParameter(number);
  if (!row || row->changed_bytes == 0) return note(kUnknownCommand);
  if (number == parameter::kAutoConfigure) return configure(static_cast<unsigned char>(command.data[0]));
  if (number == parameter::kGroupMode) {
    group_ = command.data[0] != 0;
    for (auto& [address, one] : birds_) one.last_record.clear();
  }
  if (number == parameter::kDataReady) {
    data_ready_ = command.data[0] != 0;
    beginStream();
  }
  bird.parameters[number] = command.data;
}

void FlockEmulatorCore::configure(int units) {
  streaming_ = false;
  configured_from_s_ = now_s_ + flock_.configure_time_s;
  configured_ = units >= 1;
  const int there = static_cast<int>(birds_.size());
  if (units > there) note(kNoSuchBird, there + 1);
}

void FlockEmulatorCore::startStream() {
  if (!std::exchange(streaming_, true)) {
    beginStream();
    stream_began_s_ = now_s_;
    reports_held_ = 0;
  }
}

std::vector<int> FlockEmulatorCore::reportingAddresses() const {
  std::vector<int> addresses;
  for (const auto& [address, bird] : birds_) {
    if (bird.sensor >= 0 && (group_ || addresses.empty())) addresses.push_back(address);
  }
  return addresses;
}

std::vector<int> FlockEmulatorCore::activeSensors() const {
  std::vector<int> sensors;
  if (!configured_ || asleep_ || now_s_ < configured_from_s_) return sensors;
  for (const int address : reportingAddresses()) sensors.push_back(birds_.at(address).sensor);
  return sensors;
}

void FlockEmulatorCore::measure() {
  const auto cycle = static_cast<std::int64_t>(now_s_ * flock_.rate_hz);
  if (cycle == std::exchange(measured_cycle_, cycle)) return;
  std::vector<int> sensors;
  for (const auto& [address, bird] : birds_) {
    if (bird.sensor >= 0) sensors.push_back(bird.sensor);
  }
  measured_ = source_->readNow(sensors, now_s_);
}

void FlockEmulatorCore::sendPoint(int address, Out& out) {
  if (!configured_ || asleep_) return note(kNoBirdActive);
  measure();
  if (group_ && address == 0) return send(measured_, true, out);
  const Bird& bird = birdAt(std::max(1, address));
  for (const Sample& sample : measured_) {
    if (sample.sensor == bird.sensor) return sendRecord(std::max(1, address), sample, out);
  }
  note(kNoData);
}

void FlockEmulatorCore::send(const std::vector<Sample>& samples, bool every, Out& out) {
  if (!every && !streaming_) return answer(birds_.at(1).parameters.at(parameter::kDataReadyCharacter), out);
  if (!every && reports_held_-- > 0) return;
  if (!every) reports_held_ = report_every_ - 1;
  for (const int address : reportingAddresses()) {
    for (const Sample& sample : samples) {
      if (sample.sensor == birds_.at(address).sensor) sendRecord(address, sample, out);
    }
  }
}

FlockLayout FlockEmulatorCore::layout(const Bird& bird) const {
  FlockLayout layout;
  layout.mode = bird.mode;
  layout.group = group_;
  layout.conventions = flock_.conventions;
  const bool far = flockNumber(bird.parameters.at(parameter::kScale)) != 0;
  layout.range_m = flock_.extended_range ? kFlockRange144_m : far ? kFlockRange72_m : kFlockRange36_m;
  return layout;
}

Pose FlockEmulatorCore::reported(const Bird& bird, const Pose& tracker_from_sensor) const {
  const std::string& side = bird.parameters.at(parameter::kHemisphere);
  const auto towards = flockHemisphereAxis(static_cast<unsigned char>(side[0]), static_cast<unsigned char>(side[1]));
  Pose pose = inHemisphere(tracker_from_sensor, towards.value_or(Eigen::Vector3d::Zero()));
  const Eigen::Quaterniond frame_from_tracker =
      rotationOf(bird.parameters.at(parameter::kReferenceFrameAngles)).conjugate();
  if (bird.parameters.at(parameter::kReferenceFrame)[0] != 0) pose.position_m = frame_from_tracker * pose.position_m;
  pose.orientation = frame_from_tracker * pose.orientation * rotationOf(bird.parameters.at(parameter::kAngleAlign));
  return pose;
}

void FlockEmulatorCore::sendRecord(int address, const Sample& read, Out& out) {
  Bird& bird = birds_.at(address);
  const EmulatorFaults& faults = options_.faults;
  const Sample sample = misread(read);
  const bool saturated = !sample.status.empty();
  const bool stuck = faults.stuck && reading_s_ - stream_began_s_ > kStuckAfter_s;
  if (saturated) note(kSaturated);
  if (bird.last_record.empty() && saturated) return;
  if (!saturated && (!stuck || bird.last_record.empty())) {
    const Pose pose = source_->recorded() ? sample.tracker_from_sensor : reported(bird, sample.tracker_from_sensor);
    bird.last_record = encodeFlockRecord(address, flipped(pose), layout(bird));
  }
  record(bird.last_record, out);
  if (faults.repeats) record(bird.last_record, out);
}

Result<std::unique_ptr<EmulatorRunner>> makeFlockEmulator(const Emulation& emulation) {
  const FlockEmulatorOptions options;
  return makeEmulator<FlockEmulatorCore>(emulation, {"Flock of Birds", kFlockMostBirds - 1, options.rate_hz}, options);
}

}  // namespace fieldtrue::acquisition
