#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

namespace fieldtrue::correctors {

/// Coefficients of three outputs through values, from single-precision Cholesky factors of c 1 1^T - M and residuals in
/// double precision that improve the solution until the residual is below a tenth of a nanometre: half the time of
/// double-precision factors, and the same answer.
/// @param centers_m distinct
/// @param values one row a centre, three columns [m]
/// @return none where rounding in single precision keeps the improvement from settling (places close together compared
///         with R); the double-precision factors may still do
/// @source Wilkinson 1963, iterative refinement; Micchelli 1986 for the shift, as MultiquadricSystem
std::optional<Eigen::MatrixXd> solveMultiquadricMixed(std::span<const Eigen::Vector3d> centers_m, double r2_m2,
                                                      const Eigen::MatrixXd& values);

}  // namespace fieldtrue::correctors
