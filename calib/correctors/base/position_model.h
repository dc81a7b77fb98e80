#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>

#include "calib/core/error.h"
#include "calib/core/pose.h"

namespace fieldtrue::correctors {

class PositionModel;

/// Puts a function of position on a lattice that is fast to evaluate.
class LatticeMaker {
 public:
  virtual ~LatticeMaker() = default;
  /// @param of_position what takes no orientation; @param max_deviation_m the lattice may be off it by, in the region
  virtual Result<std::unique_ptr<PositionModel>> make(const PositionModel& of_position,
                                                      double max_deviation_m) const = 0;
};

/// A fitted, immutable position correction p_true = p_tracked + d(p_tracked), both in the tracker frame [m].
class PositionModel {
 public:
  virtual ~PositionModel() = default;

  /// d at a tracked position [m].
  virtual Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const = 0;

  /// Whether the displacement depends on how the sensor is turned; `displacement_m`, and with it a batch and the
  /// derivative, is then the mean over the orientations that were fitted.
  virtual bool takesOrientation() const { return false; }

  /// d at a tracked pose [m].
  virtual Eigen::Vector3d displacementAt_m(const Pose& tracker_from_sensor) const {
    return displacement_m(tracker_from_sensor.position_m);
  }

  /// Corrected positions of a batch; the default loops, fast methods override.
  /// @param p_corrected_m same length as p_tracked_m; may be the same memory
  virtual void correct(std::span<const Eigen::Vector3d> p_tracked_m, std::span<Eigen::Vector3d> p_corrected_m) const;

  /// The same with how the sensor is turned.
  virtual void correctPoses(std::span<const Pose> tracker_from_sensor, std::span<Eigen::Vector3d> p_corrected_m) const;

  /// The same correction with lattices in place of what costs time; the default is one lattice of all of it.
  /// @error kUnsupported where it takes orientation in a way that lattices cannot hold; as LatticeMaker::make
  virtual Result<std::unique_ptr<PositionModel>> onLattices(const LatticeMaker& maker, double max_deviation_m) const;

  /// d p_corrected / d p_tracked (3x3, dimensionless); the default takes central differences of 0.1 mm.
  virtual Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const;

  /// SD of the corrected position [m], when the method knows it.
  virtual std::optional<double> uncertainty_m(const Eigen::Vector3d&) const { return std::nullopt; }
  virtual std::optional<double> uncertaintyAt_m(const Pose& tracker_from_sensor) const {
    return uncertainty_m(tracker_from_sensor.position_m);
  }

  /// How much of each reading's displacement the correction at a pose is made of, where the method is linear in them.
  virtual std::optional<Eigen::VectorXd> weightsAt(const Pose&) const { return std::nullopt; }

  /// Whether the method can be evaluated there at all. Local methods cannot outside their cells; global ones always
  /// can.
  virtual bool covers(const Eigen::Vector3d&) const { return true; }

  /// Coefficients an axis that least squares took from the places; 0 where the fit is no such sum of terms.
  virtual int coefficients() const { return 0; }

  /// What the user should know about this fit ("nodes lie in one plane: fitted in the plane"); empty when nothing.
  virtual std::string note() const { return {}; }

  /// Everything `load` needs to rebuild the same model to the same bits.
  virtual nlohmann::json parameters() const = 0;
};

}  // namespace fieldtrue::correctors
