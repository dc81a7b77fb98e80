#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/run_control.h"
#include "calib/simulation/scene.h"

namespace fieldtrue::simulation {

/// A tracker in a scene: distorts the couplings by the scene's physics, adds noise, and solves for the pose under the
/// undistorted model, as a tracker does. One object is one tracker's life (its filter and noise have memory); seeded.
/// The filter acts on the noise and does not lag behind motion; the hemisphere follows the sensor. What an effect draws
/// anew on every visit (a lost hemisphere, the phase of the mains) is drawn when the sensor has moved by 5 cm.
class TrackerSimulator {
 public:
  /// @error kBadInput for an unknown effect or bad parameters
  static Result<TrackerSimulator> make(const Scene& scene, std::uint64_t seed);
  TrackerSimulator(TrackerSimulator&&) noexcept;
  TrackerSimulator& operator=(TrackerSimulator&&) noexcept;
  ~TrackerSimulator();

  /// One reading. The sample's status is set (Fastrak letters: k too weak, j saturated) when no pose can be solved.
  /// @param reference_from_sensor true pose in the rig's frame
  Sample measure(const Pose& reference_from_sensor, double time_s, int sensor = 0);

  /// The reading without noise, filter, quantum and what differs from visit to visit.
  Sample measureExactly(const Pose& reference_from_sensor, double time_s) const;

  /// Forgets the filter's memory and the visit: the sensor was somewhere else in between.
  void resetFilter(int sensor);

  const Scene& scene() const;

 private:
  struct State;
  explicit TrackerSimulator(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

struct SimulationOptions {
  std::uint64_t seed = 1;
  int samples_per_node = 60;
  double travel_s = 5.0;  ///< Between two places; a place whose plan states a later time waits for it.
};

struct Simulation {
  CalibrationTable table;
  SampleTable samples;
};

/// Records a plan in a scene with sensor 0: places the jig with its tolerance, takes the samples, averages each node.
/// Places with role skipped are passed over. The result depends on the seed only, never on `parallel_for`.
/// The table's truth is the planned pose (what the rig says), not where the jig really stood.
/// @error kBadInput; kUnsupported when a place gives no usable reading (named); kCancelled
Result<Simulation> simulate(const Scene& scene, std::span<const PlannedPlace> plan, const SimulationOptions& options,
                            const RunControl& control = {});

/// What the tracker would report of a plan without noise, filter, quantum and what differs from visit to visit, the jig
/// standing exactly where its drawing says: one reading a place, no scatter stated.
/// @error as `simulate`
Result<CalibrationTable> simulateExactly(const Scene& scene, std::span<const PlannedPlace> plan,
                                         const SimulationOptions& options, const RunControl& control = {});

}  // namespace fieldtrue::simulation
