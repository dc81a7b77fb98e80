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

}  // namespace

FastrakEmulatorCore::FastrakEmulatorCore(std::unique_ptr<PoseSource> source, const FastrakEmulatorOptions& options)
    : EmulatedUnit(std::move(source), options),
      stations_(options.stations),
      letters_it_lacks_(options.letters_it_lacks) {
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

void FastrakEmulatorCore::hear(std::string_view bytes, std::vector<EmulatedOutput>& out) {
  std::vector<FastrakCommand> commands;
  reader_.add(bytes, commands);
  for (const auto& command : commands) {
    obey(command, out);
    if (silent()) return;
  }
}

std::vector<int> FastrakEmulatorCore::activeSensors() const {
  std::vector<int> sensors;
  for (int i = 0; i < stations_; ++i) {
    if (setup_.active[static_cast<std::size_t>(i)]) sensors.push_back(i);
  }
  return sensors;
}

Pose FastrakEmulatorCore::reported(int station, const Pose& tracker_from_sensor) const {
  const auto index = static_cast<std::size_t>(station - 1);
  Pose pose = inverse(setup_.tracker_from_aligned[index]) *
              inHemisphere(tracker_from_sensor, vectorAt(numbers('H', station), 0));
  pose.position_m += pose.orientation * (vectorAt(numbers('N', station), 0) * metresPer(setup_.unit));
  if (const auto& zero = setup_.boresight[index]) {
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

std::string FastrakEmulatorCore::written(const FastrakRecord& record) const {
  return encodeRecord(record, layout(record.station), setup_.unit);
}

void FastrakEmulatorCore::send(const std::vector<Sample>& samples, bool every, std::vector<EmulatedOutput>& out) {
  for (const Sample& read : samples) {
    const int station = read.sensor + 1;
    const Sample sample = misread(read);
    const Pose pose =
        flipped(source_->recorded() ? sample.tracker_from_sensor : reported(station, sample.tracker_from_sensor));
    Memory& memory = memory_[static_cast<std::size_t>(read.sensor)];
    const double increment_m = numbers('I', station)[0] * metresPer(setup_.unit);
    const bool moved =
        !memory.last_sent_m || (pose.position_m - *memory.last_sent_m).norm() >= increment_m || increment_m <= 0.0;
    if (!every && !moved) continue;
    FastrakRecord sent = recordOfPose(station, errorOf(sample, station, pose), pose);
    sent.relative_m = pose.position_m - memory.last_position_m.value_or(pose.position_m);
    memory.last_position_m = memory.last_sent_m = pose.position_m;
    record(written(sent), out);
  }
}

}  // namespace fieldtrue::acquisition
