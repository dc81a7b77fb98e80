#include "acquisition/emulators/openigtlink_emulator.h"

#include <chrono>

#include "calib/core/error.h"

namespace fieldtrue::acquisition {
namespace {

constexpr const char* kServerName = "Fieldtrue";
constexpr std::uint64_t kWrongCrcOneIn = 10;
constexpr std::uint64_t kOtherTypesOneIn = 5;

}  // namespace

IgtlEmulatorCore::IgtlEmulatorCore(std::unique_ptr<PoseSource> source, IgtlEmulatorOptions options)
    : EmulatedUnit(std::move(source), options),
      start_utc_s_(options.start_utc_s),
      sends_(!options.faults.waits_to_be_asked) {}

void IgtlEmulatorCore::hostCame(double time_s) {
  now_s_ = time_s;
  heard_ = {};
  sends_ = !options_.faults.waits_to_be_asked;
  beginStream();
}

std::vector<int> IgtlEmulatorCore::activeSensors() const {
  std::vector<int> sensors;
  for (int sensor = 0; sensor < static_cast<int>(kMostSensors); ++sensor) {
    if (plugged(sensor)) sensors.push_back(sensor);
  }
  return sensors;
}

void IgtlEmulatorCore::hear(std::string_view bytes, Out& out) {
  std::vector<IgtlMessage> messages;
  heard_.add(bytes, messages);
  for (const IgtlMessage& asked : messages) {
    const bool starts = asked.header.type == "STT_TDATA";
    if (!starts && asked.header.type != "STP_TDATA") continue;
    if (starts && !sends_) beginStream();
    sends_ = starts;
    answer(message("RTS_TDATA", kServerName, now_s_, std::string(1, '\0')), out);
  }
}

void IgtlEmulatorCore::send(const std::vector<Sample>& samples, bool, Out& out) {
  if (samples.empty()) return;
  const double time_s = samples.front().time_s;
  std::vector<IgtlReading> visible;
  for (const Sample& reading : samples) {
    const Sample sample = misread(reading);
    const std::string name = "Sensor" + std::to_string(sample.sensor + 1);
    if (sample.status.empty()) visible.push_back({name, flipped(sample.tracker_from_sensor), {}});
  }
  if (options_.faults.unknown_types && cycles_++ % kOtherTypesOneIn == 0) {
    constexpr std::size_t kImageBytes = 3000;
    out.push_back({message("IMAGE", "Camera", time_s, std::string(kImageBytes, '\x01')), true});
    out.push_back({message("FIELDTRUE9", kServerName, time_s, {}), true});
  }
  if (visible.size() < samples.size()) {
    constexpr int kNotReady = 13;
    const std::string body = encodeServerStatusBody({kNotReady, "NotReady", "a sensor is out of the field"});
    out.push_back({message("STATUS", kServerName, time_s, body), true});
  }
  record(message(nameOf(IgtlPoseType::kTrackingData), "Tracker", time_s, encodeTrackingBody(visible)), out);
  for (const IgtlReading& reading : visible) {
    const std::string body = encodeTransformBody(reading.tracker_from_sensor);
    record(message(nameOf(IgtlPoseType::kTransform), reading.name, time_s, body), out);
  }
}

std::string IgtlEmulatorCore::message(std::string_view type, const std::string& device, double time_s,
                                      const std::string& body) {
  const std::uint64_t stamp = options_.faults.no_stamps ? 0 : igtlStampOf(start_utc_s_ + time_s);
  std::string bytes = encodeIgtl(type, device, stamp, body);
  const bool spoilt = options_.faults.wrong_crc && ++messages_ % kWrongCrcOneIn == 0;
  if (spoilt) bytes.back() = static_cast<char>(bytes.back() ^ 0x10);
  return bytes;
}

Result<std::unique_ptr<EmulatorRunner>> makeIgtlEmulator(const Emulation& emulation) {
  if (!emulation.pty_link.empty()) {
    return fail(ErrorCode::kBadInput, "OpenIGTLink is spoken over TCP only; give --listen PORT in place of --pty");
  }
  IgtlEmulatorOptions options;
  options.start_utc_s = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
  return makeEmulator<IgtlEmulatorCore>(emulation, {"server", static_cast<int>(kMostSensors), 0.0}, options);
}

}  // namespace fieldtrue::acquisition
