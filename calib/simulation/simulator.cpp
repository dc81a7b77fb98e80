#include "calib/simulation/simulator.h"

#include <map>
#include <optional>

#include "calib/simulation/tracker_physics.h"

namespace fieldtrue::simulation {

namespace {

/// A sensor that went farther than this is on another visit.
constexpr double kSamePlace_m = 0.05;

/// What the simulator remembers of one sensor.
struct SensorMemory {
  field::CouplingNoise noise;
  VisitStream visits;
  Visit visit = {};
  std::optional<Eigen::Vector3d> place_m = std::nullopt;  ///< Where the visit began, rig's frame.

  const Visit& visitAt(const Eigen::Vector3d& p_m) {
    if (!place_m || (p_m - *place_m).norm() > kSamePlace_m) {
      place_m = p_m;
      visit = visits.next();
    }
    return visit;
  }
};

}  // namespace

struct TrackerSimulator::State {
  TrackerPhysics physics;
  std::uint64_t seed = 1;
  std::map<int, SensorMemory> memories;  ///< By sensor.

  SensorMemory& memoryOf(int sensor) {
    const auto found = memories.find(sensor);
    if (found != memories.end()) return found->second;
    SensorMemory fresh{physics.noiseOf(sensor, seed), VisitStream(physics.signal(), seed, sensor)};
    return memories.emplace(sensor, std::move(fresh)).first->second;
  }
};

TrackerSimulator::TrackerSimulator(std::unique_ptr<State> state) : state_(std::move(state)) {}
TrackerSimulator::TrackerSimulator(TrackerSimulator&&) noexcept = default;
TrackerSimulator& TrackerSimulator::operator=(TrackerSimulator&&) noexcept = default;
TrackerSimulator::~TrackerSimulator() = default;

Result<TrackerSimulator> TrackerSimulator::make(const Scene& scene, std::uint64_t seed) {
  FT_TRY(TrackerPhysics physics, TrackerPhysics::make(scene, seed));
  return TrackerSimulator(std::make_unique<State>(State{std::move(physics), seed, {}}));
}

Sample TrackerSimulator::measure(const Pose& reference_from_sensor, double time_s, int sensor) {
  SensorMemory& memory = state_->memoryOf(sensor);
  const StandingSensor standing = state_->physics.standing(reference_from_sensor, std::nullopt, time_s, time_s);
  const Visit& visit = memory.visitAt(reference_from_sensor.position_m);
  return state_->physics.read(standing, visit, time_s, sensor, memory.noise.at(time_s));
}

Sample TrackerSimulator::measureExactly(const Pose& reference_from_sensor, double time_s) const {
  constexpr bool kOnLattice = false;
  const StandingSensor standing = state_->physics.standing(reference_from_sensor, std::nullopt, time_s, time_s);
  return state_->physics.read(standing, Visit{}, time_s, 0, Eigen::Matrix3d::Zero(), kOnLattice);
}

void TrackerSimulator::resetFilter(int sensor) {
  SensorMemory& memory = state_->memoryOf(sensor);
  memory.noise.forget();
  memory.place_m.reset();
}

const Scene& TrackerSimulator::scene() const { return state_->physics.scene(); }

}  // namespace fieldtrue::simulation
