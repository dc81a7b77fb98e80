#include "tests/studies/staged_diagnosis.h"

#include "calib/gap/diagnosis.h"
#include "calib/gap/findings.h"
#include "calib/gap/verdict.h"
#include "tests/studies/rooms.h"

namespace fieldtrue::testing {
namespace {

using identify::Thresholds;

bool isRankedAlike(const std::vector<identify::TriedEffect>& a, const std::vector<identify::TriedEffect>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& one, const auto& other) {
    return one.way == other.way && one.bic_gain == other.bic_gain;
  });
}

bool isAlike(const identify::EffectSelection& a, const identify::EffectSelection& b) {
  return a.ways == b.ways && a.bic_gain == b.bic_gain && isRankedAlike(a.first, b.first) &&
         isRankedAlike(a.alternatives, b.alternatives);
}

}  // namespace

StagedDiagnosis::StagedDiagnosis(const CalibrationTable& table)
    : metadata_(table.metadata),
      cleaned_(recording::cleanRows(table)),
      rows_(orThrow(identify::makeGapRows(cleaned_.nodes, metadata_))) {
  search_ = std::make_unique<identify::GapSearch>(rows_, std::vector<std::unique_ptr<field::PhysicalEffect>>{});
  gap::GapReport unused;
  usual_ = std::make_unique<Stage>(staged({}, gap::addInputFindings(metadata_, *search_, unused)));
}

gap::GapReport StagedDiagnosis::under(const Thresholds& thresholds) {
  search_->decideBy(thresholds);
  gap::GapReport report;
  report.names = cleaned_.names;
  report.findings = cleaned_.findings;
  const bool belongs_together = gap::addInputFindings(metadata_, *search_, report);
  const gap::Judgement judgement = staged(thresholds, belongs_together).judgement;
  const bool has_gap = gap::decide(*search_, judgement, {}, report);
  for (const std::size_t way : judgement.selection.ways) {
    gap::SelectedEffect effect;
    effect.effect = search_->ways()[way].effect->id;
    for (const gap::GapCandidate& candidate : report.candidates)
      if (candidate.effect == effect.effect) static_cast<gap::GapCandidate&>(effect) = candidate;
    report.selected.push_back(std::move(effect));
  }
  if (belongs_together) gap::addFindings(*search_, rows_, judgement, has_gap, report);
  return report;
}

StagedDiagnosis::Stage StagedDiagnosis::staged(const Thresholds& thresholds, bool belongs_together) const {
  Stage stage;
  const bool has_enough = rows_.place_nodes.size() >= thresholds.fewest_places_for_causes;
  stage.most_effects = has_enough && belongs_together ? gap::DiagnosisOptions{}.most_effects : 0;
  stage.floor_m = search_->floorPlacingSd_m();
  stage.floor_rad = search_->floorPlacingSd_rad();
  stage.selection = selectsAsUsual(thresholds, stage.most_effects)
                        ? usual_->selection
                        : identify::selectEffects(*search_, {stage.most_effects}, {});
  stage.judgement =
      judgesAsUsual(thresholds, stage) ? usual_->judgement : gap::judge(*search_, stage.selection, RunControl{});
  return stage;
}

/// Where nothing is worth selecting, what further effects would need does not matter.
bool StagedDiagnosis::selectsAsUsual(const Thresholds& thresholds, int most_effects) const {
  const Thresholds usual;
  if (!usual_ || most_effects != usual_->most_effects || thresholds.implausible_cost != usual.implausible_cost ||
      thresholds.share_of_freer != usual.share_of_freer)
    return false;
  const std::vector<identify::TriedEffect>& first = usual_->selection.first;
  const double least_gain = std::min(thresholds.least_gain_first, usual.least_gain_first);
  const bool is_any_worth = std::any_of(first.begin(), first.end(), [&](const identify::TriedEffect& one) {
    return one.bic_gain >= least_gain && one.fitted.is_plausible && one.held_out_gain > 0.0;
  });
  if (!is_any_worth) return true;
  return thresholds.least_gain_first == usual.least_gain_first && thresholds.least_gain_more == usual.least_gain_more &&
         thresholds.least_gain_exchange == usual.least_gain_exchange &&
         thresholds.other_kind_start == usual.other_kind_start && thresholds.other_kind_share == usual.other_kind_share;
}

/// Where nothing is selected only the floor is weighed; else what the judgement compares with thresholds must fall on
/// the same sides of them.
bool StagedDiagnosis::judgesAsUsual(const Thresholds& thresholds, const Stage& stage) const {
  const Thresholds usual;
  if (!usual_ || !isAlike(stage.selection, usual_->selection)) return false;
  if (stage.floor_m != usual_->floor_m || stage.floor_rad != usual_->floor_rad) return false;
  if (stage.selection.ways.empty()) return true;
  if (thresholds.least_gain_first != usual.least_gain_first || thresholds.least_gain_more != usual.least_gain_more)
    return false;
  const gap::Judgement& judgement = usual_->judgement;
  const auto isSameSide = [](double value, double a, double b) { return (value >= a) == (value >= b); };
  if (thresholds.least_nats != usual.least_nats &&
      (stage.selection.ways.size() > 1 ||
       !isSameSide(judgement.nats_over_unnamed, thresholds.least_nats, usual.least_nats)))
    return false;
  const auto n_effects = static_cast<double>(judgement.refusal == gap::Refusal::kNone ? stage.selection.ways.size()
                                                                                      : judgement.refused.size());
  if (n_effects > 1.0 && !isSameSide(judgement.nats_over_unnamed, n_effects * thresholds.least_nats_of_several,
                                     n_effects * usual.least_nats_of_several))
    return false;
  return judgement.refusal == gap::Refusal::kForetellsNoBetter ||
         isSameSide(judgement.named_share, thresholds.least_share, usual.least_share);
}

}  // namespace fieldtrue::testing
