#pragma once

#include <span>
#include <vector>

#include "calib/identify/search.h"

namespace fieldtrue::gap {

/// Marks the rows whose whitened residuals no noise of this recording's law makes, with a share of false marks of at
/// most `rate`.
/// @source Benjamini and Hochberg 1995, J. R. Stat. Soc. B 57 289
std::vector<char> farOff(const identify::GapSearch& search, std::span<const identify::Vector6d> whitened, double rate);

}  // namespace fieldtrue::gap
