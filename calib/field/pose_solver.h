#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string_view>
#include <tl/expected.hpp>

#include "calib/core/pose.h"

namespace fieldtrue::field {

/// Why nine couplings give no pose.
enum class SolveError {
  kTooWeak,    ///< Weaker together than those of a sensor at the farthest range.
  kSaturated,  ///< Stronger together than those of a sensor at the nearest range.
  kNotFinite,  ///< A coupling is NaN or infinite.
  kAmbiguous,  ///< Two directions fit equally well.
};

/// "the signal is too weak", to follow a colon.
std::string_view describe(SolveError error);

/// The ranges a tracker works between; couplings are judged by their root sum of squares, sqrt(6) C/r^3.
struct SolverLimits {
  double nearest_m = 0.0;
  double farthest_m = std::numeric_limits<double>::infinity();
};

/// How a tracker comes from nine couplings to a pose.
enum class PoseSolver {
  kClosedForm,    ///< Direct; the minimum of the sum of squares, whatever the couplings.
  kLeastSquares,  ///< Iterated from Raab's direct solution; ends at the same pose, or in a side minimum far from any.
  kDamped,        ///< Iterated and held back towards the last position: strong distortion moves it less.
};

/// `closed_form`, `least_squares` or `damped`, as scenes name them.
std::string_view nameOf(PoseSolver solver);
/// None for any other name.
std::optional<PoseSolver> poseSolverNamed(std::string_view name);

struct PoseSolution {
  Pose tracker_from_sensor;
  double residual_rms = 0.0;  ///< Over the nine couplings, in their units: how far they are from any undistorted pose.
};

/// The pose whose undistorted dipole couplings R^T G(p) come nearest the given ones, in unweighted least squares.
///
/// The minimum is reached in closed form, so there is no start value, no iteration and no local minimum. With the
/// singular values d1 >= d2 >= d3 of S = P D Q^T and s = det(P) det(Q), the sum of squares is bounded below by
/// |S|^2 + 6 k^2 - 2 k (2 d1 + d2 + s d3), k = C/r^3 (von Neumann's trace inequality, for G has the singular values
/// k (2, 1, 1)), and that bound is met by
///   u = q1,  R = Q diag(1, -1, -s) P^T,  k = (2 d1 + d2 + s d3)/6.
/// Of the decomposition only q1 is sought; square on it, diag(1, s) in Q and P is the rotation nearest to what S is
/// there, and d2 + s d3 what S is along it.
/// An iterated least-squares solver of the nine equations ends at the same pose.
///
/// @param couplings S: rows receiver coils, columns transmitter coils
/// @param dipole_constant_m3 C > 0
/// @param hemisphere tracker frame, any length, not zero: p and -p give the same couplings, the answer has p.hemisphere
/// >= 0. While tracking it is the last position.
/// @error SolveError
/// @source Raab 1981, IEEE Trans. AES-17 (direct solution, position first); the bound: Miranda and Thompson 1993
tl::expected<PoseSolution, SolveError> solvePose(const Eigen::Matrix3d& couplings, double dipole_constant_m3,
                                                 const Eigen::Vector3d& hemisphere, const SolverLimits& limits = {});

/// Unit eigenvector of the largest eigenvalue of a positive semidefinite symmetric matrix with a trace above 0, by
/// repeated squaring: of undistorted couplings the others are a quarter of it, and five squarings leave 4^-32 of them.
Eigen::Vector3d dominantDirection(Eigen::Matrix3d m);

/// The pose that a tracker with this solver reports.
///
/// The iterated ones minimise |S - R^T G(p)|^2 / k^2 + w |p - p_last|^2 / |p_last|^2, k = |S|/sqrt(6), by Levenberg and
/// Marquardt's method from range and direction by Raab's direct solution (k from the trace of S^T S, u its first
/// eigenvector) with w = 0 for `least_squares` and kDamping for `damped`.
/// @param last_position_m of a damped solver in metres; the others take its direction only, as the hemisphere
/// @error SolveError
/// @source Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709 (iterated); Raab 1981, IEEE Trans. AES-17 (direct);
/// Marquardt 1963, J. SIAM 11 431
tl::expected<PoseSolution, SolveError> solvePose(PoseSolver solver, const Eigen::Matrix3d& couplings,
                                                 double dipole_constant_m3, const Eigen::Vector3d& last_position_m,
                                                 const SolverLimits& limits = {});

/// Weight w of a damped solver's last position. Transverse errors, 1.8 of information against 54 of radial ones, are
/// reported 1.8/(1.8 + w) of their size.
inline constexpr double kDamping = 0.2;

}  // namespace fieldtrue::field
