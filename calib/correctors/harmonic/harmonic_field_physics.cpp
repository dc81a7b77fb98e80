#include "calib/correctors/harmonic/harmonic_field_physics.h"

#include <ceres/tiny_solver.h>

#include <Eigen/LU>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <optional>

#include "calib/field/dipole_field.h"
#include "calib/field/tracker_model.h"

namespace fieldtrue::correctors {
namespace {

constexpr double kNear = 1e-11;  ///< Of the range, a place that is found is tracked so near: 30 pm at 3 m.

/// d tracked / d true, by central differences; `Field` has trackedPosition_m.
template <class Field>
Eigen::Matrix3d trackedJacobianOf(const Field& field, const Eigen::Vector3d& p_true_m) {
  constexpr double kStep_m = 1e-4;
  Eigen::Matrix3d jacobian;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step_m = kStep_m * Eigen::Vector3d::Unit(axis);
    jacobian.col(axis) =
        (field.trackedPosition_m(p_true_m + step_m) - field.trackedPosition_m(p_true_m - step_m)) / (2.0 * kStep_m);
  }
  return jacobian;
}

/// By how much a place is tracked elsewhere, in ranges: what a ceres::TinySolver makes small.
template <class Field>
struct Miss {
  using Scalar = double;
  enum { NUM_RESIDUALS = 3, NUM_PARAMETERS = 3 };

  const Field& field;
  const Eigen::Vector3d& p_tracked_m;

  bool operator()(const double* p_true_m, double* miss, double* jacobian) const {
    const Eigen::Vector3d p_m = Eigen::Map<const Eigen::Vector3d>(p_true_m);
    const double range_m = p_tracked_m.norm();
    Eigen::Map<Eigen::Vector3d>{miss} = (field.trackedPosition_m(p_m) - p_tracked_m) / range_m;
    if (jacobian != nullptr) Eigen::Map<Eigen::Matrix3d>{jacobian} = trackedJacobianOf(field, p_m) / range_m;
    return true;
  }
};

/// By Levenberg's and Marquardt's method, its first steps short: slower than Broyden's, and surer where the field turns
/// on the way.
template <class Field>
Eigen::Vector3d surelyInverted(const Field& field, const Eigen::Vector3d& p_tracked_m, Eigen::Vector3d p_m) {
  ceres::TinySolver<Miss<Field>> solver;
  solver.options.max_num_iterations = 100;
  solver.options.initial_trust_region_radius = 0.1;
  solver.options.cost_threshold = 0.5 * kNear * kNear;
  solver.options.function_tolerance = solver.options.gradient_tolerance = kNear * kNear;
  solver.options.parameter_tolerance = kNear;
  solver.Solve(Miss<Field>{field, p_tracked_m}, &p_m);
  return p_m;
}

struct Inverted {
  Eigen::Vector3d p_m = Eigen::Vector3d::Zero();
  bool is_straight = true;  ///< Every step was shorter than the last and came nearer; else it may have leapt to another
                            ///< place that is tracked there.
};

/// By Broyden's method from the tracked position, and where it does not come there more surely.
/// @param starts from which that is tried
template <class Field>
Inverted inverted(const Field& field, const Eigen::Vector3d& p_tracked_m,
                  std::initializer_list<Eigen::Vector3d> starts) {
  constexpr int kMostQuasiNewtonSteps = 60;
  constexpr double kFound = 1e-6;        // Of the range: 3 um at 3 m.
  constexpr double kLongestStep = 0.25;  // Of the range: a longer one may end beyond a source.
  const double range_m = p_tracked_m.norm();
  Eigen::Matrix3d true_by_tracked = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_m = p_tracked_m;
  Eigen::Vector3d miss_m = p_tracked_m - field.trackedPosition_m(p_m);
  Eigen::Vector3d best_m = p_m;
  double least_m = miss_m.norm();
  bool is_straight = true;
  double last_length_m = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMostQuasiNewtonSteps && least_m > kNear * range_m; ++i) {
    Eigen::Vector3d step_m = true_by_tracked * miss_m;
    const double length_m = step_m.norm();
    if (!(length_m > 0.0) || !std::isfinite(length_m)) break;
    if (length_m > kLongestStep * range_m) step_m *= kLongestStep * range_m / length_m;
    is_straight = is_straight && (length_m <= last_length_m || least_m <= kFound * range_m);
    last_length_m = length_m;
    p_m += step_m;
    const Eigen::Vector3d new_miss_m = p_tracked_m - field.trackedPosition_m(p_m);
    const Eigen::Vector3d moved_m = true_by_tracked * (miss_m - new_miss_m);
    const double scale = step_m.dot(moved_m);
    if (std::abs(scale) > 1e-3 * step_m.squaredNorm())
      true_by_tracked += (step_m - moved_m) * (step_m.transpose() * true_by_tracked) / scale;
    miss_m = new_miss_m;
    if (miss_m.norm() < least_m) {
      least_m = miss_m.norm();
      best_m = p_m;
    } else {
      is_straight = is_straight && least_m <= kFound * range_m;  // Below, it is rounding.
    }
  }
  for (auto start = starts.begin(); start != starts.end() && !(least_m <= kFound * range_m); ++start) {
    const Eigen::Vector3d surely_m = surelyInverted(field, p_tracked_m, *start);
    const double nearest_m = (field.trackedPosition_m(surely_m) - p_tracked_m).norm();
    if (!(nearest_m < least_m)) continue;
    least_m = nearest_m;
    best_m = surely_m;
    is_straight = false;
  }
  return {best_m, is_straight};
}

