#pragma once

#include <optional>

#include "calib/correctors/base/fit_data.h"
#include "calib/correctors/harmonic/harmonic_field_fit.h"

namespace fieldtrue::correctors {

/// The same places with more noise stated of those that lie off: as much as the weights of a Student t law stand for.
/// How far a place lies off is told by what the fit would make of it without it, for sources that stand by a place at
/// the edge follow it wherever it is.
/// @return none where no place lies so far off that noise does not make it
/// @source Lange, Little and Taylor 1989, J. Am. Stat. Assoc. 84 881 (t weights)
std::optional<FitData> easedOfSlips(const FitData& data, const HarmonicFit& fit);

/// Minus the log likelihood of what a fit leaves, under the likeliest of a normal law and two of Student's t, and what
/// its sources cost [nats].
/// @source Schwarz 1978, Annals of Statistics 6 461
double robustCost_nats(const FitData& data, const HarmonicFit& fit);

}  // namespace fieldtrue::correctors
