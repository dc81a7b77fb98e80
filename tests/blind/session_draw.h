#pragma once

#include "tests/blind/session.h"

namespace blind {

/// Draws the grid, the order, the orientations, the noise and the rigid transforms of one session.
/// @param random stream of this session
/// @return rows in order of time; ranges between 0.5 and 2.2 m
Setup drawSetup(Random& random);

}  // namespace blind
