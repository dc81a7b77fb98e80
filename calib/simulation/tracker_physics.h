#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/field/coupling_noise.h"
#include "calib/field/dipole_field.h"
#include "calib/field/effect.h"
#include "calib/field/pose_solver.h"
#include "calib/simulation/scene.h"

namespace fieldtrue::simulation {

/// What stays during one visit of a place and is another on the next.
struct Visit {
  bool is_flipped = false;    ///< The tracker lost its hemisphere and reports -p.
  double mains_lead_s = 0.0;  ///< Of the mains' clock before the session's.
};

/// A sensor that stands still for a while, and what effects change there meanwhile.
struct StandingSensor {
  field::SensorSetting stated;  ///< Where the jig put it, and when the while begins.
  Pose actual;                  ///< tracker_from_sensor after the effects' shifts and turns.
  /// Of each effect the change of the field for C = 1 [1/m^3]; none where it changes meanwhile.
  std::vector<std::optional<Eigen::Matrix3d>> field_per_m3;
};

/// What turns a true pose and noise into a reading. Immutable and without memory: readings may be taken in any order,
/// on any thread.
class TrackerPhysics {
 public:
  /// @param seed decides where in its tolerance the transmitter really stands
  /// @error kBadInput for an unknown solver or effect or bad parameters
  static Result<TrackerPhysics> make(const Scene& scene, std::uint64_t seed);

  /// @param index the place's, where it is one of a grid
  /// @param last_s end of the while it stands there; effects that answer alike at both ends are taken as constant
  StandingSensor standing(const Pose& reference_from_sensor, const std::optional<std::array<int, 3>>& index,
                          double first_s, double last_s) const;

  /// Solves the distorted couplings and the noise under the undistorted model. The hemisphere is the one the sensor is
  /// truly in, unless the visit is flipped: a tracker that follows the sensor without a break knows it. A damped solver
  /// is held back towards the true place.
  /// @param noise as `noiseOf` gives it
  tl::expected<field::PoseSolution, field::SolveError> solve(const StandingSensor& sensor, const Visit& visit,
                                                             double time_s, const Eigen::Matrix3d& noise) const;

  /// A reading with its status (Fastrak letters: k too weak, j saturated) and, unless told otherwise, on the lattice.
  Sample read(const StandingSensor& sensor, const Visit& visit, double time_s, int sensor_number,
              const Eigen::Matrix3d& noise, bool on_lattice = true) const;

  /// Noise of one sensor's couplings at 1 m, independent of the other sensors'.
  field::CouplingNoise noiseOf(int sensor, std::uint64_t seed) const;

  /// The effect inside whose metal a sensor would be: "effect 2 (metal_plane)".
  std::optional<std::string> metalAround(const Eigen::Vector3d& p_sensor_m) const;

  const Scene& scene() const { return scene_; }
  const field::SignalModel& signal() const { return signal_; }

 private:
  TrackerPhysics() = default;
  field::EffectResponse changeAt(std::size_t effect, const StandingSensor& sensor, double time_s) const;
  Eigen::Matrix3d couplingsAt(const StandingSensor& sensor, const Visit& visit, double time_s) const;

  Scene scene_;
  Pose tracker_from_reference_;
  field::PoseSolver solver_ = field::PoseSolver::kClosedForm;
  field::SolverLimits limits_;
  field::SignalModel signal_;
  std::vector<std::unique_ptr<field::PhysicalEffect>> effects_;
};

/// What the random streams of one seed are for.
enum class RandomPurpose : std::uint32_t { kCouplings = 1, kPlacing = 2, kAlignment = 3, kVisits = 4 };

/// Draws what differs from visit to visit.
class VisitStream {
 public:
  VisitStream(const field::SignalModel& signal, std::uint64_t seed, int sensor);
  Visit next();

 private:
  field::GaussianStream stream_;
  double flip_probability_;
};

/// A pose off by a normal error: position per axis of the outer frame, rotation per axis of the inner one.
Pose disturbed(const Pose& pose, double sd_m, double sd_rad, field::GaussianStream& stream);

}  // namespace fieldtrue::simulation
