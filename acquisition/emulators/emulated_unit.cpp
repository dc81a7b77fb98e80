#include "acquisition/emulators/emulated_unit.h"

#include <cmath>

#include "acquisition/emulators/pty_endpoint.h"
#include "acquisition/emulators/simulated_jig.h"

namespace fieldtrue::acquisition {
namespace {

/// Five places in front of the transmitter, in the rig's frame.
std::vector<Pose> walk(const simulation::Scene& scene) {
  std::vector<Pose> places;
  for (const auto& p :
       {Eigen::Vector3d(0.35, 0.0, 0.0), Eigen::Vector3d(0.35, 0.2, 0.0), Eigen::Vector3d(0.5, 0.2, 0.15),
        Eigen::Vector3d(0.5, -0.2, 0.15), Eigen::Vector3d(0.35, -0.2, -0.1)}) {
    places.push_back(scene.reference_from_tracker * Pose{p, Eigen::Quaterniond::Identity()});
  }
  return places;
}

Result<std::unique_ptr<PoseSource>> makeReplay(const SampleTable& recording, const EmulatedMake& make) {
  if (recording.rows.empty()) {
    return fail(ErrorCode::kBadInput, "The recording to replay has no rows; at least one sample is needed");
  }
  for (const auto& row : recording.rows) {
    if (row.sample.sensor >= 0 && row.sample.sensor < make.most_sensors) continue;
    return fail(ErrorCode::kBadInput, "The recording holds sensor " + std::to_string(row.sample.sensor) + "; a " +
                                          make.name + " has sensors 0 to " + std::to_string(make.most_sensors - 1));
  }
  return std::make_unique<ReplaySource>(recording);
}

}  // namespace

EmulatedUnit::EmulatedUnit(std::unique_ptr<PoseSource> source, EmulatedUnitOptions options)
    : source_(std::move(source)), options_(std::move(options)), random_(options_.seed) {
  FT_CHECK(source_ != nullptr);
}

void EmulatedUnit::receive(std::string_view bytes, double time_s, Out& out) {
  now_s_ = reading_s_ = time_s;
  if (!silent()) hear(bytes, out);
}

bool EmulatedUnit::tick(double time_s, Out& out, int most_cycles) {
  now_s_ = time_s;
  if (!streaming() || paused_ || silent()) return false;
  const std::vector<int> sensors = activeSensors();
  if (sensors.empty()) return false;
  for (int i = 0; i < most_cycles; ++i) {
    const auto due_s = source_->due_s(cycle_, sharing(sensors.size()));
    if (!due_s || stream_start_s_ + *due_s > time_s) return false;
    reading_s_ = stream_start_s_ + *due_s;
    send(source_->read(cycle_, sensors, reading_s_), false, out);
    ++cycle_;
  }
  return true;
}

void EmulatedUnit::beginStream() {
  stream_start_s_ = now_s_;
  cycle_ = 0;
}

void EmulatedUnit::beginSilence() { silent_until_s_ = now_s_ + options_.reset_silence_s; }

void EmulatedUnit::record(std::string bytes, Out& out) {
  out.push_back({std::move(bytes), true});
  ++records_;
}

Sample EmulatedUnit::misread(Sample sample) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const EmulatorFaults& faults = options_.faults;
  Eigen::Vector3d& position_m = sample.tracker_from_sensor.position_m;
  if (faults.error_status && faultySecond(reading_s_ - stream_start_s_)) {
    sample.status = "k";
    position_m += Eigen::Vector3d(0.2, -0.1, 0.15);
  }
  if (faults.outliers && unit(random_) < 0.01) {
    std::normal_distribution<double> normal;
    const Eigen::Vector3d direction(normal(random_), normal(random_), normal(random_));
    position_m += (0.1 + 0.2 * unit(random_)) * direction.normalized();
  }
  return sample;
}

Pose EmulatedUnit::flipped(Pose pose) const {
  if (options_.faults.hemisphere_flip && faultySecond(reading_s_ - stream_start_s_)) pose.position_m = -pose.position_m;
  return pose;
}

bool faultySecond(double streaming_s) { return std::fmod(streaming_s, 4.0) >= 3.0; }

Pose inHemisphere(Pose tracker_from_sensor, const Eigen::Vector3d& towards) {
  Eigen::Vector3d& p_m = tracker_from_sensor.position_m;
  if (towards.norm() > 0.0 && p_m.dot(towards) < 0.0) p_m = -p_m;
  return tracker_from_sensor;
}

Result<std::unique_ptr<PoseSource>> makeSource(const Emulation& emulation, const EmulatedMake& make) {
  if (emulation.replay) return makeReplay(*emulation.replay, make);
  constexpr double kStand_s = 3.0;
  if (emulation.sensors < 1 || emulation.sensors > make.most_sensors) {
    return fail(ErrorCode::kBadInput, "A " + make.name + " has 1 to " + std::to_string(make.most_sensors) +
                                          " sensors, not " + std::to_string(emulation.sensors));
  }
  simulation::Scene scene = emulation.scene;
  if (make.rate_hz > 0.0) scene.tracker.rate_hz = make.rate_hz;
  FT_TRY(auto simulator, simulation::TrackerSimulator::make(scene, emulation.seed));
  auto jig = std::make_unique<SimulatedJig>(std::move(simulator), OperatorHabits{}, emulation.seed, emulation.sensors);
  jig->wander(walk(scene), kStand_s);
  return jig;
}

Result<std::unique_ptr<EmulatorEndpoint>> makeEndpoint(const Emulation& emulation) {
  if (emulation.pty_link.empty() == !emulation.tcp_port.has_value()) {
    return fail(ErrorCode::kBadInput, "An emulator needs one line: --pty LINK or --listen PORT");
  }
  if (emulation.tcp_port) return std::make_unique<TcpEndpoint>(static_cast<quint16>(*emulation.tcp_port));
  return std::make_unique<PtyEndpoint>(QString::fromStdString(emulation.pty_link));
}

}  // namespace fieldtrue::acquisition
