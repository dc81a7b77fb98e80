#pragma once

#include <optional>

#include "calib/identify/search.h"

namespace fieldtrue::identify {

/// Where twice the log likelihood, all other parameters refitted, has fallen by 2.706; unset where it falls less within
/// what may be searched: then the data do not bound it on that side.
/// @source profile likelihood: Raue et al. 2009, Bioinformatics 25 1923
struct ProfileInterval {
  std::optional<double> low;
  std::optional<double> high;
};

/// @param searched index of a searched parameter of the term
ProfileInterval profileInterval(const GapSearch& search, const RefinedModel& refined, std::size_t term,
                                Eigen::Index searched);

}  // namespace fieldtrue::identify
