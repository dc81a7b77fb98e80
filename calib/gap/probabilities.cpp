#include "calib/gap/probabilities.h"

#include <algorithm>
#include <cmath>

namespace fieldtrue::gap {
namespace {

/// What does not help on places it was not fitted to counts for less; where nothing was worth selecting, nothing is
/// likelier than none.
double evidenceOf(const GapCandidate& c, bool is_any_fit, const MostEvidence& most,
                  const identify::Thresholds& thresholds) {
  if (isNameless(c.effect)) return c.bic_gain;
  const double evidence = most.of(c) - (c.shrinkage.fraction <= 0.0 ? thresholds.cost_of_failing : 0.0);
  return is_any_fit ? evidence : std::min(evidence, 0.0) - thresholds.cost_of_unselected;
}

/// Two names of one thing, as a wrong scale of the rig and of the tracker: the first carries the probability of both.
void joinExactTwins(const identify::Thresholds& thresholds, std::vector<GapCandidate>& candidates) {
  for (std::size_t a = 0; a < candidates.size(); ++a) {
    for (std::size_t b = a + 1; b < candidates.size(); ++b) {
      const auto& names = candidates[a].equivalents;
      const bool is_twin = std::find(names.begin(), names.end(), candidates[b].effect) != names.end() &&
                           std::abs(candidates[a].bic_gain - candidates[b].bic_gain) < thresholds.twin_evidence;
      if (!is_twin) continue;
      candidates[a].probability += candidates[b].probability;
      candidates[b].probability = 0.0;
    }
  }
}

double unknownShareOf(const GapCandidate& c, const identify::Thresholds& thresholds) {
  if (c.effect == "none") return thresholds.unknown_as_none;
  if (isNameless(c.effect)) return 0.0;
  return c.location_m ? thresholds.unknown_as_thing : thresholds.unknown_as_other;
}

/// The same, but so much at least that nothing comes before the first by what is left to it.
double unknownShareBehind(const GapCandidate& first, const GapCandidate& c, const identify::Thresholds& thresholds) {
  if (c.effect == kUnnamedSmooth) return 0.0;
  const double stays = (1.0 - unknownShareOf(first, thresholds)) * first.probability;
  return std::max(unknownShareOf(c, thresholds), 1.0 - stays / std::max(stays, c.probability));
}

/// What the catalogue does not hold is taken for a cause that it holds, or for nothing, in part of all recordings: that
/// part of the probability goes to a cause without a name, which does not become the first by it.
void leaveRoomForTheUnknown(const identify::Thresholds& thresholds, std::vector<GapCandidate>& candidates) {
  const auto by_probability = [](const GapCandidate& a, const GapCandidate& b) {
    return a.probability < b.probability;
  };
  const auto first = std::max_element(candidates.begin(), candidates.end(), by_probability);
  const auto unnamed = std::find_if(candidates.begin(), candidates.end(),
                                    [](const GapCandidate& c) { return c.effect == kUnnamedSmooth; });
  if (unnamed == candidates.end() || first == unnamed) return;
  double unknown = 0.0;
  std::vector<double> shares;
  for (const GapCandidate& c : candidates) {
    shares.push_back(unknownShareBehind(*first, c, thresholds));
    unknown += shares.back() * c.probability;
  }
  const double lead = first->probability - unnamed->probability;
  const double closing = unknown + unknownShareOf(*first, thresholds) * first->probability;
  const double part = closing < lead ? 1.0 : 0.999 * lead / closing;
  const double most = first->probability * (1.0 - part * unknownShareOf(*first, thresholds));
  for (std::size_t i = 0; i < candidates.size(); ++i)
    candidates[i].probability = std::min(most, candidates[i].probability * (1.0 - part * shares[i]));
  unnamed->probability += part * unknown;
}

}  // namespace

MostEvidence mostEvidence(const identify::GapSearch& search, const identify::EffectSelection& selection,
                          const std::vector<GapCandidate>& candidates) {
  if (selection.ways.empty()) return {};
  const std::string& leading = search.ways()[selection.ways.front()].effect->id;
  for (const GapCandidate& c : candidates)
    if (c.effect == leading) return {c.bic_gain, c.bic_gain - search.thresholds().implausible_cost};
  return {};
}

void setProbabilities(bool is_any_fit, const MostEvidence& most_of, const identify::Thresholds& thresholds,
                      std::vector<GapCandidate>& candidates) {
  const auto evidence = [&](const GapCandidate& c) { return evidenceOf(c, is_any_fit, most_of, thresholds); };
  double most = 0.0;
  for (const GapCandidate& c : candidates) most = std::max(most, evidence(c));
  double sum = 0.0;
  for (GapCandidate& c : candidates) {
    c.probability = std::exp(0.5 * (evidence(c) - most) / thresholds.temperature);
    sum += c.probability;
  }
  for (GapCandidate& c : candidates) c.probability /= sum;
  joinExactTwins(thresholds, candidates);
  leaveRoomForTheUnknown(thresholds, candidates);
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const GapCandidate& a, const GapCandidate& b) { return a.probability > b.probability; });
}

}  // namespace fieldtrue::gap
