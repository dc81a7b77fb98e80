#include "calib/gap/candidates.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "calib/gap/probabilities.h"
#include "calib/gap/term_description.h"
#include "calib/identify/profile.h"

namespace fieldtrue::gap {
namespace {

/// Where the profile likelihood of each searched parameter of each term falls by 2.706 / 2.
std::vector<std::vector<identify::ProfileInterval>> profilesOf(const identify::GapSearch& search,
                                                               const identify::RefinedModel& refined,
                                                               const RunControl& control) {
  std::vector<std::vector<identify::ProfileInterval>> of_terms;
  std::vector<std::pair<std::size_t, std::size_t>> parameters;
  for (std::size_t t = 0; t < refined.model.terms.size(); ++t) {
    of_terms.emplace_back(static_cast<std::size_t>(refined.model.terms[t].searched.size()));
    for (std::size_t d = 0; d < of_terms[t].size(); ++d) parameters.emplace_back(t, d);
  }
  control.parallel_for(parameters.size(), [&](std::size_t k) {
    const auto [t, d] = parameters[k];
    of_terms[t][d] = identify::profileInterval(search, refined, t, static_cast<Eigen::Index>(d));
  });
  return of_terms;
}

/// What an effect does to the whitened residuals of the model without it.
Eigen::VectorXd signalOf(const identify::GapSearch& search, const std::vector<identify::Vector6d>& without,
                         const identify::GapModel& with) {
  const std::vector<identify::Vector6d> left = identify::whitenedResiduals(search.physics(), with, search.whitening());
  Eigen::VectorXd signal(static_cast<Eigen::Index>(6 * left.size()));
  for (std::size_t i = 0; i < left.size(); ++i)
    signal.segment<6>(static_cast<Eigen::Index>(6 * i)) = without[i] - left[i];
  return signal;
}

double correlation2(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const double norms = a.squaredNorm() * b.squaredNorm();
  return norms > 0.0 ? a.dot(b) * a.dot(b) / norms : 0.0;
}

/// Sum of the squares that a model leaves, whitened.
double whitenedSquares(const identify::GapSearch& search, const identify::GapModel& model) {
  double sum = 0.0;
  for (const identify::Vector6d& r : identify::whitenedResiduals(search.physics(), model, search.whitening()))
    sum += r.squaredNorm();
  return sum;
}

void findEquivalents(const identify::GapSearch& search, const identify::EffectSelection& selection,
                     std::vector<GapCandidate>& candidates) {
  const std::vector<identify::TriedEffect>& tried = selection.alternatives;
  identify::GapModel rest = selection.model.model;
  if (!rest.terms.empty()) rest = identify::withoutTerm(std::move(rest), 0);
  const std::vector<identify::Vector6d> without =
      identify::whitenedResiduals(search.physics(), search.fitted(rest), search.whitening());
  std::vector<Eigen::VectorXd> signals;
  for (const identify::TriedEffect& one : tried) {
    signals.push_back(one.is_refined ? signalOf(search, without, one.model) : Eigen::VectorXd());
  }
  for (std::size_t a = 0; a < tried.size(); ++a) {
    candidates[a].equivalents = {candidates[a].effect};
    for (std::size_t b = 0; b < tried.size(); ++b) {
      if (a == b || signals[a].size() == 0 || signals[b].size() == 0) continue;
      if (std::abs(tried[a].bic_gain - tried[b].bic_gain) > search.thresholds().same_evidence) continue;
      if (correlation2(signals[a], signals[b]) > search.thresholds().same_signal)
        candidates[a].equivalents.push_back(candidates[b].effect);
    }
  }
}

Shrinkage shrinkageOf(double before_m2, double after_m2, const Bounded& left) {
  Shrinkage shrinkage{signedRoot_mm(before_m2), signedRoot_mm(after_m2), 1.0 - left.value, {}, {}};
  if (left.high90) shrinkage.low90 = 1.0 - *left.high90;
  if (left.low90) shrinkage.high90 = 1.0 - *left.low90;
  return shrinkage;
}

/// What an effect that was not selected would take away of places not seen: by its exact fit, less what that many
/// parameters take from noise and once more what they err by elsewhere; what the places it did not see say, where these
/// come off worse.
/// @source Mallows 1973, Technometrics 15 661 (C_p)
Shrinkage shrinkageOfTried(const identify::GapSearch& search, const identify::TriedEffect& tried, const HowFar& far,
                           double none) {
  double fall = tried.held_out_gain;
  if (tried.held_out_gain > 0.0 && tried.is_refined) {
    const auto parameters = static_cast<double>(identify::parametersOf(tried.model));
    fall = std::max(fall, none - whitenedSquares(search, tried.model) - 2.0 * parameters);
  }
  const double left = 1.0 - fall / far.whitened_excess;
  const double before_m2 = far.excess_m2.front().value;
  return shrinkageOf(before_m2, left * before_m2, {left, {}, {}});
}

/// The rivals without a name, weighed so that they stand against what was selected as the judgement found.
void addNameless(const Judgement& judgement, bool has_gap, double floor_excess, const MostEvidence& most_of,
                 const identify::Thresholds& thresholds, std::vector<GapCandidate>& candidates) {
  const double margin = thresholds.nameless_margin;
  const double before_m2 = judgement.far.excess_m2.front().value;
  const auto add = [&](const char* id, double evidence, double left) {
    GapCandidate nameless;
    nameless.effect = id;
    nameless.equivalents = {id};
    nameless.bic_gain = evidence;
    nameless.shrinkage = shrinkageOf(before_m2, left * before_m2, {left, {}, {}});
    candidates.push_back(std::move(nameless));
  };
  double best = 0.0;
  for (const GapCandidate& c : candidates) best = std::max(best, most_of.of(c));
  add("none", 0.0, 1.0);
  double smooth = -3.0 * margin;
  if (!judgement.selection.ways.empty())
    smooth = best - 2.0 * std::max(thresholds.least_nats, judgement.nats_over_unnamed);
  else if (judgement.refusal != Refusal::kNone && has_gap)
    smooth = best + std::max(0.5 * margin, -2.0 * judgement.nats_over_unnamed);
  else if (has_gap)
    smooth = std::max(margin, 2.0 * judgement.unnamed_nats);
  add(kUnnamedSmooth, smooth, judgement.smooth_left);
  const bool is_mostly_scattered = judgement.selection.ways.empty() && floor_excess > thresholds.mostly_scattered;
  add(kUnnamedScattered,
      floor_excess > 0.0 ? std::max(best, smooth) + (is_mostly_scattered ? margin : -margin) : -3.0 * margin,
      1.0 - floor_excess);
}

/// Which of the selected terms a candidate is: of an effect that was selected twice the first one.
std::optional<std::size_t> selectedAs(const identify::GapSearch& search, const identify::EffectSelection& selection,
                                      const std::string& effect) {
  const auto is = [&](std::size_t t) { return search.ways()[selection.ways[t]].effect->id == effect; };
  for (std::size_t t = 0; t < selection.ways.size(); ++t)
    if (is(t)) return t;
  return std::nullopt;
}

/// The leading one of the named causes stands before all that are no likelier.
void putLeadingFirst(const std::string& leading, std::vector<GapCandidate>& candidates) {
  std::stable_partition(candidates.begin(), candidates.end(),
                        [&](const GapCandidate& c) { return c.effect == leading; });
}

/// Whatever is as likely as the leading one, these readings cannot tell from it, though its signal is another.
/// @param candidates best first
void joinEquallyLikely(const std::string& named, std::vector<GapCandidate>& candidates) {
  constexpr double kEqual = 1.0 - 1e-9;  // But for rounding.
  GapCandidate& leading = candidates.front();
  if (leading.effect != named) return;
  for (GapCandidate& c : candidates) {
    if (isNameless(c.effect) || c.probability < kEqual * leading.probability ||
        std::find(leading.equivalents.begin(), leading.equivalents.end(), c.effect) != leading.equivalents.end())
      continue;
    leading.equivalents.push_back(c.effect);
    c.equivalents.push_back(leading.effect);
  }
}

}  // namespace

std::vector<GapCandidate> describeCandidates(const identify::GapSearch& search, const Judgement& judgement,
                                             bool has_gap, double scattered_share) {
  const identify::EffectSelection& selection = judgement.selection;
  const double none = whitenedSquares(search, search.none().model);
  std::vector<GapCandidate> candidates;
  for (const identify::TriedEffect& tried : selection.alternatives) {
    GapCandidate candidate;
    const identify::RefinedModel model =
        tried.is_refined ? search.withCovariance(tried.model) : identify::RefinedModel{tried.model, {}, 0, 0.0};
    describeTerm(model, model.model.terms.size() - 1, {}, search.thresholds(), candidate);
    candidate.bic_gain = tried.bic_gain;
    candidate.shrinkage = shrinkageOfTried(search, tried, judgement.far, none);
    candidates.push_back(std::move(candidate));
  }
  findEquivalents(search, selection, candidates);
  for (GapCandidate& c : candidates)
    if (const auto t = selectedAs(search, selection, c.effect)) c.shrinkage = shrinkageOfStep(judgement.far, *t);
  const std::string named = selection.ways.empty() ? "" : search.ways()[selection.ways.front()].effect->id;
  putLeadingFirst(named, candidates);
  const MostEvidence most_of = mostEvidence(search, selection, candidates);
  addNameless(judgement, has_gap, scattered_share, most_of, search.thresholds(), candidates);
  const bool is_refused_gap = judgement.refusal != Refusal::kNone && has_gap;
  setProbabilities(!selection.ways.empty() || is_refused_gap, most_of, search.thresholds(), candidates);
  if (!selection.ways.empty()) joinEquallyLikely(named, candidates);
  return candidates;
}

Shrinkage shrinkageOfStep(const HowFar& far, std::size_t effect) {
  return shrinkageOf(far.excess_m2[effect].value, far.excess_m2[effect + 1].value, far.left_of_before[effect + 1]);
}

namespace {

/// The leading effect is the candidate that it is.
void takeOver(const std::vector<GapCandidate>& candidates, SelectedEffect& leading) {
  for (const GapCandidate& c : candidates) {
    if (c.effect != leading.effect) continue;
    leading.equivalents = c.equivalents;
    leading.probability = c.probability;
    leading.bic_gain = c.bic_gain;
  }
}

/// An effect that stands beside the leading one is weighed against its absence.
void setBeside(const identify::GapSearch& search, const identify::GapModel& model, std::size_t term,
               SelectedEffect& effect) {
  effect.bic_gain = search.bicOf(search.fitted(identify::withoutTerm(model, term))) - search.bicOf(model);
  effect.probability = 1.0 / (1.0 + std::exp(-0.5 * effect.bic_gain / search.thresholds().temperature));
  effect.equivalents = {effect.effect};
}

}  // namespace

std::vector<SelectedEffect> describeSelected(const identify::GapSearch& search, const Judgement& judgement,
                                             const std::vector<GapCandidate>& candidates, const RunControl& control) {
  const identify::EffectSelection& selection = judgement.selection;
  const std::vector<double> credit = creditShares(search, selection, control);
  const auto profiles = profilesOf(search, selection.model, control);
  std::vector<SelectedEffect> selected;
  for (std::size_t t = 0; t < selection.ways.size(); ++t) {
    SelectedEffect effect;
    describeTerm(selection.model, t, profiles[t], search.thresholds(), effect);
    effect.credit_fraction = credit[t];
    if (t == 0) {
      takeOver(candidates, effect);
    } else {
      setBeside(search, selection.model.model, t, effect);
    }
    effect.shrinkage = shrinkageOfStep(judgement.far, t);
    effect.excess2_before_mm2 = 1e6 * judgement.far.excess_m2[t].value;
    effect.excess2_after_mm2 = 1e6 * judgement.far.excess_m2[t + 1].value;
    selected.push_back(std::move(effect));
  }
  return selected;
}

std::vector<double> creditShares(const identify::GapSearch& search, const identify::EffectSelection& selection,
                                 const RunControl& control) {
  const std::size_t n = selection.ways.size();
  if (n == 0) return {};
  if (n == 1) return {1.0};
  const identify::GapModel& full = selection.model.model;
  std::vector<double> value(std::size_t{1} << n, 0.0);
  control.parallel_for(value.size(), [&](std::size_t subset) {
    identify::GapModel model;
    model.alignment = full.alignment;
    for (std::size_t t = 0; t < n; ++t)
      if ((subset >> t & 1U) != 0) model.terms.push_back(full.terms[t]);
    value[subset] = -whitenedSquares(search, search.fitted(model));
  });
  const auto factorial = [](std::size_t k) { return std::tgamma(static_cast<double>(k) + 1.0); };
  std::vector<double> credit(n, 0.0);
  for (std::size_t t = 0; t < n; ++t) {
    for (std::size_t subset = 0; subset < value.size(); ++subset) {
      if ((subset >> t & 1U) != 0) continue;
      const auto size = static_cast<std::size_t>(std::popcount(subset));
      credit[t] += factorial(size) * factorial(n - size - 1) / factorial(n) *
                   (value[subset | std::size_t{1} << t] - value[subset]);
    }
  }
  const double total = std::max(1e-12, value.back() - value.front());
  for (double& share : credit) share /= total;
  return credit;
}

}  // namespace fieldtrue::gap
