#pragma once

#include "calib/effects/registry.h"

namespace fieldtrue {

/// Successive readings that are not independent, because the tracker filters them.
///
/// Convention: the noise of the couplings is first-order autoregressive, n' = rho n + sqrt(1 - rho^2) w. The mean of N
/// readings is then worth N (1 - rho)/(1 + rho) independent ones. The filter's own correlation and this one do not add:
/// the larger holds.
/// @source Box, Jenkins, Reinsel 1994, Time Series Analysis, section 3.2
Effect correlatedSamplesEffect();

}  // namespace fieldtrue
