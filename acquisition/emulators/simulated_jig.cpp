#include "acquisition/emulators/simulated_jig.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace fieldtrue::acquisition {
namespace {

constexpr double kLift_m = 0.03;
constexpr double kStill_m = 1e-6;

/// Smooth start and stop: position along the way for a time in [0, 1] with least jerk.
/// @source Flash and Hogan 1985, eq. 5
double minimumJerk(double t) { return t * t * t * (10.0 - 15.0 * t + 6.0 * t * t); }

Pose restingPose(const simulation::Scene& scene) {
  constexpr double kInFront_m = 0.3;
  return scene.reference_from_tracker * Pose{Eigen::Vector3d(kInFront_m, 0.0, 0.0), Eigen::Quaterniond::Identity()};
}

}  // namespace

VirtualOperator::VirtualOperator(const simulation::RigModel& rig, const OperatorHabits& habits, const Pose& resting,
                                 std::uint64_t seed)
    : rig_(rig), habits_(habits), random_(seed), asked_(resting), from_(resting), to_(resting) {
  std::uniform_real_distribution<double> turn(0.0, 2.0 * std::numbers::pi);
  for (double& phase : phase_) phase = turn(random_);
}

Pose VirtualOperator::placed(const Pose& place) {
  std::normal_distribution<double> normal;
  Eigen::Vector3d offset_m, turn_rad;
  for (double& x : offset_m) x = rig_.tolerance_m * normal(random_);
  for (double& x : turn_rad) x = rig_.tolerance_rad * normal(random_);
  return {place.position_m + offset_m, place.orientation * rotationFromVector(turn_rad)};
}

void VirtualOperator::guideTo(const Pose& place, double time_s) {
  const bool same = (place.position_m - asked_.position_m).norm() < 1e-9 &&
                    angleBetween_rad(place.orientation, asked_.orientation) < 1e-9;
  if (moved_ && same && time_s < start_s_ + habits_.travel_s) return;
  from_ = poseAt(time_s);
  to_ = placed(place);
  relifted_ = moved_ && same;
  asked_ = place;
  start_s_ = time_s;
  moved_ = true;
}

Pose VirtualOperator::poseAt(double time_s) const {
  const double elapsed_s = time_s - start_s_;
  const double along = habits_.travel_s > 0.0 ? std::clamp(elapsed_s / habits_.travel_s, 0.0, 1.0) : 1.0;
  const double s = minimumJerk(along);
  Pose pose{from_.position_m + s * (to_.position_m - from_.position_m), from_.orientation.slerp(s, to_.orientation)};
  if (relifted_) pose.position_m.z() += kLift_m * 4.0 * s * (1.0 - s);
  if (!moved_) return pose;
  const double held_s = std::max(0.0, elapsed_s - habits_.travel_s);
  const double strength = std::min(1.0, 4.0 * along) * std::exp(-held_s / habits_.settle_s);
  if (strength * habits_.tremor_m < kStill_m) return pose;
  const double w = 2.0 * std::numbers::pi * habits_.tremor_hz * time_s;
  Eigen::Vector3d shake, twist;
  for (int i = 0; i < 3; ++i) {
    shake[i] = std::sin(w * (1.0 + 0.13 * i) + phase_[i]);
    twist[i] = std::sin(w * (1.1 + 0.17 * i) + phase_[i + 3]);
  }
  pose.position_m += strength * habits_.tremor_m * shake;
  pose.orientation = pose.orientation * rotationFromVector(strength * habits_.tremor_rad * twist);
  return pose;
}

bool VirtualOperator::standing(double time_s) const {
  const double held_s = time_s - start_s_ - habits_.travel_s;
  return !moved_ || (held_s >= 0.0 && std::exp(-held_s / habits_.settle_s) * habits_.tremor_m < kStill_m);
}

SimulatedJig::SimulatedJig(simulation::TrackerSimulator simulator, const OperatorHabits& habits, std::uint64_t seed,
                           int sensors)
    : simulator_(std::move(simulator)),
      operator_(simulator_.scene().rig, habits, restingPose(simulator_.scene()), seed),
      sensors_(sensors),
      leg_s_(habits.travel_s + stand_s_) {
  FT_CHECK(sensors_ >= 1 && sensors_ <= static_cast<int>(kMostSensors));
}

unsigned SimulatedJig::sensors() const { return static_cast<unsigned>((std::uint64_t{1} << sensors_) - 1u); }

void SimulatedJig::guideTo(const Pose& reference_from_sensor, double time_s) {
  tour_.clear();
  operator_.guideTo(reference_from_sensor, time_s);
}

void SimulatedJig::wander(std::vector<Pose> places, double stand_s) {
  tour_ = std::move(places);
  leg_s_ += stand_s - stand_s_;
  stand_s_ = stand_s;
}

void SimulatedJig::walk(double time_s) {
  if (tour_.empty() || time_s < static_cast<double>(next_stop_) * leg_s_) return;
  next_stop_ = static_cast<std::size_t>(time_s / leg_s_) + 1;
  operator_.guideTo(tour_[(next_stop_ - 1) % tour_.size()], time_s);
}

std::optional<double> SimulatedJig::due_s(std::uint64_t cycle, int active) const {
  return static_cast<double>(cycle) * active / scene().tracker.rate_hz;
}

std::vector<Sample> SimulatedJig::read(std::uint64_t, std::span<const int> sensors, double time_s) {
  return readNow(sensors, time_s);
}

std::vector<Sample> SimulatedJig::readNow(std::span<const int> sensors, double time_s) {
  constexpr double kApart_m = 0.04;
  walk(time_s);
  const Pose reference_from_jig = operator_.poseAt(time_s);
  std::vector<Sample> samples;
  for (const int sensor : sensors) {
    if (sensor >= sensors_) continue;
    const Pose jig_from_sensor{{0.0, kApart_m * sensor, 0.0}, Eigen::Quaterniond::Identity()};
    samples.push_back(simulator_.measure(reference_from_jig * jig_from_sensor, time_s, sensor));
  }
  return samples;
}

}  // namespace fieldtrue::acquisition
