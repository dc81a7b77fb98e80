#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/field/coupling.h"
#include "calib/field/effect.h"
#include "calib/field/coupling_noise.h"
#include "calib/field/pose_solver.h"
#include "calib/simulation/scene.h"

namespace fieldtrue {

/// What turns a true pose and noise into a reading. Immutable and without memory: readings may be taken in any order,
/// on any thread.
class TrackerPhysics {
 public:
  /// @param seed decides where in its tolerance the transmitter really stands
  /// @error kBadInput for an unknown effect or bad parameters
  static Result<TrackerPhysics> make(const Scene& scene, std::uint64_t seed);

  /// Where the sensor truly is, as seen from the transmitter.
  Pose trackerFromSensor(const Pose& reference_from_sensor) const;

  /// Solves the distorted couplings and the noise under the undistorted model. The hemisphere is the one the sensor is
  /// truly in: a tracker that follows the sensor without a break knows it.
  tl::expected<PoseSolution, SolveError> solve(const Pose& tracker_from_sensor, double time_s,
                                               const Eigen::Matrix3d& noise) const;

  /// A reading with its status (Fastrak letters: k too weak, j saturated) and, unless told otherwise, on the lattice.
  Sample read(const Pose& reference_from_sensor, double time_s, int sensor, const Eigen::Matrix3d& noise,
              bool on_lattice = true) const;

  /// Noise of one sensor, independent of the other sensors'.
  CouplingNoise noiseOf(int sensor, std::uint64_t seed) const;

  /// The effect inside whose metal a sensor would be: "effect 2 (metal_plane)".
  std::optional<std::string> metalAround(const Eigen::Vector3d& p_sensor_m) const;

  const Scene& scene() const { return scene_; }

 private:
  TrackerPhysics() = default;
  Scene scene_;
  Pose tracker_from_reference_;
  SolverLimits limits_;
  std::vector<std::unique_ptr<PhysicalEffect>> distortions_;
};

/// What the random streams of one seed are for.
enum class RandomPurpose : std::uint32_t { kCouplings = 1, kPlacing = 2, kAlignment = 3 };

/// A pose off by a normal error: position per axis of the outer frame, rotation per axis of the inner one.
Pose disturbed(const Pose& pose, double sd_m, double sd_rad, GaussianStream& stream);

}  // namespace fieldtrue
