#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/run_control.h"
#include "calib/simulation/scene.h"

namespace fieldtrue::identify {

/// A fitted scene as far as positions tell it.
struct PositionScene {
  Pose tracker_from_reference;             ///< The rig's frame in the tracker's.
  Eigen::Quaterniond tracker_from_sensor;  ///< How the sensor is held where an error of its coils counts.
  std::vector<simulation::EffectInstance> effects;
  std::vector<Eigen::Vector3d> places_m;  ///< Known places, reference frame, from which readings are traced back.
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
  /// The place that is reported so, by Newton's method from the known place whose report is nearest, to 1e-9 m; none
  /// where that does not lead to such a place: within metal, or where the field folds back.
  /// @return reference frame [m]
  std::optional<Eigen::Vector3d> truePosition_m(const Eigen::Vector3d& p_tracked_m) const;

 private:
  explicit ScenePositions(PositionScene scene);
  Eigen::Vector3d startFor_m(const Eigen::Vector3d& p_tracked_m) const;
  PositionScene scene_;
  Pose reference_from_tracker_;
  std::vector<Eigen::Vector3d> reports_m_;  ///< Of the known places, tracker frame; NaN where there is none.
  std::vector<std::unique_ptr<field::PhysicalEffect>> effects_;
};

/// The scene that was found behind a table, or why there is none.
struct PhysicsFit {
  std::optional<ScenePositions> positions;
  std::vector<ScenePositions> without_fold;  ///< The same effects refitted with each fold's places left out.
  std::vector<std::string> named;            ///< Effects in it.
  std::vector<std::string> left_out;         ///< Effects that were found and that a position alone does not tell.
  std::string why_none;  ///< A clause: "no known effect stands out of the noise"; empty where there is one.
};

struct PhysicsFitOptions {
  int most_effects = 2;             ///< 1 to 4.
  std::set<int> searched_nodes;     ///< Where effects are looked for; all places refine what is found. Empty = all.
  std::map<int, int> fold_of_node;  ///< Folds 0..n-1 of the nodes searched; empty = nothing is refitted.
};

/// Selects effects as a diagnosis does, alignment and all parameters refitted together, and keeps those that act on the
/// field by where the sensor is: an error of the rig, or one that grows with time, says nothing of a later reading.
/// @error kCancelled
Result<PhysicsFit> fitPhysics(const CalibrationTable& table, const PhysicsFitOptions& options,
                              const RunControl& control);

}  // namespace fieldtrue::identify
