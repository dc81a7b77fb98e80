#include "calib/gap/judgement.h"

#include <algorithm>
#include <cmath>

namespace fieldtrue::gap {
namespace {

std::string idOf(const identify::GapSearch& search, const identify::EffectSelection& selection, std::size_t term) {
  return search.ways()[selection.ways[term]].effect->id;
}

class Judge {
 public:
  Judge(const identify::GapSearch& search, const RunControl& control)
      : search_(search), control_(control), rival_(search), rows_(search.physics().rows()) {
    none_left_ = search.physics().residuals(search.none().model);
    laws_.alone = rival_.likeliestLaws(none_left_);
    alone_ = rival_.logEvidence(none_left_, laws_.alone);
  }

  Judgement run(identify::EffectSelection selection) {
    Judgement judgement;
    judgement.selection = std::move(selection);
    judgement.unnamed_nats = alone_ - rival_.logEvidence(none_left_, {});
    dropIdle(judgement);
    UnseenScores scores = scored(judgement.selection, scattered_);
    while (dropHarmful(scores, judgement)) scores = scored(judgement.selection, scattered_);
    if (!judgement.dropped.empty()) identify::rankAnew(search_, judgement.selection, control_);
    if (!judgement.selection.ways.empty() && !control_.stop.stop_requested()) weigh(scores, judgement);
    if (judgement.refusal != Refusal::kNone) {
      for (std::size_t t = 0; t < judgement.selection.ways.size(); ++t)
        judgement.refused.push_back(idOf(search_, judgement.selection, t));
      clear(judgement.selection);
      scores.step.resize(1);
      scores.both = scores.smooth;
    }
    judgement.left = leftBy(search_, judgement.selection.model.model);
    judgement.far = howFar(scores, noiseLeftBy(search_, judgement.left.structure), rows_);
    tellRest(scores, judgement);
    return judgement;
  }

 private:
  void tellRest(const UnseenScores& scores, Judgement& judgement) const {
    std::vector<double> smooth_m2, rest_m2;
    for (std::size_t i = 0; i < rows_.rows.size(); ++i) {
      smooth_m2.push_back(scores.smooth[i].square_m2 - scores.step.front()[i].square_m2);
      rest_m2.push_back(scores.step.back()[i].square_m2 - scores.both[i].square_m2);
    }
    judgement.rest_m2 = meanOverRegion(rows_, rest_m2);
    judgement.smooth_left = 1.0 + meanOverRegion(rows_, smooth_m2) / judgement.far.excess_m2.front().value;
  }

  UnseenScores scored(const identify::EffectSelection& selection, std::span<const int> blocks) const {
    return scoreUnseen(search_, selection, rival_, laws_, blocks, control_);
  }

  /// Log evidence of a model with a smooth rest over a smooth field alone, every parameter of its effects paid for.
  double natsOf(const identify::GapModel& model, identify::UnnamedLaws& laws) const {
    const std::vector<identify::Vector6d> left = search_.physics().residuals(model);
    laws = rival_.likeliestLaws(left);
    const auto parameters = static_cast<double>(identify::parametersOf(model));
    const double count = static_cast<double>(rows_.rows.size()) * rows_.channels();
    return rival_.logEvidence(left, laws) - 0.5 * parameters * std::log(count) - alone_;
  }

  /// Takes out effects that a smooth rest does without.
  void dropIdle(Judgement& judgement) {
    identify::EffectSelection& selection = judgement.selection;
    if (selection.ways.empty()) return;
    judgement.nats_over_unnamed = natsOf(selection.model.model, laws_.beside);
    while (selection.ways.size() > 1 && !control_.stop.stop_requested()) {
      double least = search_.thresholds().least_nats;
      std::optional<std::size_t> idle;
      const std::vector<identify::GapModel> rests = withoutEach(selection);
      std::vector<double> nats(rests.size());
      std::vector<identify::UnnamedLaws> laws(rests.size());
      control_.parallel_for(rests.size(), [&](std::size_t t) { nats[t] = natsOf(rests[t], laws[t]); });
      for (std::size_t t = 0; t < rests.size(); ++t) {
        if (judgement.nats_over_unnamed - nats[t] >= least) continue;
        least = judgement.nats_over_unnamed - nats[t];
        idle = t;
      }
      if (!idle) return;
      drop(*idle, rests[*idle], judgement);
      judgement.nats_over_unnamed = nats[*idle];
      laws_.beside = laws[*idle];
    }
  }

  /// Whether unseen places come off no better with one effect more than without it in units of the noise, or worse in
  /// the figures that are told.
  bool harms(const UnseenScores& scores, std::size_t step, const Judgement& judgement) const {
    if (pairedDifference(scores.step[step + 1], scores.step[step], rows_).value >= 0.0) return true;
    const bool in_position = isLarger(scores, step, &UnseenRow::square_m2);
    if (!rows_.has_orientation) return in_position;
    const bool in_rotation = isLarger(scores, step, &UnseenRow::square_rad2);
    if (in_position == in_rotation) return in_position;
    const RowNoise noise = noiseLeftBy(search_, leftBy(search_, judgement.selection.model.model).structure);
    return howFar(scores, noise, rows_).by_rotation ? in_rotation : in_position;
  }

