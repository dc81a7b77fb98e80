#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "calib/calibration/alignment.h"
#include "calib/core/error.h"
#include "calib/core/json_reader.h"
#include "calib/correctors/base/orientation_model.h"
#include "calib/correctors/base/position_model.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::calibration {

/// Position part, orientation part and the region they hold in.
struct Correction {
  std::shared_ptr<const correctors::PositionModel> position;
  bool is_baked = false;  ///< position is a lattice, not the method's own model.
  std::shared_ptr<const correctors::OrientationModel> orientation;
  Region region;
};

/// What applies a calibration: an alignment, and a correction that all sensors share or one for each. Immutable; copies
/// share the models.
class Evaluator {
 public:
  /// The correction that all share, or that of the first sensor, which stands for a sensor that was not fitted.
  struct Parts : Correction {
    Alignment alignment;
    std::map<int, Correction> by_sensor;  ///< Of every sensor, where each has its own; else empty.
  };
  /// @param parts with both models
  explicit Evaluator(Parts parts);

  /// reference_from_sensor of a tracked pose. Where a part does not cover the position, only the alignment is applied.
  /// @param sensor whose mounting counts, where several were fitted, and whose correction, where each has its own
  Pose correct(const Pose& tracker_from_sensor, std::optional<int> sensor = {}) const;
  /// Allocates nothing itself.
  /// @param reference_from_sensor same length; may be the same memory
  /// @param sensors of each pose; empty where they are not told
  void correct(std::span<const Pose> tracker_from_sensor, std::span<Pose> reference_from_sensor,
               std::span<const std::optional<int>> sensors = {}) const;
  /// Sensors that have a correction of their own; empty where they share one. What is asked below without naming one is
  /// told of the first.
  std::vector<int> sensorsApart() const;

  /// What applies to one sensor alone: its correction and its mounting.
  /// @error kBadInput where several sensors were fitted and this one was not
  Result<Parts> partsOf(int sensor) const;

  /// Where the position part takes orientation: the mean over the orientations that were fitted.
  Eigen::Vector3d correctPosition_m(const Eigen::Vector3d& p_tracked_m, std::optional<int> sensor = {}) const;
  /// @param p_true_m same length; may be the same memory
  void correctPositions(std::span<const Eigen::Vector3d> p_tracked_m, std::span<Eigen::Vector3d> p_true_m) const;
  /// Whether the position part is a function of the tracked pose, not of position alone.
  bool takesOrientation() const;
  /// Whether the error of orientations is a function of the tracked pose.
  bool turnTakesOrientation() const;

  /// SD of the corrected position [m]; at a pose, or for any of the orientations that were fitted.
  std::optional<double> uncertaintyAt_m(const Pose& tracker_from_sensor, std::optional<int> sensor = {}) const;
  std::optional<double> uncertainty_m(const Eigen::Vector3d& p_tracked_m, std::optional<int> sensor = {}) const;
  /// Inside the calibrated region, and covered by the method; otherwise the result is an extrapolation.
  bool covers(const Eigen::Vector3d& p_tracked_m, std::optional<int> sensor = {}) const;
  /// Whether the position part can be evaluated there at all, inside the region or not.
  bool reaches(const Eigen::Vector3d& p_tracked_m) const { return parts_.position->covers(p_tracked_m); }
  Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const;

  const Alignment& alignment() const { return parts_.alignment; }
  const Region& region() const { return parts_.region; }
  bool isBaked() const { return parts_.is_baked; }
  const Parts& parts() const { return parts_; }

 private:
  /// What corrects a sensor's readings; the first one's for a sensor that was not fitted or is not told.
  const Correction& of(std::optional<int> sensor) const;
  void correctBlock(const Correction& correction, std::span<const Pose> tracker_from_sensor,
                    std::span<Pose> reference_from_sensor, std::span<const std::optional<int>> sensors) const;

  Eigen::Vector3d toReference_m(const Eigen::Vector3d& p_tracker_m) const {
    return rotation_ * p_tracker_m + parts_.alignment.reference_from_tracker.position_m;
  }

  Parts parts_;
  Eigen::Matrix3d rotation_;  ///< Of the alignment.
};

/// What applies the calibration of a file's content; throws as a JsonReader does.
Evaluator::Parts evaluatorPartsFrom(const JsonReader& content);

}  // namespace fieldtrue::calibration
