#include <benchmark/benchmark.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "calib/field/dipole_field.h"
#include "calib/field/pose_solver.h"
#include "calib/simulation/simulator.h"

// Readings per second of the simulated tracker (items_per_second). A real tracker gives 120; a simulated session of 100
// nodes and 60 samples needs 6,000.

namespace {

using namespace fieldtrue;

const Pose kSensor{{1.2, 0.4, -0.3}, Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5)};

/// A room with a floor and the given number of bodies.
simulation::Scene room(int bodies) {
  simulation::Scene scene;
  scene.tracker.correlation = 0.3;
  if (bodies > 0) scene.effects.push_back({"metal_plane", {{"strength", 0.5}}});
  for (int i = 0; i < bodies; ++i) {
    scene.effects.push_back({"compact_metal", {{"center_m", {2.0 + 0.1 * i, 0.5, -1.0}}, {"radius_m", 0.1}}});
  }
  return scene;
}

void measure(benchmark::State& state) {
  simulation::TrackerSimulator tracker =
      std::move(simulation::TrackerSimulator::make(room(static_cast<int>(state.range(0))), 1).value());
  double time_s = 0.0;
  for (auto unused : state) {
    benchmark::DoNotOptimize(tracker.measure(kSensor, time_s));
    time_s += 1.0 / 120.0;
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(measure)->ArgName("bodies")->Arg(0)->Arg(1)->Arg(8);

void solveOnly(benchmark::State& state) {
  const Eigen::Matrix3d S = field::couplings(field::dipoleField(kSensor.position_m, 1.0), kSensor.orientation) +
                            0.01 * Eigen::Matrix3d::Ones();
  for (auto unused : state) benchmark::DoNotOptimize(field::solvePose(S, 1.0, kSensor.position_m));
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(solveOnly);

void recordSession(benchmark::State& state) {
  constexpr int kNodes = 100;
  const simulation::SimulationOptions options;
  std::vector<PlannedPlace> plan(kNodes);
  for (int i = 0; i < kNodes; ++i) {
    plan[static_cast<std::size_t>(i)].node = i;
    plan[static_cast<std::size_t>(i)].reference_from_sensor.position_m = {0.5 + 0.012 * i, 0.2, -0.3};
  }
  const simulation::Scene scene = room(1);
  for (auto unused : state) benchmark::DoNotOptimize(simulation::simulate(scene, plan, options));
  state.SetItemsProcessed(state.iterations() * kNodes * options.samples_per_node);
}
BENCHMARK(recordSession)->Unit(benchmark::kMillisecond);

}  // namespace
