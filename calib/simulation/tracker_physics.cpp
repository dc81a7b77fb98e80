#include "calib/simulation/tracker_physics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/effects/registry.h"
#include "calib/field/tracker_model.h"

namespace fieldtrue::simulation {

namespace {

constexpr const char* kTooWeakStatus = "k";
constexpr const char* kSaturatedStatus = "j";
/// Mains run up to so much ahead: many periods of any line, so that its phase is as good as random.
constexpr double kMainsLead_s = 10.0;

const char* statusOf(field::SolveError error) {
  const bool is_strong = error == field::SolveError::kSaturated || error == field::SolveError::kNotFinite;
  return is_strong ? kSaturatedStatus : kTooWeakStatus;
}

Eigen::Vector3d onLattice(const Eigen::Vector3d& value, double quantum) {
  if (quantum <= 0.0) return value;
  return (value / quantum).array().round() * quantum;
}

Eigen::Quaterniond onLattice(const Eigen::Quaterniond& rotation, double quantum_rad) {
  if (quantum_rad <= 0.0) return rotation;
  return rotationFromVector(onLattice(rotationVector_rad(rotation), quantum_rad));
}

bool isSame(const Pose& a, const Pose& b) {
  return a.position_m == b.position_m && a.orientation.coeffs() == b.orientation.coeffs();
}

}  // namespace

Pose disturbed(const Pose& pose, double sd_m, double sd_rad, field::GaussianStream& stream) {
  const Eigen::Vector3d shift_m = sd_m * stream.nextVector();
  const Eigen::Vector3d turn_rad = sd_rad * stream.nextVector();
  return {pose.position_m + shift_m, (pose.orientation * rotationFromVector(turn_rad)).normalized()};
}

VisitStream::VisitStream(const field::SignalModel& signal, std::uint64_t seed, int sensor)
    : stream_(seed, static_cast<std::uint32_t>(RandomPurpose::kVisits), static_cast<std::uint32_t>(sensor)),
      flip_probability_(signal.flip_probability) {}

Visit VisitStream::next() {
  // A standard normal number's own distribution function makes it uniform.
  const auto uniform = [this] { return 0.5 * std::erfc(-stream_.next() / std::numbers::sqrt2); };
  const double flip = uniform();
  return {flip < flip_probability_, kMainsLead_s * uniform()};
}

Result<TrackerPhysics> TrackerPhysics::make(const Scene& scene, std::uint64_t seed) {
  TrackerPhysics physics;
  physics.scene_ = scene;
  physics.limits_ = {scene.tracker.nearest_range_m, scene.tracker.farthest_range_m};
  const std::optional<field::PoseSolver> solver = field::poseSolverNamed(scene.tracker.solver);
  if (!solver) {
    return fail(ErrorCode::kBadInput, "Scene " + scene.name + ": the tracker's solver is \"" + scene.tracker.solver +
                                          "\"; it must be \"closed_form\", \"least_squares\" or \"damped\".");
  }
  physics.solver_ = *solver;
  physics.signal_.correlation = scene.tracker.correlation;
  physics.signal_.quantum_m = scene.tracker.quantum_m;
  for (std::size_t i = 0; i < scene.effects.size(); ++i) {
    auto effect = effects::makeEffect(scene.effects[i].id, scene.effects[i].parameters, excitationOf(scene.tracker));
    if (!effect) {
      return fail(effect.error().code,
                  "Scene " + scene.name + ", effect " + std::to_string(i + 1) + ": " + effect.error().message);
    }
    (*effect)->disturb(physics.signal_);
    physics.effects_.push_back(std::move(*effect));
  }
  Pose reference_from_tracker = scene.reference_from_tracker;
  if (scene.rig.alignment_known) {
    field::GaussianStream stream(seed, static_cast<std::uint32_t>(RandomPurpose::kAlignment));
    reference_from_tracker =
        disturbed(reference_from_tracker, scene.rig.alignment_tolerance_m, scene.rig.alignment_tolerance_rad, stream);
  }
  physics.tracker_from_reference_ = inverse(reference_from_tracker);
  return physics;
}

StandingSensor TrackerPhysics::standing(const Pose& reference_from_sensor,
                                        const std::optional<std::array<int, 3>>& index, double first_s,
                                        double last_s) const {
  StandingSensor sensor;
  sensor.stated = {tracker_from_reference_ * reference_from_sensor * scene_.mount_from_sensor, tracker_from_reference_,
                   index, first_s, reference_from_sensor.position_m};
  std::vector<field::EffectResponse> responses;
  field::EffectResponse sum;
  for (const auto& effect : effects_) {
    responses.push_back(effect->at(sensor.stated));
    field::add(responses.back(), 1.0, sum);
  }
  sensor.actual = field::displaced(sensor.stated.tracker_from_sensor, sum);
  const bool is_displaced = !isSame(sensor.actual, sensor.stated.tracker_from_sensor);
  sensor.field_per_m3.resize(effects_.size());
  for (std::size_t i = 0; i < effects_.size(); ++i) {
    const Eigen::Matrix3d first = is_displaced ? changeAt(i, sensor, first_s).field_per_m3 : responses[i].field_per_m3;
    if (first_s == last_s || first == changeAt(i, sensor, last_s).field_per_m3) sensor.field_per_m3[i] = first;
  }
  return sensor;
}

field::EffectResponse TrackerPhysics::changeAt(std::size_t effect, const StandingSensor& sensor, double time_s) const {
  field::SensorSetting setting = sensor.stated;
  setting.tracker_from_sensor = sensor.actual;
  setting.time_s = time_s;
  return effects_[effect]->at(setting);
}

Eigen::Matrix3d TrackerPhysics::couplingsAt(const StandingSensor& sensor, const Visit& visit, double time_s) const {
  const double C = scene_.tracker.dipole_constant_m3;
  Eigen::Matrix3d field = field::dipoleField(sensor.actual.position_m, C);
  Eigen::Matrix3d picked_up = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < effects_.size(); ++i) {
    const auto& known = sensor.field_per_m3[i];
    field += C * (known ? *known : changeAt(i, sensor, time_s).field_per_m3);
    picked_up += C * effects_[i]->interference_per_m3(time_s + visit.mains_lead_s);
  }
  return field::couplings(field, sensor.actual.orientation) + picked_up;
}

