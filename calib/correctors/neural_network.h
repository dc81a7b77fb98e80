#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// The registry row of the position method `neural_network`.
PositionMethod neuralNetworkPosition();

}  // namespace fieldtrue