/// A field whose sources are not yet what they are.
struct GrowingField {
  const HeldField& field;
  double share;

  Eigen::Vector3d trackedPosition_m(const Eigen::Vector3d& p_true_m) const {
    return field.trackedPosition_m(p_true_m, share);
  }
};

/// The place that a tracked position comes from as the sources grow from nothing to what they are; nothing where the
/// way there folds.
/// @source Allgower and Georg 1990, Numerical continuation methods, section 1.1
std::optional<Eigen::Vector3d> followed(const HeldField& field, const Eigen::Vector3d& p_tracked_m) {
  constexpr int kParts = 20;
  constexpr int kMostNewtonSteps = 8;
  constexpr double kFound = 1e-9;  // Of the range.
  const double found_m = kFound * p_tracked_m.norm();
  Eigen::Vector3d p_m = p_tracked_m;
  for (int part = 1; part <= kParts; ++part) {
    const GrowingField grown{field, static_cast<double>(part) / kParts};
    Eigen::Vector3d miss_m = p_tracked_m - grown.trackedPosition_m(p_m);
    for (int step = 0; step < kMostNewtonSteps && miss_m.norm() > found_m; ++step) {
      const Eigen::Matrix3d jacobian = trackedJacobianOf(grown, p_m);
      if (!(jacobian.determinant() > 0.0)) return std::nullopt;
      p_m += jacobian.inverse() * miss_m;
      miss_m = p_tracked_m - grown.trackedPosition_m(p_m);
    }
    if (!(miss_m.norm() <= found_m)) return std::nullopt;
  }
  return p_m;
}

}  // namespace

Eigen::Matrix3d DisturbedField::at(const Eigen::Vector3d& p_true_m, double share) const {
  Eigen::Matrix3d field = field::dipoleField(p_true_m, 1.0);
  for (const FieldSource& source : sources_) {
    const Eigen::Vector3d from_source_m = p_true_m - source.at_m;
    const double r2 = from_source_m.squaredNorm();
    const double inverse_r3 = 1.0 / (r2 * std::sqrt(r2));
    const Eigen::RowVector3d along = from_source_m.transpose() * source.response;
    field += share * inverse_r3 * (3.0 / r2 * from_source_m * along - source.response);
  }
  return field;
}

Eigen::Vector3d DisturbedField::trackedPosition_m(const Eigen::Vector3d& p_true_m, double share) const {
  return field::solvedPosition_m(at(p_true_m, share), p_true_m);
}

Eigen::Matrix3d DisturbedField::trackedJacobian(const Eigen::Vector3d& p_true_m) const {
  return trackedJacobianOf(*this, p_true_m);
}

Eigen::Vector3d DisturbedField::truePosition_m(const Eigen::Vector3d& p_tracked_m) const {
  return sources_.empty() ? p_tracked_m : inverted(*this, p_tracked_m, {}).p_m;
}

Eigen::Vector3d HeldField::heldPosition_m(const Eigen::Vector3d& p_true_m) const {
  const double least_m = 1e-3 * box_.longest_m();
  const Eigen::Vector3d held_m = box_.held_m(p_true_m);
  if (held_m.norm() >= least_m) return held_m;
  return least_m * (held_m.isZero() ? Eigen::Vector3d::UnitX() : held_m.normalized());
}

Eigen::Vector3d HeldField::trackedPosition_m(const Eigen::Vector3d& p_true_m, double share) const {
  const Eigen::Vector3d held_m = heldPosition_m(p_true_m);
  const Eigen::Vector3d tracked_m = field_.trackedPosition_m(held_m, share);
  return held_m == p_true_m ? tracked_m : Eigen::Vector3d(p_true_m + (tracked_m - held_m));
}

Eigen::Vector3d HeldField::truePosition_m(const Eigen::Vector3d& p_tracked_m) const {
  if (field_.sources().empty()) return p_tracked_m;
  const Inverted found = inverted(*this, p_tracked_m, {p_tracked_m, 0.5 * (box_.low_m + box_.high_m)});
  if (found.is_straight) return found.p_m;
  return followed(*this, p_tracked_m).value_or(found.p_m);
}

}  // namespace fieldtrue::correctors
