#pragma once

#include <Eigen/Core>
#include <span>
#include <utility>
#include <vector>

#include "calib/correctors/base/soft_box.h"

namespace fieldtrue::correctors {

/// A dipole that metal outside the measured region stands for: with the transmitter's coils at unit strength it adds
/// G(p - at) response to the 3x3 field matrix, G(r) = (3uu^T - 1)/|r|^3. At the transmitter itself it is a change of
/// the coils.
struct FieldSource {
  Eigen::Vector3d at_m = Eigen::Vector3d::Zero();      ///< Transmitter frame.
  Eigen::Matrix3d response = Eigen::Matrix3d::Zero();  ///< Moment (rows) by transmitter coil (columns), coil moment 1.
};

/// The transmitter's field with what the sources add, and what a tracker that knows nothing of them makes of it.
class DisturbedField {
 public:
  DisturbedField() = default;
  explicit DisturbedField(std::vector<FieldSource> sources) : sources_(std::move(sources)) {}

  std::span<const FieldSource> sources() const { return sources_; }
  /// @param p_true_m transmitter frame [m], not at the transmitter or at a source
  /// @param share of what the sources add
  Eigen::Matrix3d at(const Eigen::Vector3d& p_true_m, double share = 1.0) const;
  Eigen::Vector3d trackedPosition_m(const Eigen::Vector3d& p_true_m, double share = 1.0) const;
  /// d tracked / d true, by central differences of 0.1 mm.
  Eigen::Matrix3d trackedJacobian(const Eigen::Vector3d& p_true_m) const;
  /// The place whose tracked position is the one given, by Broyden's method from there; where the field folds back and
  /// there is none, the place that comes nearest on the way.
  /// @source Broyden 1965, Mathematics of Computation 19 577 (the "good" update)
  Eigen::Vector3d truePosition_m(const Eigen::Vector3d& p_tracked_m) const;

 private:
  std::vector<FieldSource> sources_;
};

/// A disturbed field that is known in a box of true positions only: beyond it the tracker errs as it does at the
/// position held there. What is tracked beyond the box so has a true position where the field itself folds back or has
/// a source.
class HeldField {
 public:
  HeldField(DisturbedField field, const SoftBox& box) : field_(std::move(field)), box_(box) {}

  const DisturbedField& field() const { return field_; }
  const SoftBox& box() const { return box_; }
  /// Where the field counts for a true position: held at the box, and not the transmitter itself, where it has no
  /// value.
  Eigen::Vector3d heldPosition_m(const Eigen::Vector3d& p_true_m) const;
  Eigen::Vector3d trackedPosition_m(const Eigen::Vector3d& p_true_m, double share = 1.0) const;
  /// As DisturbedField::truePosition_m; where Broyden's method finds none, by Levenberg's and Marquardt's from the
  /// tracked position and from the box's centre. Where the way was not straight, several places may be tracked there:
  /// it is the one that comes from the tracked position as the sources grow. While a field is being fitted that would
  /// find places far off, behind sources that do not stay.
  /// @source Marquardt 1963, Journal of the Society for Industrial and Applied Mathematics 11 431
  Eigen::Vector3d truePosition_m(const Eigen::Vector3d& p_tracked_m) const;

 private:
  DisturbedField field_;
  SoftBox box_;
};

}  // namespace fieldtrue::correctors
