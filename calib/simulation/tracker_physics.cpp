#include "calib/simulation/tracker_physics.h"

#include <cmath>

#include "calib/effects/registry.h"

namespace fieldtrue {

namespace {

constexpr const char* kTooWeakStatus = "k";
constexpr const char* kSaturatedStatus = "j";

const char* statusOf(SolveError error) {
  const bool is_strong = error == SolveError::kSaturated || error == SolveError::kNotFinite;
  return is_strong ? kSaturatedStatus : kTooWeakStatus;
}

Eigen::Vector3d onLattice(const Eigen::Vector3d& p_m, double quantum_m) {
  if (quantum_m <= 0.0) return p_m;
  return (p_m / quantum_m).array().round() * quantum_m;
}

}  // namespace

Pose disturbed(const Pose& pose, double sd_m, double sd_rad, GaussianStream& stream) {
  const Eigen::Vector3d shift_m = sd_m * stream.nextVector();
  const Eigen::Vector3d turn_rad = sd_rad * stream.nextVector();
  return {pose.position_m + shift_m, (pose.orientation * rotationFromVector(turn_rad)).normalized()};
}

Result<TrackerPhysics> TrackerPhysics::make(const Scene& scene, std::uint64_t seed) {
  TrackerPhysics physics;
  physics.scene_ = scene;
  physics.limits_ = {scene.tracker.nearest_range_m, scene.tracker.farthest_range_m};
  for (std::size_t i = 0; i < scene.effects.size(); ++i) {
    auto distortion = makeEffect(scene.effects[i].id, scene.effects[i].parameters);
    if (!distortion) {
      return fail(distortion.error().code,
                  "Scene " + scene.name + ", effect " + std::to_string(i + 1) + ": " + distortion.error().message);
    }
    physics.distortions_.push_back(std::move(*distortion));
  }
  Pose reference_from_tracker = scene.reference_from_tracker;
  if (scene.rig.alignment_known) {
    GaussianStream stream(seed, static_cast<std::uint32_t>(RandomPurpose::kAlignment));
    reference_from_tracker =
        disturbed(reference_from_tracker, scene.rig.alignment_tolerance_m, scene.rig.alignment_tolerance_rad, stream);
  }
  physics.tracker_from_reference_ = inverse(reference_from_tracker);
  return physics;
}

Pose TrackerPhysics::trackerFromSensor(const Pose& reference_from_sensor) const {
  return tracker_from_reference_ * reference_from_sensor;
}

tl::expected<PoseSolution, SolveError> TrackerPhysics::solve(const Pose& tracker_from_sensor, double time_s,
                                                             const Eigen::Matrix3d& noise) const {
  const Eigen::Vector3d& p_m = tracker_from_sensor.position_m;
  const double C = scene_.tracker.dipole_constant_m3;
  const SensorSetting setting{tracker_from_sensor, tracker_from_reference_, std::nullopt, time_s};
  Eigen::Matrix3d field = dipoleField(p_m, C);
  for (const auto& distortion : distortions_) {
    if (!distortion->admits(p_m)) return tl::make_unexpected(SolveError::kTooWeak);
    field += C * distortion->at(setting).field_per_m3;
  }
  return solvePose(couplings(field, tracker_from_sensor.orientation) + noise, C, p_m, limits_);
}

Sample TrackerPhysics::read(const Pose& reference_from_sensor, double time_s, int sensor, const Eigen::Matrix3d& noise,
                            bool on_lattice) const {
  Sample sample;
  sample.time_s = time_s;
  sample.sensor = sensor;
  const auto solution = solve(trackerFromSensor(reference_from_sensor), time_s, noise);
  if (!solution) {
    sample.status = statusOf(solution.error());
    return sample;
  }
  sample.tracker_from_sensor = solution->tracker_from_sensor;
  if (on_lattice) {
    sample.tracker_from_sensor.position_m = onLattice(sample.tracker_from_sensor.position_m, scene_.tracker.quantum_m);
  }
  return sample;
}

CouplingNoise TrackerPhysics::noiseOf(int sensor, std::uint64_t seed) const {
  const TrackerModel& tracker = scene_.tracker;
  return CouplingNoise({tracker.coupling_noise, tracker.correlation, tracker.rate_hz}, seed,
                       static_cast<std::uint32_t>(RandomPurpose::kCouplings), static_cast<std::uint32_t>(sensor));
}

std::optional<std::string> TrackerPhysics::metalAround(const Eigen::Vector3d& p_sensor_m) const {
  for (std::size_t i = 0; i < distortions_.size(); ++i) {
    if (!distortions_[i]->admits(p_sensor_m)) {
      return "effect " + std::to_string(i + 1) + " (" + scene_.effects[i].id + ")";
    }
  }
  return std::nullopt;
}

}  // namespace fieldtrue
