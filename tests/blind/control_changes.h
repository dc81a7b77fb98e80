#pragma once

#include <cstdint>

#include "tests/blind/session_table.h"

namespace blind {

/// Removes the stated jig tolerances.
/// @return false when none is stated
bool dropJigTolerance(SessionTable& nodes);

/// Puts red noise where the readings had white noise: every residual of the fitted alignment is shrunk to what the
/// jig's stated tolerance leaves of it, and a first-order autoregression in the order of rows is added, of lag-one
/// correlation 0.9 and of the scatter that the row states of its mean. The total scatter stays as stated.
/// @return false when the table states no scatter or no tolerance, or has fewer than three rows
bool reddenNoise(SessionTable& nodes, std::uint64_t seed);

/// Exchanges the residuals of the fitted alignment among rows of like range from the transmitter: rows in order of
/// range are cut into shells of 8 to 12 (fewer rows than 8 are one shell), and each shell's are permuted. Positions and
/// rotation vectors go together, in the tracker frame.
/// @return false when the table states no scatter or has fewer than three rows
bool permuteResiduals(SessionTable& nodes, std::uint64_t seed);

/// Keeps the readings and takes the places, node numbers and visits of another table, row by row; the longer is cut.
void takePlaces(SessionTable& nodes, const SessionTable& other);

}  // namespace blind