  bool isLarger(const UnseenScores& scores, std::size_t step, double UnseenRow::*square) const {
    constexpr double kRounding = 1e-9;
    const auto mean = [&](const std::vector<UnseenRow>& rows) {
      std::vector<double> squares;
      for (const UnseenRow& row : rows) squares.push_back(row.*square);
      return meanOverRegion(rows_, squares);
    };
    return mean(scores.step[step + 1]) > (1.0 + kRounding) * mean(scores.step[step]);
  }

  /// Where unseen places come off no better with one effect more than without it, takes out the one that the rows miss
  /// least: the folds choose for themselves, so that what a step adds in them need not be what it adds in the whole.
  bool dropHarmful(const UnseenScores& scores, Judgement& judgement) {
    identify::EffectSelection& selection = judgement.selection;
    bool is_harmful = false;
    for (std::size_t s = 0; s + 1 < scores.step.size(); ++s) is_harmful = is_harmful || harms(scores, s, judgement);
    if (!is_harmful || control_.stop.stop_requested()) return false;
    const std::vector<identify::GapModel> rests = withoutEach(selection);
    std::vector<double> bic;
    for (const identify::GapModel& rest : rests) bic.push_back(search_.bicOf(rest));
    const auto least_missed = static_cast<std::size_t>(std::min_element(bic.begin(), bic.end()) - bic.begin());
    drop(least_missed, rests[least_missed], judgement);
    judgement.nats_over_unnamed = selection.ways.empty() ? 0.0 : natsOf(selection.model.model, laws_.beside);
    return true;
  }

  /// Each effect left out in turn.
  std::vector<identify::GapModel> withoutEach(const identify::EffectSelection& selection) const {
    std::vector<identify::GapModel> rests(selection.ways.size());
    control_.parallel_for(rests.size(), [&](std::size_t term) {
      rests[term] = search_.fitted(identify::withoutTerm(selection.model.model, term));
    });
    return rests;
  }

  void drop(std::size_t term, const identify::GapModel& rest, Judgement& judgement) const {
    identify::EffectSelection& selection = judgement.selection;
    judgement.dropped.push_back(idOf(search_, selection, term));
    selection.ways.erase(selection.ways.begin() + static_cast<std::ptrdiff_t>(term));
    selection.model = selection.ways.empty() ? search_.none() : search_.withCovariance(rest);
  }

  void clear(identify::EffectSelection& selection) const {
    selection.ways.clear();
    selection.model = search_.none();
    selection.alternatives = selection.first;
  }

  void weigh(const UnseenScores& scores, Judgement& judgement) {
    const identify::EffectSelection& selection = judgement.selection;
    const bool in_time = search_.ways()[selection.ways.front()].needs_time;
    const UnseenScores far = scored(selection, in_time ? search_.timeBlocksOfRows() : search_.spaceBlocks());
    judgement.unseen_gain = pairedDifference(far.smooth, far.both, rows_);
    const double by_effects = pairedDifference(scores.step.front(), scores.step.back(), rows_).value;
    const double by_both = pairedDifference(scores.step.front(), scores.both, rows_).value;
    if (by_both > 0.0) judgement.named_share = by_effects / by_both;
    const bool foretells_better = judgement.unseen_gain.low90.value_or(-1.0) > 0.0;
    const bool foretells_worse = judgement.unseen_gain.high90.value_or(1.0) < 0.0;
    const bool is_likelier = judgement.nats_over_unnamed >= leastNatsOf(selection.ways.size()) && !foretells_worse;
    if (!foretells_better && !is_likelier)
      judgement.refusal = Refusal::kForetellsNoBetter;
    else if (judgement.named_share < search_.thresholds().least_share)
      judgement.refusal = Refusal::kSmallShare;
  }

  double leastNatsOf(std::size_t n_effects) const {
    const identify::Thresholds& thresholds = search_.thresholds();
    return n_effects < 2 ? thresholds.least_nats : thresholds.least_nats_of_several * static_cast<double>(n_effects);
  }

  const identify::GapSearch& search_;
  const RunControl& control_;
  identify::UnnamedRival rival_;
  const identify::GapRows& rows_;
  std::vector<identify::Vector6d> none_left_;
  RivalLaws laws_;
  double alone_ = 0.0;
  std::vector<int> scattered_ = scatteredBlocks(rows_);
};

}  // namespace

LeftOver leftBy(const identify::GapSearch& search, const identify::GapModel& model) {
  const identify::GapRows& rows = search.physics().rows();
  const identify::Linearized at(search.physics(), model, search.whitening(), search.spaceBlocks());
  return {identify::findStructure(at, rows, false), identify::findTraces(at, rows, model)};
}

Judgement judge(const identify::GapSearch& search, identify::EffectSelection selection, const RunControl& control) {
  return Judge(search, control).run(std::move(selection));
}

}  // namespace fieldtrue::gap
