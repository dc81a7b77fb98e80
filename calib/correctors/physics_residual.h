#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// The scene that a diagnosis finds behind the data, undone by inverting what a tracker reports in it, and a Gaussian
/// process on what remains; where no effect is found, the Gaussian process alone.
PositionMethod physicsResidualPosition();

}  // namespace fieldtrue