tl::expected<field::PoseSolution, field::SolveError> TrackerPhysics::solve(const StandingSensor& sensor,
                                                                           const Visit& visit, double time_s,
                                                                           const Eigen::Matrix3d& noise) const {
  const Eigen::Vector3d& p_m = sensor.actual.position_m;
  if (p_m.isZero(0.0)) return tl::make_unexpected(field::SolveError::kSaturated);
  for (const auto& effect : effects_) {
    if (!effect->admits(p_m)) return tl::make_unexpected(field::SolveError::kTooWeak);
  }
  const double growth =
      signal_.noise_range_power == 0.0 ? 1.0 : std::pow(std::max(p_m.norm(), 1e-3), signal_.noise_range_power);
  const Eigen::Vector3d last_m = visit.is_flipped ? Eigen::Vector3d(-p_m) : p_m;
  return field::solvePose(solver_, couplingsAt(sensor, visit, time_s) + growth * noise,
                          scene_.tracker.dipole_constant_m3, last_m, limits_);
}

Sample TrackerPhysics::read(const StandingSensor& sensor, const Visit& visit, double time_s, int sensor_number,
                            const Eigen::Matrix3d& noise, bool on_lattice) const {
  Sample sample;
  sample.time_s = time_s;
  sample.sensor = sensor_number;
  const auto solution = solve(sensor, visit, time_s, noise);
  if (!solution) {
    sample.status = statusOf(solution.error());
    return sample;
  }
  sample.tracker_from_sensor = solution->tracker_from_sensor;
  if (on_lattice) {
    Pose& reported = sample.tracker_from_sensor;
    reported.position_m = onLattice(reported.position_m, signal_.quantum_m);
    reported.orientation = onLattice(reported.orientation, signal_.quantum_rad);
  }
  return sample;
}

field::CouplingNoise TrackerPhysics::noiseOf(int sensor, std::uint64_t seed) const {
  const TrackerModel& tracker = scene_.tracker;
  return field::CouplingNoise({tracker.coupling_noise * signal_.noise_factor, signal_.correlation, tracker.rate_hz},
                              seed, static_cast<std::uint32_t>(RandomPurpose::kCouplings),
                              static_cast<std::uint32_t>(sensor));
}

std::optional<std::string> TrackerPhysics::metalAround(const Eigen::Vector3d& p_sensor_m) const {
  for (std::size_t i = 0; i < effects_.size(); ++i) {
    if (!effects_[i]->admits(p_sensor_m)) {
      return "effect " + std::to_string(i + 1) + " (" + scene_.effects[i].id + ")";
    }
  }
  return std::nullopt;
}

}  // namespace fieldtrue::simulation
