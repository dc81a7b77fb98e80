#include "calib/field/pose_solver.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "calib/core/error.h"

namespace fieldtrue::field {

namespace {

/// Undistorted couplings have d1/d2 = 2; below this share of d1 the direction is rounding, not signal.
constexpr double kSmallestGap = 1e-9;

/// Root sum of squares of the nine couplings at a range.
double signalAt(double range_m, double dipole_constant_m3) {
  return std::sqrt(6.0) * dipole_constant_m3 / (range_m * range_m * range_m);
}

using Across = Eigen::Matrix<double, 3, 2>;

/// Two directions that stand square on a unit vector, right-handed with it.
Across across(const Eigen::Vector3d& unit) {
  Across both;
  both.col(0) = unit.unitOrthogonal();
  both.col(1) = unit.cross(both.col(0));
  return both;
}

}  // namespace

std::string_view describe(SolveError error) {
  switch (error) {
    case SolveError::kTooWeak:
      return "the signal is too weak";
    case SolveError::kSaturated:
      return "the signal saturates the receiver";
    case SolveError::kNotFinite:
      return "the signal is not finite";
    case SolveError::kAmbiguous:
      return "the signal fits two directions equally well";
  }
  return {};
}

tl::expected<PoseSolution, SolveError> solvePose(const Eigen::Matrix3d& couplings, double dipole_constant_m3,
                                                 const Eigen::Vector3d& hemisphere, const SolverLimits& limits) {
  FT_CHECK(dipole_constant_m3 > 0.0);
  if (!couplings.allFinite()) return tl::make_unexpected(SolveError::kNotFinite);
  const double signal = couplings.norm();
  if (signal == 0.0 || signal < signalAt(limits.farthest_m, dipole_constant_m3)) {
    return tl::make_unexpected(SolveError::kTooWeak);
  }
  if (signal > signalAt(limits.nearest_m, dipole_constant_m3)) return tl::make_unexpected(SolveError::kSaturated);

  const Eigen::Matrix3d S = couplings / signal;
  const Eigen::Vector3d q1 = dominantDirection(S.transpose() * S);
  const Eigen::Vector3d image = S * q1;
  const double d1 = image.norm();
  const Eigen::Vector3d p1 = image / d1;
  const Across from = across(q1), to = across(p1);
  const Eigen::Matrix2d rest = to.transpose() * S * from;
  // Along and against the rotation that comes nearest to the rest: d2 + s d3 and d2 - s d3.
  const Eigen::Vector2d along(rest(0, 0) + rest(1, 1), rest(1, 0) - rest(0, 1));
  const Eigen::Vector2d against(rest(0, 0) - rest(1, 1), rest(1, 0) + rest(0, 1));
  const double sum = along.norm();
  if (d1 - 0.5 * (sum + against.norm()) < kSmallestGap * d1) return tl::make_unexpected(SolveError::kAmbiguous);
  const double k = (2.0 * d1 + sum) / 6.0;
  Eigen::Matrix2d turn = Eigen::Matrix2d::Identity();
  if (sum > 0.0) turn << along[0] / sum, -along[1] / sum, along[1] / sum, along[0] / sum;

  PoseSolution solution;
  const Eigen::Vector3d p_m = std::cbrt(dipole_constant_m3 / (k * signal)) * q1;
  solution.tracker_from_sensor.position_m = p_m.dot(hemisphere) < 0.0 ? Eigen::Vector3d(-p_m) : p_m;
  const Eigen::Matrix3d R = q1 * p1.transpose() - from * turn.transpose() * to.transpose();
  solution.tracker_from_sensor.orientation = Eigen::Quaterniond(R).normalized();
  const double along_misfit = d1 - 2.0 * k;
  solution.residual_rms = signal * std::sqrt(along_misfit * along_misfit + (rest - k * turn).squaredNorm()) / 3.0;
  return solution;
}

Eigen::Vector3d dominantDirection(Eigen::Matrix3d m) {
  constexpr int kMostSquarings = 40;
  m /= m.trace();
  for (int i = 0; i < kMostSquarings; ++i) {
    const Eigen::Matrix3d squared = m * m;
    const double trace = squared.trace();
    m = squared / trace;
    if (trace > 1.0 - 1e-15) break;
  }
  Eigen::Index column = 0;
  m.diagonal().maxCoeff(&column);
  return m.col(column).normalized();
}

}  // namespace fieldtrue::field
