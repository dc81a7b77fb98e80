#pragma once

#include <span>
#include <vector>

#include "calib/identify/search.h"

namespace fieldtrue::gap {

/// Marks the rows whose whitened residuals no noise of this recording's law makes, with a share of false marks of at
/// most `rate`.
/// @source Benjamini and Hochberg 1995, J. R. Stat. Soc. B 57 289
std::vector<char> farOff(const identify::GapSearch& search, std::span<const identify::Vector6d> whitened, double rate);

/// Rows that lie off so far, in position or in rotation, that they are no noise: by the likeliest law of all others
/// each is too far by Thresholds::sure_stray, and by Thresholds::far_off. One in 33 at most, or three; of a table in
/// which more are off so far, the law has tails that make them.
/// @param whitened what a flexible fit leaves of every row
std::vector<std::size_t> straysAmong(std::span<const identify::Vector6d> whitened, bool has_orientation,
                                     const identify::Thresholds& thresholds);

}  // namespace fieldtrue::gap
