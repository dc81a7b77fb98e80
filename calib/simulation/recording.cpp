#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <set>
#include <utility>

#include "calib/core/file_io.h"
#include "calib/core/place_name.h"
#include "calib/core/statistics.h"
#include "calib/simulation/simulator.h"
#include "calib/simulation/tracker_physics.h"

namespace fieldtrue::simulation {

namespace {

constexpr int kSensor = 0;

/// One visit of the jig before the tracker is read: all that is random, drawn in the order of the plan.
struct Stop {
  const PlannedPlace* place = nullptr;
  Pose reference_from_sensor;  ///< Where the sensor really stands.
  Visit visit;
  std::vector<double> times_s;
  std::vector<Eigen::Matrix3d> noise;
};

/// What one stop gives.
struct Reading {
  std::vector<Sample> samples;
  Result<NodeStatistics> statistics;
};

Result<void> check(std::span<const PlannedPlace> plan, const SimulationOptions& options) {
  const auto is_visited = [](const PlannedPlace& place) { return place.role != NodeRole::kSkipped; };
  if (std::none_of(plan.begin(), plan.end(), is_visited)) {
    return fail(ErrorCode::kBadInput, "The plan holds no place to visit; a simulation needs at least one.");
  }
  if (options.samples_per_node < 1) {
    return fail(ErrorCode::kBadInput,
                "samples_per_node is " + std::to_string(options.samples_per_node) + "; it must be at least 1.");
  }
  if (!std::isfinite(options.travel_s) || options.travel_s < 0.0) {
    return fail(ErrorCode::kBadInput, "travel_s is " + formatNumber(options.travel_s) + "; it must be 0 or more.");
  }
  std::set<std::pair<int, int>> seen;
  for (const PlannedPlace& place : plan) {
    if (!seen.insert({place.node, place.visit}).second) {
      return fail(ErrorCode::kBadInput, "The plan holds node " + std::to_string(place.node) + ", visit " +
                                            std::to_string(place.visit) + " twice; every visit needs its own number.");
    }
  }
  return {};
}

std::vector<Stop> drawStops(const TrackerPhysics& physics, std::span<const PlannedPlace> plan,
                            const SimulationOptions& options) {
  const Scene& scene = physics.scene();
  field::GaussianStream placing(options.seed, static_cast<std::uint32_t>(RandomPurpose::kPlacing));
  field::CouplingNoise noise = physics.noiseOf(kSensor, options.seed);
  VisitStream visits(physics.signal(), options.seed, kSensor);
  std::vector<Stop> stops;
  double now_s = 0.0;
  for (const PlannedPlace& place : plan) {
    if (place.role == NodeRole::kSkipped) continue;
    Stop stop;
    stop.place = &place;
    stop.reference_from_sensor =
        disturbed(place.reference_from_sensor, scene.rig.tolerance_m, scene.rig.tolerance_rad, placing);
    stop.visit = visits.next();
    now_s = std::max(now_s + options.travel_s, place.t_s.value_or(0.0));
    for (int i = 0; i < options.samples_per_node; ++i) {
      stop.times_s.push_back(now_s);
      stop.noise.push_back(noise.at(now_s));
      now_s += 1.0 / scene.tracker.rate_hz;
    }
    stops.push_back(std::move(stop));
  }
  return stops;
}

StandingSensor standingAt(const TrackerPhysics& physics, const Stop& stop) {
  return physics.standing(stop.reference_from_sensor, stop.place->index, stop.times_s.front(), stop.times_s.back());
}

Reading readStop(const TrackerPhysics& physics, const Stop& stop) {
  const StandingSensor sensor = standingAt(physics, stop);
  std::vector<Sample> samples;
  for (std::size_t i = 0; i < stop.times_s.size(); ++i) {
    samples.push_back(physics.read(sensor, stop.visit, stop.times_s[i], kSensor, stop.noise[i]));
  }
  AveragingOptions averaging;
  averaging.quantum_m = physics.scene().tracker.quantum_m;
  Result<NodeStatistics> statistics = averageSamples(samples, averaging);
  return {std::move(samples), std::move(statistics)};
}

std::string metres(double value_m) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g m", value_m);
  return text;
}

Error noPoseError(const TrackerPhysics& physics, const Stop& stop) {
  const StandingSensor sensor = standingAt(physics, stop);
  const TrackerModel& tracker = physics.scene().tracker;
  std::string text = "No pose can be solved at " + placeName(*stop.place) + " (visit " +
                     std::to_string(stop.place->visit) + "), " + metres(sensor.actual.position_m.norm()) +
                     " from the transmitter: ";
  if (const auto metal = physics.metalAround(sensor.actual.position_m)) {
    return {ErrorCode::kUnsupported, text + "it lies inside the metal of " + *metal + " of the scene."};
  }
  const auto solution = physics.solve(sensor, stop.visit, stop.times_s.front(), stop.noise.front());
  text += field::describe(solution ? field::SolveError::kTooWeak : solution.error());
  text += "; this tracker works from " + metres(tracker.nearest_range_m) + " to " + metres(tracker.farthest_range_m) +
          ". Move the place or leave it out of the plan.";
  return {ErrorCode::kUnsupported, text};
}

TableMetadata metadataOf(const Scene& scene, std::uint64_t seed) {
  const TrackerModel& tracker = scene.tracker;
  const RigModel& rig = scene.rig;
  TableMetadata metadata;
  metadata.frame = "jig";
  metadata.tracker = tracker.name;
  metadata.rig = rig.name;
  metadata.excitation = tracker.excitation;
  metadata.transmitter_model = "dipole";
  metadata.rate_hz = tracker.rate_hz;
  if (tracker.excitation == "ac") metadata.carrier_hz = tracker.carrier_hz;
  if (tracker.quantum_m > 0.0) metadata.quantum_m = tracker.quantum_m;
  if (rig.tolerance_m > 0.0) metadata.jig_tolerance_m = rig.tolerance_m;
  if (rig.tolerance_rad > 0.0) metadata.jig_tolerance_rad = rig.tolerance_rad;
  metadata.alignment_known = rig.alignment_known;
  if (rig.alignment_known && rig.alignment_tolerance_m > 0.0) {
    metadata.alignment_tolerance_m = rig.alignment_tolerance_m;
  }
  if (rig.alignment_known && rig.alignment_tolerance_rad > 0.0) {
    metadata.alignment_tolerance_rad = rig.alignment_tolerance_rad;
  }
  metadata.other["scene"] = scene.name;
  metadata.other["seed"] = std::to_string(seed);
  return metadata;
}

Node nodeOf(const Stop& stop) {
  const PlannedPlace& place = *stop.place;
  Node node;
  node.node = place.node;
  node.sensor = kSensor;
  node.visit = place.visit;
  node.index = place.index;
  node.reference_from_sensor = place.reference_from_sensor;
  node.role = place.role;
  node.t_start_s = stop.times_s.front();
  node.t_end_s = stop.times_s.back();
  return node;
}

}  // namespace

