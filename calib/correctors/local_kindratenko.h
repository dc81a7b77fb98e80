#pragma once

#include "calib/correctors/registry.h"

namespace fieldtrue {

/// The registry row of the position method `local_kindratenko`.
PositionMethod localKindratenkoPosition();

}  // namespace fieldtrue
