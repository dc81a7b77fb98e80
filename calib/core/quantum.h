#pragma once

#include <optional>
#include <span>

namespace fieldtrue {

/// Lattice spacing of which all differences of the values are multiples (within rounding of the text they came from),
/// if there is one.
/// @param values_m at least a few dozen readings [m], of one or several axes
/// @return spacing [m] of 1 um or more, or none when the values are not on a lattice coarser than their rounding
std::optional<double> findQuantum_m(std::span<const double> values_m);

/// The coarsest decimal step, in metres or inches, of which all values are multiples: what they were printed with.
/// @return step [m] of 1e-9 or more, 0 when the values have no such step
double printedStep_m(std::span<const double> values_m);

}  // namespace fieldtrue
