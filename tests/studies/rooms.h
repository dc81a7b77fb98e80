#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/calibration/alignment.h"
#include "calib/calibration/corrector.h"
#include "calib/field/coupling_noise.h"
#include "calib/simulation/simulator.h"

namespace fieldtrue::testing {

/// The rooms of resources/rooms, from the easiest to the hardest.
inline const std::array<std::string, 6> kRooms = {"clean",      "steel_floor", "steel_bar",
                                                  "two_bodies", "copper_loop", "mixed"};

inline constexpr double kRoomPitch_m = 0.3048;
inline const std::array<int, 3> kRoomCounts = {9, 9, 7};

/// Throws what a Result failed with: a study or a test has no better answer.
template <class T>
T orThrow(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return *std::move(result);
}

/// @param resources folder of the shipped resources
inline simulation::Scene readRoom(const std::filesystem::path& resources, const std::string& room) {
  return orThrow(simulation::readScene(resources / "rooms" / (room + ".scene.json")));
}

/// A calibration recorded in a room, and exact readings at the same validation places.
struct RoomRecording {
  CalibrationTable table;       ///< Rows to fit and, marked as validation, rows at the places off the grid.
  std::vector<Node> fit_nodes;  ///< The table's rows to fit.
  std::vector<Node>
      validation_nodes;           ///< The table's validation rows: placed with the jig's tolerance, read with noise.
  std::vector<Node> exact_nodes;  ///< The same places met exactly and read without noise.
};

/// Records every `stride`th node of the 9x9x7 grid at 1 ft, and validation places spread evenly over its volume.
inline RoomRecording recordRoom(const simulation::Scene& scene, std::uint64_t seed, int n_validation = 200,
                                int stride = 1) {
  std::vector<PlannedPlace> plan;
  for (int i = 0; i < kRoomCounts[0]; i += stride)
    for (int j = 0; j < kRoomCounts[1]; j += stride)
      for (int k = 0; k < kRoomCounts[2]; k += stride) {
        PlannedPlace place;
        place.node = static_cast<int>(plan.size());
        place.index = {i / stride, j / stride, k / stride};
        place.reference_from_sensor.position_m = kRoomPitch_m * Eigen::Vector3d(i, j, k);
        plan.push_back(place);
      }
  constexpr std::uint32_t kValidationPlaces = 77;
  field::GaussianStream stream(seed, kValidationPlaces);
  const auto uniform = [&stream] { return 0.5 * std::erfc(-stream.next() / std::sqrt(2.0)); };
  for (int v = 0; v < n_validation; ++v) {
    PlannedPlace place;
    place.node = static_cast<int>(plan.size());
    for (int axis = 0; axis < 3; ++axis)
      place.reference_from_sensor.position_m[axis] =
          kRoomPitch_m * (kRoomCounts[static_cast<std::size_t>(axis)] - 1) * uniform();
    place.role = NodeRole::kValidation;
    plan.push_back(place);
  }
  simulation::SimulationOptions options;
  options.seed = seed;
  RoomRecording recording;
  recording.table = orThrow(simulation::simulate(scene, plan, options)).table;
  const simulation::TrackerSimulator tracker = orThrow(simulation::TrackerSimulator::make(scene, seed));
  for (const Node& node : recording.table.nodes) {
    if (node.role == NodeRole::kFit) {
      recording.fit_nodes.push_back(node);
      continue;
    }
    recording.validation_nodes.push_back(node);
    Node exact = node;
    exact.tracker_from_sensor = tracker.measureExactly(node.reference_from_sensor, 0.0).tracker_from_sensor;
    recording.exact_nodes.push_back(exact);
  }
  return recording;
}

/// RMS distance of corrected and true positions, reference frame [mm].
inline double roomRms_mm(const correctors::PositionModel& model, const calibration::Alignment& alignment,
                         const std::vector<Node>& nodes) {
  double sum_m2 = 0.0;
  for (const Node& node : nodes) {
    const Eigen::Vector3d& p_m = node.tracker_from_sensor.position_m;
    const Eigen::Vector3d corrected_m = model.covers(p_m) ? Eigen::Vector3d(p_m + model.displacement_m(p_m)) : p_m;
    sum_m2 += (alignment.reference_from_tracker * corrected_m - node.reference_from_sensor.position_m).squaredNorm();
  }
  return 1000.0 * std::sqrt(sum_m2 / static_cast<double>(nodes.size()));
}

/// The place whose exact reading is the one given, by Newton's method on the simulator itself.
inline Eigen::Vector3d placeOfReading_m(const simulation::TrackerSimulator& tracker, const Eigen::Vector3d& p_tracked_m,
                                        const Eigen::Vector3d& start_m) {
  const auto read_m = [&tracker](const Eigen::Vector3d& p_m) {
    return tracker.measureExactly({p_m, Eigen::Quaterniond::Identity()}, 0.0).tracker_from_sensor.position_m;
  };
  constexpr double kStep_m = 1e-4;
  Eigen::Vector3d p_m = start_m;
  for (int i = 0; i < 8; ++i) {
    Eigen::Matrix3d jacobian;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step_m = kStep_m * Eigen::Vector3d::Unit(axis);
      jacobian.col(axis) = (read_m(p_m + step_m) - read_m(p_m - step_m)) / (2.0 * kStep_m);
    }
    p_m += jacobian.inverse() * (p_tracked_m - read_m(p_m));
  }
  return p_m;
}

/// What no method can go below in exact truth: the room's physics known entirely, and only the alignment of rig and
/// tracker found from the same nodes [mm].
inline double knownPhysicsRms_mm(const simulation::Scene& scene, const RoomRecording& recording, std::uint64_t seed) {
  const simulation::TrackerSimulator tracker = orThrow(simulation::TrackerSimulator::make(scene, seed));
  std::vector<Eigen::Vector3d> stood_m;
  std::vector<Eigen::Vector3d> planned_m;
  for (const Node& node : recording.fit_nodes) {
    planned_m.push_back(node.reference_from_sensor.position_m);
    stood_m.push_back(placeOfReading_m(tracker, node.tracker_from_sensor.position_m, planned_m.back()));
  }
  const Pose planned_from_stood = orThrow(fitRigid(stood_m, planned_m));
  double sum_m2 = 0.0;
  for (const Node& node : recording.exact_nodes) {
    const Eigen::Vector3d& p_m = node.reference_from_sensor.position_m;
    sum_m2 += (planned_from_stood * p_m - p_m).squaredNorm();
  }
  return 1000.0 * std::sqrt(sum_m2 / static_cast<double>(recording.exact_nodes.size()));
}

}  // namespace fieldtrue::testing
