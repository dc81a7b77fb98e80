#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/run_control.h"
#include "calib/simulation/scene.h"

namespace fieldtrue {

/// A fitted scene as far as positions tell it.
struct PositionScene {
  Pose tracker_from_reference;             ///< The rig's frame in the tracker's.
  Eigen::Quaterniond tracker_from_sensor;  ///< How the sensor is held where an error of its coils counts.
  std::vector<EffectInstance> effects;
};

/// What a tracker reports of a place in a scene, and the place behind a report. Effects are met as an AC tracker meets
/// them.
class ScenePositions {
 public:
  /// @error kBadInput for an effect that cannot be made, naming it
  static Result<ScenePositions> make(PositionScene scene);

  const PositionScene& scene() const { return scene_; }
  /// The reported position, tracker frame [m]; none where no signal arrives or no pose can be solved.
  /// @param p_true_m reference frame [m]
  /// @param near_m decides between the solutions p and -p, tracker frame [m]
  std::optional<Eigen::Vector3d> trackedPosition_m(const Eigen::Vector3d& p_true_m,
                                                   const Eigen::Vector3d& near_m) const;
  /// The place that is reported so, by Newton's method from the place an undisturbed tracker would mean, to 1e-9 m;
  /// none where that does not lead to such a place: within metal, or where the field folds back.
  /// @return reference frame [m]
  std::optional<Eigen::Vector3d> truePosition_m(const Eigen::Vector3d& p_tracked_m) const;

 private:
  explicit ScenePositions(PositionScene scene);
  PositionScene scene_;
  Pose reference_from_tracker_;
  std::vector<std::unique_ptr<PhysicalEffect>> effects_;
};

/// The scene that was found behind a table, or why there is none.
struct PhysicsFit {
  std::optional<ScenePositions> positions;
  std::vector<std::string> named;     ///< Effects in it.
  std::vector<std::string> left_out;  ///< Effects that were found and that a position alone does not tell.
  std::string why_none;               ///< A clause: "no known effect stands out of the noise"; empty where there is one.
};

/// Selects effects as a diagnosis does, alignment and all parameters refitted together, and keeps those that act by
/// where the sensor is: an error that grows with time or sits in one layer of the rig says nothing of a later reading.
/// @param most_effects 1 to 4
/// @error kCancelled
Result<PhysicsFit> fitPhysics(const CalibrationTable& table, int most_effects, const RunControl& control);

}  // namespace fieldtrue
