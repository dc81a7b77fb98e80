#pragma once

#include "calib/effects/registry.h"

namespace fieldtrue {

/// A gain that changes while the recording goes on: a transmitter or an amplifier that warms up.
///
/// Convention: dG = g(t) G with, u = t - start,
///   g = gain + amplitude exp(-u/time_constant) + slope u + curvature u^2.
/// A body that warms up under constant power follows the exponential (Newton's law of cooling); the straight line and
/// the parabola are its short-time forms. Every way of fitting has its own constant, for what is stable may lie at
/// either end of the session.
/// @source Newton's law of cooling: Carslaw and Jaeger 1959, Conduction of Heat in Solids, section 1.9
Effect gainDriftEffect();

}  // namespace fieldtrue
