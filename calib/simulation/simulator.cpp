#include "calib/simulation/simulator.h"

#include <map>

#include "calib/simulation/tracker_physics.h"

namespace fieldtrue {

struct TrackerSimulator::State {
  TrackerPhysics physics;
  std::uint64_t seed = 1;
  std::map<int, CouplingNoise> noise;  ///< By sensor.

  CouplingNoise& noiseOf(int sensor) {
    const auto found = noise.find(sensor);
    return found != noise.end() ? found->second : noise.emplace(sensor, physics.noiseOf(sensor, seed)).first->second;
  }
};

TrackerSimulator::TrackerSimulator(std::unique_ptr<State> state) : state_(std::move(state)) {}
TrackerSimulator::TrackerSimulator(TrackerSimulator&&) noexcept = default;
TrackerSimulator& TrackerSimulator::operator=(TrackerSimulator&&) noexcept = default;
TrackerSimulator::~TrackerSimulator() = default;

Result<TrackerSimulator> TrackerSimulator::make(const Scene& scene, std::uint64_t seed) {
  Result<TrackerPhysics> physics = TrackerPhysics::make(scene, seed);
  if (!physics) return tl::unexpected<Error>(physics.error());
  return TrackerSimulator(std::unique_ptr<State>(new State{std::move(*physics), seed, {}}));
}

Sample TrackerSimulator::measure(const Pose& reference_from_sensor, double time_s, int sensor) {
  const Eigen::Matrix3d noise = state_->noiseOf(sensor).at(time_s);
  return state_->physics.read(reference_from_sensor, time_s, sensor, noise);
}

Sample TrackerSimulator::measureExactly(const Pose& reference_from_sensor, double time_s) const {
  constexpr bool kOnLattice = false;
  return state_->physics.read(reference_from_sensor, time_s, 0, Eigen::Matrix3d::Zero(), kOnLattice);
}

void TrackerSimulator::resetFilter(int sensor) { state_->noiseOf(sensor).forget(); }

const Scene& TrackerSimulator::scene() const { return state_->physics.scene(); }

}  // namespace fieldtrue
