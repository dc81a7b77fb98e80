#pragma once

#include "tests/blind/session.h"

namespace blind {

/// Draws the grid, the order, the orientations, the noise and the rigid transforms of one session.
/// @param random stream of this session
/// @param most_rows draws until the table has no more rows than this; 0: any number
/// @return rows in order of time; ranges between 0.5 and 2.2 m
Setup drawSetup(Random& random, std::size_t most_rows = 0);

}  // namespace blind
