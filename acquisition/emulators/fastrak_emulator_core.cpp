#include "acquisition/emulators/fastrak_emulator_core.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "calib/core/units.h"

namespace fieldtrue::acquisition {
namespace {

Eigen::Vector3d vectorAt(const std::vector<double>& numbers, std::size_t first) {
  return {numbers[first], numbers[first + 1], numbers[first + 2]};
}

bool within(const Eigen::Vector3d& v, const std::vector<double>& max_then_min) {
  return (v.array() <= vectorAt(max_then_min, 0).array()).all() &&
         (v.array() >= vectorAt(max_then_min, 3).array()).all();
}

/// True in one second of every four, never in the first three of a stream.
bool faultySecond(double time_s) { return std::fmod(time_s, 4.0) >= 3.0; }

}  // namespace

FastrakEmulatorCore::FastrakEmulatorCore(std::unique_ptr<PoseSource> source, FastrakEmulatorOptions options)
    : source_(std::move(source)), options_(std::move(options)), random_(options_.seed) {
  FT_CHECK(source_ != nullptr);
  setup_ = saved_ = factorySetup();
  setup_.continuous = options_.faults.already_streaming;
}

FastrakStatus FastrakEmulatorCore::status() const {
  FastrakStatus status;
  status.format = setup_.format;
  status.unit = setup_.unit;
  status.compensation = setup_.compensation;
  status.continuous = setup_.continuous;
  status.sensors = source_->sensors();
  status.version = options_.version;
  status.identity = setup_.identity;
  return status;
}

const std::vector<double>& FastrakEmulatorCore::numbers(char letter, int station) const {
  return setup_.numbers.at({letter, station});
}

void FastrakEmulatorCore::receive(std::string_view bytes, double time_s, std::vector<EmulatedOutput>& out) {
  now_s_ = time_s;
  if (time_s < silent_until_s_) return;
  std::vector<FastrakCommand> commands;
  reader_.add(bytes, commands);
  for (const auto& command : commands) {
    obey(command, out);
    if (now_s_ < silent_until_s_) return;
  }
}

bool FastrakEmulatorCore::tick(double time_s, std::vector<EmulatedOutput>& out, int most_cycles) {
  now_s_ = time_s;
  if (!setup_.continuous || paused_ || time_s < silent_until_s_) return false;
  const std::vector<int> sensors = activeSensors();
  if (sensors.empty()) return false;
  for (int i = 0; i < most_cycles; ++i) {
    const auto due_s = source_->due_s(cycle_, static_cast<int>(sensors.size()));
    if (!due_s || stream_start_s_ + *due_s > time_s) return false;
    send(source_->read(cycle_, sensors, stream_start_s_ + *due_s), false, out);
    ++cycle_;
  }
  return true;
}

std::vector<int> FastrakEmulatorCore::activeSensors() const {
  std::vector<int> sensors;
  for (int i = 0; i < kFastrakStations; ++i) {
    if (setup_.active[static_cast<std::size_t>(i)]) sensors.push_back(i);
  }
  return sensors;
}

Sample FastrakEmulatorCore::misread(Sample sample, double streaming_s) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const EmulatorFaults& faults = options_.faults;
  Eigen::Vector3d& position_m = sample.tracker_from_sensor.position_m;
  if (faults.error_status && faultySecond(streaming_s)) {
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

Pose FastrakEmulatorCore::reported(int station, const Pose& tracker_from_sensor) const {
  const auto index = static_cast<std::size_t>(station - 1);
  Pose pose = tracker_from_sensor;
  const Eigen::Vector3d hemisphere = vectorAt(numbers('H', station), 0);
  // A dipole's field is the same at p and -p: the tracker picks the side it was told.
  if (hemisphere.norm() > 0.0 && pose.position_m.dot(hemisphere) < 0.0) pose.position_m = -pose.position_m;
  pose = inverse(setup_.tracker_from_aligned[index]) * pose;
  pose.position_m += pose.orientation * (vectorAt(numbers('N', station), 0) * metresPer(setup_.unit));
  if (const auto& zero = setup_.boresight[index]) {
    constexpr double kRadPerDeg = 0.017453292519943295769;
    pose.orientation =
        pose.orientation * zero->conjugate() * rotationFromEuler(vectorAt(numbers('G', station), 0) * kRadPerDeg);
  }
  return pose;
}

char FastrakEmulatorCore::errorOf(const Sample& sample, int station, const Pose& pose) const {
  if (!sample.status.empty()) return sample.status.size() == 1 ? sample.status[0] : 'k';
  if (source_->recorded()) return ' ';
  if (!within(pose.position_m / metresPer(setup_.unit), numbers('V', station))) return 'x';
  return within(eulerFromRotation_rad(pose.orientation) * kDegPerRad, numbers('Q', station)) ? ' ' : 'y';
}

FastrakLayout FastrakEmulatorCore::layout(int station) const {
  auto layout = fastrakLayout(outputList(station), setup_.format);
  // Two-byte items have no ASCII form: they are sent as they are.
  if (!layout) layout = fastrakLayout(outputList(station), FastrakFormat::kBinary);
  FT_CHECK(layout.has_value());
  return *layout;
}

void FastrakEmulatorCore::send(const std::vector<Sample>& samples, bool every, std::vector<EmulatedOutput>& out) {
  for (const Sample& read : samples) {
    const int station = read.sensor + 1;
    const Sample sample = misread(read, read.time_s - stream_start_s_);
    Pose pose = source_->recorded() ? sample.tracker_from_sensor : reported(station, sample.tracker_from_sensor);
    if (options_.faults.hemisphere_flip && faultySecond(read.time_s - stream_start_s_))
      pose.position_m = -pose.position_m;
    Memory& memory = memory_[static_cast<std::size_t>(read.sensor)];
    const double increment_m = numbers('I', station)[0] * metresPer(setup_.unit);
    const bool moved =
        !memory.last_sent_m || (pose.position_m - *memory.last_sent_m).norm() >= increment_m || increment_m <= 0.0;
    if (!every && !moved) continue;
    FastrakRecord record = recordOfPose(station, errorOf(sample, station, pose), pose);
    record.relative_m = pose.position_m - memory.last_position_m.value_or(pose.position_m);
    memory.last_position_m = memory.last_sent_m = pose.position_m;
    out.push_back({encodeRecord(record, layout(station), setup_.unit), true});
    ++records_;
  }
}

}  // namespace fieldtrue::acquisition
