#include "acquisition/emulators/ndi_emulator.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/core/units.h"

namespace fieldtrue::acquisition {
namespace {

constexpr int kMostTools = 8;
constexpr int kFirstHandle = 10;
/// Error codes.
constexpr int kUnknown = 0x01, kTooShort = 0x03, kWrongCrc = 0x04, kBadLineSettings = 0x06, kWrongMode = 0x0C,
              kNoTool = 0x0D, kNotInitialised = 0x0E, kSystemNotInitialised = 0x10, kCannotInitialise = 0x13,
              kOutOfRange = 0x23, kNeverHandedOut = 0x2B;
constexpr double kUnpluggedAfter_s = 3.0;
constexpr std::uint64_t kOneWrongIn = 10;
constexpr double kGoodError_mm = 0.12, kBadError_mm = 9.9;

constexpr std::size_t kCrcDigits = 4;

}  // namespace

NdiEmulatorCore::NdiEmulatorCore(std::unique_ptr<PoseSource> source, const NdiEmulatorOptions& options)
    : EmulatedUnit(std::move(source), options), ndi_(options) {
  restart();
  if (!options_.faults.already_streaming) return;
  initialised_ = tracking_ = true;
  for (auto& [handle, port] : ports_) port.initialised = port.enabled = true;
}

void NdiEmulatorCore::restart() {
  ports_.clear();
  initialised_ = tracking_ = false;
  baud_ = kNdiPowerUpBaud;
  int sensors = 0;
  for (int sensor = 0; sensor < kMostTools; ++sensor) sensors += plugged(sensor) ? 1 : 0;
  for (int sensor = 0, left = sensors - ndi_.wireless; sensor < kMostTools && left > 0; ++sensor) {
    if (!plugged(sensor)) continue;
    Port port;
    port.sensor = sensor;
    port.wired = true;
    ports_.emplace(kFirstHandle + static_cast<int>(ports_.size()), std::move(port));
    --left;
  }
}

std::span<const NdiEmulatorCore::Command> NdiEmulatorCore::commands() {
  using Core = NdiEmulatorCore;
  static constexpr Command kCommands[] = {
      {"INIT", Mode::kSetup, &Core::initialise},
      {"VER", Mode::kAny, &Core::version},
      {"APIREV", Mode::kAny, &Core::revision},
      {"GET", Mode::kAny, &Core::feature},
      {"GETINFO", Mode::kAny, &Core::feature},
      {"SET", Mode::kAny, &Core::accept},
      {"BEEP", Mode::kAny, &Core::accept},
      {"LED", Mode::kAny, &Core::accept},
      {"COMM", Mode::kSetup, &Core::lineSettings},
      {"TSTART", Mode::kSetup, &Core::startTracking},
      {"TSTOP", Mode::kTracking, &Core::stopTracking},
      {"PHSR", Mode::kAny, &Core::listHandles},
      {"PHRQ", Mode::kSetup, &Core::requestHandle},
      {"PHF", Mode::kSetup, &Core::freeHandle},
      {"PVWR", Mode::kSetup, &Core::writeDefinition},
      {"PINIT", Mode::kSetup, &Core::initialiseHandle},
      {"PENA", Mode::kSetup, &Core::enableHandle},
      {"PDIS", Mode::kSetup, &Core::disableHandle},
      {"PHINF", Mode::kAny, &Core::tellHandle},
      {"TX", Mode::kTracking, &Core::sendText},
      {"BX", Mode::kTracking, &Core::sendBinary},
  };
  return kCommands;
}

void NdiEmulatorCore::hear(std::string_view bytes, Out& out) {
  constexpr std::size_t kLongest = 2048;
  for (const char c : bytes) {
    if (c != '\r') {
      if (c != '\n' && line_.size() < kLongest) line_ += c;
      continue;
    }
    if (const std::string line = std::exchange(line_, {}); !line.empty()) obey(line, out);
    if (silent()) return;
  }
}

void NdiEmulatorCore::obey(const std::string& line, Out& out) {
  const std::size_t mark = line.find_first_of(": ");
  const std::string name = line.substr(0, mark);
  std::string arguments = mark == std::string::npos ? "" : line.substr(mark + 1);
  if (mark != std::string::npos && line[mark] == ':') {
    if (arguments.size() < kCrcDigits) return reply(ndiErrorText(kTooShort), out);
    const auto crc = ndiNumber(std::string_view(line).substr(line.size() - kCrcDigits));
    if (!crc || *crc != ndiCrc(std::string_view(line).substr(0, line.size() - kCrcDigits)))
      return reply(ndiErrorText(kWrongCrc), out);
    arguments.resize(arguments.size() - kCrcDigits);
  }
  if (name == "RESET") {
    restart();
    reply("RESET", out);
    return beginSilence();
  }
  const auto rows = commands();
  const auto command = std::find_if(rows.begin(), rows.end(), [&](const Command& row) { return row.name == name; });
  if (command == rows.end() || (name == "BX" && !ndi_.knows_bx)) return reply(ndiErrorText(kUnknown), out);
  const bool wrong_mode = command->mode != Mode::kAny && (command->mode == Mode::kTracking) != tracking_;
  if (wrong_mode) return reply(ndiErrorText(kWrongMode), out);
  binary_reply_ = false;
  const std::string text = (this->*command->obey)(arguments);
  const bool is_record = name == "TX" || name == "BX";
  if (!is_record) return reply(text, out);
  std::string bytes = binary_reply_ ? text : encodeNdiReply(text);
  if (options_.faults.wrong_crc && ++replies_ % kOneWrongIn == 0) bytes[bytes.size() - 2] ^= 0x01;
  record(std::move(bytes), out);
}

void NdiEmulatorCore::reply(const std::string& text, Out& out) { answer(encodeNdiReply(text), out); }

std::string NdiEmulatorCore::initialise(const std::string&) {
  initialised_ = true;
  return "OKAY";
}

std::string NdiEmulatorCore::version(const std::string&) {
  return ndi_.identity + " emulator of Fieldtrue\nNDI S/N: EM-00001\nFreeze Tag: " + ndi_.identity + " Rev " +
         ndi_.version;
}

std::string NdiEmulatorCore::revision(const std::string&) { return "D.001.007"; }

std::string NdiEmulatorCore::feature(const std::string& name) {
  if (name == "Features.Firmware.Version")
    return name + "=" + ndi_.version + ";3;1;0;12;;Current firmware revision number";
  return ndiErrorText(kOutOfRange);
}

std::string NdiEmulatorCore::lineSettings(const std::string& settings) {
  const int baud = settings.empty() ? 0 : ndiRateOfDigit(settings[0]);
  if (settings.size() != 5 || baud == 0) return ndiErrorText(kBadLineSettings);
  baud_ = baud;
  return "OKAY";
}

std::string NdiEmulatorCore::accept(const std::string&) { return "OKAY"; }

std::string NdiEmulatorCore::startTracking(const std::string& option) {
  if (!initialised_) return ndiErrorText(kSystemNotInitialised);
  const double ran_s = now_s_ - tracking_since_s_;
  first_frame_ = option == "80" ? 0 : first_frame_ + static_cast<std::uint32_t>(ran_s * ndi_.rate_hz);
  tracking_ = true;
  tracking_since_s_ = now_s_;
  next_cycle_ = 0;
  beginStream();
  for (auto& [handle, port] : ports_) port.was_seen = false;
  return "OKAY";
}

std::string NdiEmulatorCore::stopTracking(const std::string&) {
  tracking_ = false;
  return "OKAY";
}

unsigned NdiEmulatorCore::statusOf(const Port& port) const {
  const bool there = (port.wired || !port.rom.empty()) && !unplugged(port);
  return (there ? ndi_port::kOccupied : 0u) | (port.initialised ? ndi_port::kInitialised : 0u) |
         (port.enabled ? ndi_port::kEnabled : 0u);
}

bool NdiEmulatorCore::unplugged(const Port& port) const {
  return options_.faults.tool_unplugged && tracking_ && &port == &ports_.rbegin()->second &&
         now_s_ - tracking_since_s_ > kUnpluggedAfter_s;
}

std::string NdiEmulatorCore::listHandles(const std::string& option) {
  if (!initialised_) return ndiErrorText(kSystemNotInitialised);
  std::vector<NdiHandle> handles;
  for (const auto& [handle, port] : ports_) {
    const unsigned status = statusOf(port);
    const bool there = (status & ndi_port::kOccupied) != 0;
    const bool listed = option == "01"   ? !there && !port.rom.empty()
                        : option == "02" ? there && !port.initialised
                        : option == "03" ? there && port.initialised && !port.enabled
                        : option == "04" ? port.enabled
                                         : true;
    if (listed) handles.push_back({handle, status});
  }
  return encodeNdiHandles(handles);
}

std::string NdiEmulatorCore::requestHandle(const std::string&) {
  const int handle = ports_.empty() ? kFirstHandle : ports_.rbegin()->first + 1;
  ports_.emplace(handle, Port{});
  return ndiHex(static_cast<unsigned>(handle), 2);
}

NdiEmulatorCore::Port* NdiEmulatorCore::portOf(const std::string& arguments) {
  const auto handle = ndiNumber(std::string_view(arguments).substr(0, 2));
  const auto port = handle ? ports_.find(static_cast<int>(*handle)) : ports_.end();
  return port == ports_.end() ? nullptr : &port->second;
}

std::string NdiEmulatorCore::freeHandle(const std::string& handle) {
  if (!portOf(handle)) return ndiErrorText(kNeverHandedOut);
  ports_.erase(static_cast<int>(*ndiNumber(handle)));
  return "OKAY";
}

std::string NdiEmulatorCore::writeDefinition(const std::string& arguments) {
  constexpr std::size_t kHead = 6, kData = 128;
  Port* port = portOf(arguments);
  if (!port) return ndiErrorText(kNeverHandedOut);
  if (arguments.size() != kHead + kData) return ndiErrorText(kTooShort);
  const auto at = ndiNumber(std::string_view(arguments).substr(2, 4));
  if (!at || *at + kData / 2 > kNdiMostRomBytes) return ndiErrorText(kOutOfRange);
  port->rom.resize(std::max<std::size_t>(port->rom.size(), *at + kData / 2));
  for (std::size_t i = 0; i < kData / 2; ++i) {
    const auto byte = ndiNumber(std::string_view(arguments).substr(kHead + 2 * i, 2));
    if (!byte) return ndiErrorText(kOutOfRange);
    port->rom[*at + i] = static_cast<char>(*byte);
  }
  return "OKAY";
}

std::string NdiEmulatorCore::initialiseHandle(const std::string& handle) {
  Port* port = portOf(handle);
  if (!port) return ndiErrorText(kNeverHandedOut);
  if (!port->wired && port->rom.empty()) return ndiErrorText(kCannotInitialise);
  if (port->sensor < 0) {
    const auto taken = [this](int sensor) {
      return std::any_of(ports_.begin(), ports_.end(), [&](const auto& row) { return row.second.sensor == sensor; });
    };
    for (int sensor = 0; sensor < kMostTools && port->sensor < 0; ++sensor) {
      if (plugged(sensor) && !taken(sensor)) port->sensor = sensor;
    }
  }
  port->initialised = true;
  return "OKAY";
}

std::string NdiEmulatorCore::enableHandle(const std::string& arguments) {
  constexpr std::string_view kPriorities = "SDB";
  constexpr int kBadPriority = 0x09;
  Port* port = portOf(arguments);
  if (!port) return ndiErrorText(kNeverHandedOut);
  if (arguments.size() != 3 || kPriorities.find(arguments[2]) == std::string_view::npos)
    return ndiErrorText(kBadPriority);
  if (!port->initialised) return ndiErrorText(kNotInitialised);
  port->enabled = true;
  return "OKAY";
}

std::string NdiEmulatorCore::disableHandle(const std::string& handle) {
  Port* port = portOf(handle);
  if (!port) return ndiErrorText(kNeverHandedOut);
  port->enabled = false;
  return "OKAY";
}

std::string NdiEmulatorCore::tellHandle(const std::string& arguments) {
  const Port* port = portOf(arguments);
  if (!port) return ndiErrorText(kNeverHandedOut);
  const unsigned options = arguments.size() >= 6 ? ndiNumber(std::string_view(arguments).substr(2, 4)).value_or(1) : 1;
  if ((statusOf(*port) & ndi_port::kOccupied) == 0) return "UNOCCUPIED";
  std::string text;
  if ((options & 0x0001u) != 0) {
    const std::string serial = ndiHex(0x34801400u + static_cast<unsigned>(port->sensor + 1), 8);
    text += encodeNdiToolInformation({"02000000", "Fieldtrue", "001", serial, statusOf(*port)});
  }
  if ((options & 0x0004u) != 0) text += "610029              ";
  // Device, system, tool, port, channel.
  if ((options & 0x0020u) != 0)
    text += "00000000000" + std::string(port->wired ? "0" : "1") + ndiHex(static_cast<unsigned>(port->sensor + 1), 2);
  return text;
}

std::vector<int> NdiEmulatorCore::activeSensors() const {
  std::vector<int> sensors;
  for (const auto& [handle, port] : ports_) {
    if (port.enabled && port.sensor >= 0) sensors.push_back(port.sensor);
  }
  std::sort(sensors.begin(), sensors.end());
  return sensors;
}

void NdiEmulatorCore::keep(const std::vector<Sample>& samples, std::uint32_t frame) {
  for (const Sample& sample : samples) {
    for (auto& [handle, port] : ports_) {
      if (port.sensor != sample.sensor) continue;
      port.latest = misread(sample);
      port.latest.tracker_from_sensor = flipped(port.latest.tracker_from_sensor);
      port.frame = frame;
      port.was_seen = true;
    }
  }
}

void NdiEmulatorCore::measure() {
  const double tracked_s = now_s_ - tracking_since_s_;
  const std::vector<int> sensors = activeSensors();
  const auto frameAt = [this](double t_s) {
    constexpr double kRounding = 1e-9;
    return static_cast<std::uint32_t>(std::floor(t_s * ndi_.rate_hz + kRounding));
  };
  if (source_->recorded()) {
    for (auto due = source_->due_s(next_cycle_, 1); due && *due <= tracked_s; due = source_->due_s(next_cycle_, 1)) {
      keep(source_->read(next_cycle_++, sensors, tracking_since_s_ + *due), first_frame_ + frameAt(*due));
    }
    return;
  }
  const std::uint32_t now = frameAt(tracked_s);
  if (now < next_cycle_) return;
  next_cycle_ = std::uint64_t{now} + 1;
  keep(source_->read(now, sensors, tracking_since_s_ + now / ndi_.rate_hz), first_frame_ + now);
}

NdiTool NdiEmulatorCore::toolOf(int handle, Port& port) {
  const double tracked_s = now_s_ - tracking_since_s_;
  NdiTool tool;
  tool.handle = handle;
  if (unplugged(port)) {
    tool.state = NdiState::kUnoccupied;
    return tool;
  }
  tool.port_status = statusOf(port);
  tool.frame = port.was_seen ? port.frame : first_frame_ + static_cast<std::uint32_t>(tracked_s * ndi_.rate_hz);
  const bool hidden = options_.faults.missing && faultySecond(tracked_s);
  if (!port.was_seen || hidden || port.latest.status == "missing") return tool;
  const Pose& pose = port.latest.tracker_from_sensor;
  const Eigen::Quaterniond q = canonical(pose.orientation);
  tool.state = NdiState::kValid;
  tool.quaternion_wxyz = {q.w(), q.x(), q.y(), q.z()};
  tool.position_mm = pose.position_m / kMPerMm;
  tool.error_mm = port.latest.status.empty() ? kGoodError_mm : kBadError_mm;
  if (options_.faults.out_of_volume && faultySecond(tracked_s)) {
    tool.port_status |= ndi_port::kOutOfVolume;
    tool.position_mm += Eigen::Vector3d(80.0, -120.0, 60.0);
  }
  return tool;
}

NdiFrame NdiEmulatorCore::frame() {
  measure();
  NdiFrame frame;
  for (auto& [handle, port] : ports_) {
    if (port.enabled) frame.tools.push_back(toolOf(handle, port));
    if (unplugged(port)) frame.system_status |= 0x80u;
  }
  return frame;
}

std::string NdiEmulatorCore::sendText(const std::string&) { return encodeNdiTx(frame()); }

std::string NdiEmulatorCore::sendBinary(const std::string&) {
  binary_reply_ = true;
  return encodeNdiBx(frame());
}

Result<std::unique_ptr<EmulatorRunner>> makeNdiEmulator(const Emulation& emulation) {
  const NdiEmulatorOptions options;
  return makeEmulator<NdiEmulatorCore>(emulation, {"NDI Aurora", kMostTools, options.rate_hz}, options);
}

}  // namespace fieldtrue::acquisition
