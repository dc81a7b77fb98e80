#include "calib/field/pose_solver.h"

#include <Eigen/LU>
#include <Eigen/SVD>
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

  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(couplings, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d& d = svd.singularValues();
  if (d[0] - d[1] < kSmallestGap * d[0]) return tl::make_unexpected(SolveError::kAmbiguous);
  const Eigen::Matrix3d& P = svd.matrixU();
  const Eigen::Matrix3d& Q = svd.matrixV();
  const double s = P.determinant() * Q.determinant() > 0.0 ? 1.0 : -1.0;
  const double k = (2.0 * d[0] + d[1] + s * d[2]) / 6.0;

  PoseSolution solution;
  const Eigen::Vector3d p_m = std::cbrt(dipole_constant_m3 / k) * Q.col(0);
  solution.tracker_from_sensor.position_m = p_m.dot(hemisphere) < 0.0 ? Eigen::Vector3d(-p_m) : p_m;
  const Eigen::Matrix3d R = Q * Eigen::Vector3d(1.0, -1.0, -s).asDiagonal() * P.transpose();
  solution.tracker_from_sensor.orientation = Eigen::Quaterniond(R).normalized();
  const Eigen::Vector3d misfit(d[0] - 2.0 * k, d[1] - k, d[2] - s * k);
  solution.residual_rms = misfit.norm() / 3.0;
  return solution;
}

}  // namespace fieldtrue::field