Result<Simulation> simulate(const Scene& scene, std::span<const PlannedPlace> plan, const SimulationOptions& options,
                            const RunControl& control) {
  FT_TRY_VOID(check(plan, options));
  FT_TRY(const TrackerPhysics physics, TrackerPhysics::make(scene, options.seed));

  const std::vector<Stop> stops = drawStops(physics, plan, options);
  std::vector<Reading> readings(stops.size());
  std::atomic<std::size_t> n_done = 0;
  control.parallel_for(stops.size(), [&](std::size_t i) {
    if (control.stop.stop_requested()) return;
    readings[i] = readStop(physics, stops[i]);
    control.progress(static_cast<double>(++n_done) / static_cast<double>(stops.size()));
  });
  if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "The simulation was stopped.");

  Simulation simulation;
  simulation.table.metadata = simulation.samples.metadata = metadataOf(scene, options.seed);
  for (std::size_t i = 0; i < stops.size(); ++i) {
    if (!readings[i].statistics) return tl::unexpected<Error>(noPoseError(physics, stops[i]));
    simulation.table.nodes.push_back(nodeOf(stops[i]));
    setStatistics(simulation.table.nodes.back(), *readings[i].statistics);
    for (Sample& sample : readings[i].samples) {
      simulation.samples.rows.push_back({stops[i].place->node, stops[i].place->visit, std::move(sample)});
    }
  }
  return simulation;
}

namespace {

/// The scene without what a seed decides.
Scene withoutChance(Scene scene) {
  scene.rig.tolerance_m = scene.rig.tolerance_rad = 0.0;
  scene.rig.alignment_tolerance_m = scene.rig.alignment_tolerance_rad = 0.0;
  return scene;
}

}  // namespace

Result<CalibrationTable> simulateExactly(const Scene& scene, std::span<const PlannedPlace> plan,
                                         const SimulationOptions& options, const RunControl& control) {
  FT_TRY_VOID(check(plan, options));
  FT_TRY(const TrackerPhysics physics, TrackerPhysics::make(withoutChance(scene), options.seed));
  SimulationOptions one_reading = options;
  one_reading.samples_per_node = 1;
  std::vector<Stop> stops = drawStops(physics, plan, one_reading);
  CalibrationTable table;
  table.metadata = metadataOf(scene, options.seed);
  for (Stop& stop : stops) {
    if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "The simulation was stopped.");
    stop.times_s = {stop.place->t_s.value_or(stop.times_s.front())};
    stop.noise = {Eigen::Matrix3d::Zero()};
    stop.visit = {};
    constexpr bool kOnLattice = false;
    const Sample sample = physics.read(standingAt(physics, stop), stop.visit, stop.times_s.front(), kSensor,
                                       stop.noise.front(), kOnLattice);
    if (!sample.status.empty()) return tl::unexpected<Error>(noPoseError(physics, stop));
    table.nodes.push_back(nodeOf(stop));
    table.nodes.back().tracker_from_sensor = sample.tracker_from_sensor;
  }
  return table;
}

}  // namespace fieldtrue::simulation
