#pragma once

#include <algorithm>
#include <random>
#include <vector>

#include "calib/identify/rows.h"
#include "calib/simulation/simulator.h"

namespace fieldtrue::testing {

/// A grid of places beside the transmitter, visited in random order unless told otherwise.
struct GapPlan {
  std::array<int, 3> counts{5, 4, 4};
  double pitch_m = 0.2;
  std::vector<Eigen::Quaterniond> orientations{Eigen::Quaterniond::Identity()};  ///< One visit each of every place.
  bool in_random_order = true;
  bool is_scattered = false;  ///< No grid: places drawn evenly over the same volume, without index.
};

/// Sensor orientations that tell the transmitter's coils from the sensor's.
inline std::vector<Eigen::Quaterniond> threeTurns() {
  return {Eigen::Quaterniond::Identity(), rotationFromVector({1.5707963, 0.0, 0.0}),
          rotationFromVector({0.0, 0.0, 1.5707963})};
}

inline std::vector<PlannedPlace> gapPlan(const GapPlan& options = {}, unsigned seed = 1) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<PlannedPlace> plan;
  const auto [ni, nj, nk] = options.counts;
  for (int n = 0; n < ni * nj * nk; ++n) {
    const std::array<int, 3> index{n / (nj * nk), n / nk % nj, n % nk};
    Eigen::Vector3d p_m = options.pitch_m * Eigen::Vector3d(index[0], index[1], index[2]);
    if (options.is_scattered)
      for (std::size_t axis = 0; axis < 3; ++axis)
        p_m[static_cast<Eigen::Index>(axis)] = options.pitch_m * (options.counts[axis] - 1) * uniform(generator);
    int visit = 0;
    for (const Eigen::Quaterniond& q : options.orientations) {
      PlannedPlace place;
      place.node = n;
      place.visit = visit++;
      if (!options.is_scattered) place.index = index;
      place.reference_from_sensor = {p_m, q};
      plan.push_back(place);
    }
  }
  if (options.in_random_order) std::shuffle(plan.begin(), plan.end(), generator);
  return plan;
}

/// A Fastrak-like tracker half a metre beside the grid, turned; a jig of 1 mm and 3 mrad.
inline simulation::Scene gapScene() {
  simulation::Scene scene;
  scene.reference_from_tracker = {{-0.5, 0.35, 0.25}, rotationFromVector({0.05, -0.03, 0.2})};
  scene.rig.tolerance_m = 0.001;
  scene.rig.tolerance_rad = 0.003;
  return scene;
}

inline CalibrationTable recordedIn(const simulation::Scene& scene, const std::vector<PlannedPlace>& plan,
                                   std::uint64_t seed = 1, SampleTable* samples = nullptr) {
  simulation::SimulationOptions options;
  options.seed = seed;
  options.samples_per_node = samples != nullptr ? 60 : 20;
  simulation::Simulation simulation = simulation::simulate(scene, plan, options).value();
  if (samples != nullptr) *samples = std::move(simulation.samples);
  return std::move(simulation.table);
}

/// A transmitter near a corner of the grid, whose coils lean, with a gain that warms up, and a rig 2 % too short.
inline CalibrationTable instrumentErrors() {
  simulation::Scene scene;
  scene.reference_from_tracker.position_m = {-0.003, -0.272, -0.198};
  scene.rig.tolerance_m = 0.002;
  scene.rig.tolerance_rad = 0.005;
  const auto add = [&](const char* id, const char* parameters) {
    scene.effects.push_back({id, nlohmann::json::parse(parameters)});
  };
  add("coil_nonorthogonality", R"({"transmitter_rad": [-0.0061, 0.0129, -0.0031]})");
  add("gain_drift", R"({"amplitude": -0.03, "time_constant_s": 400})");
  add("grid_scale", R"({"scale": [-0.02, -0.02, -0.02]})");
  return recordedIn(scene, gapPlan({.counts = {5, 5, 4}}));
}

}  // namespace fieldtrue::testing
