#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "calib/gap/report.h"
#include "calib/identify/selection.h"

namespace fieldtrue::gap {

/// The most evidence that causes which are not named may have, where others are: each was refused for a reason, so
/// none is likelier than what is named, and what nobody would believe is less likely by what that costs.
struct MostEvidence {
  double plausible = std::numeric_limits<double>::infinity();
  double implausible = std::numeric_limits<double>::infinity();

  double of(const GapCandidate& c) const {
    return isNameless(c.effect) ? c.bic_gain : std::min(c.bic_gain, c.is_plausible ? plausible : implausible);
  }
};

/// @param candidates one of them as the leading effect that is named, if any is
MostEvidence mostEvidence(const identify::GapSearch& search, const identify::EffectSelection& selection,
                          const std::vector<GapCandidate>& candidates);

/// Gives the candidates their probabilities, with room for what the catalogue does not hold, and puts the best first;
/// of equals the one that stood before.
/// @param is_any_fit whether anything was selected, or refused as the name of a gap
void setProbabilities(bool is_any_fit, const MostEvidence& most_of, const identify::Thresholds& thresholds,
                      std::vector<GapCandidate>& candidates);

}  // namespace fieldtrue::gap
