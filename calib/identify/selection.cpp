#include "calib/identify/selection.h"

#include <algorithm>
#include <limits>
#include <list>
#include <optional>

namespace fieldtrue::identify {
namespace {

class Selector {
 public:
  Selector(const GapSearch& search, const EffectSelectionOptions& options, const RunControl& control)
      : search_(search), thresholds_(search.thresholds()), options_(options), control_(control) {}

  EffectSelection run() {
    none_bic_ = search_.bicOf(search_.none().model);
    if (options_.most_effects < 1) return finished({}, {});
    const std::vector<TriedEffect>& first = ranked(search_.none().model);
    const TriedEffect* best = firstWorth(first, thresholds_.least_gain_first);
    if (best == nullptr || control_.stop.stop_requested()) return finished({}, first);
    EffectSelection selection = grown({}, best);
    EffectSelection second = grownOfOtherKind(first, *best);
    if (second.bic_gain > selection.bic_gain) selection = std::move(second);
    return finished(std::move(selection), first);
  }

  void rankAnew(EffectSelection& selection) {
    selection.alternatives = selection.first;
    if (selection.ways.size() > 1) rankAlternatives(selection);
    holdLeading(selection);
    settle(selection);
  }

 private:
  /// What rankEffects makes of a model. Exchanging effects and looking for the leading one ask for the same again.
  const std::vector<TriedEffect>& ranked(const GapModel& base) {
    for (const Ranked& one : ranked_)
      if (isSame(one.model, base)) return one.tried;
    ranked_.push_back({base, rankEffects(search_, base, control_)});
    return ranked_.back().tried;
  }

  /// The best effect worth adding: enough evidence, believable, and better on what it was not fitted to.
  const TriedEffect* firstWorth(const std::vector<TriedEffect>& tried, double least_gain) const {
    for (const TriedEffect& one : tried) {
      if (one.bic_gain < least_gain) break;
      if (only_kind_ && isInRoom(one) != *only_kind_) continue;
      if (one.fitted.is_plausible && one.held_out_gain > 0.0 && !namesOneTwice(one.model)) return &one;
    }
    return nullptr;
  }

  /// Whether two terms of a model are one cause. Two things of one kind may stand in the room; nearer to each other
  /// than the farther of them is to the nearest place, readings do not tell them from one thing of another shape.
  bool namesOneTwice(const GapModel& model) const {
    for (std::size_t a = 0; a < model.terms.size(); ++a) {
      for (std::size_t b = a + 1; b < model.terms.size(); ++b) {
        if (model.terms[a].effect != model.terms[b].effect) continue;
        const auto first_m = placeOf_m(model.terms[a]);
        const auto second_m = placeOf_m(model.terms[b]);
        if (!first_m || !second_m) return true;
        const double resolved_m = std::max(toNearestPlace_m(*first_m), toNearestPlace_m(*second_m));
        if ((*first_m - *second_m).norm() < resolved_m) return true;
      }
    }
    return false;
  }

  static std::optional<Eigen::Vector3d> placeOf_m(const GapTerm& term) {
    return term.fit->describe(term.searched, term.linear).location_m;
  }

  double toNearestPlace_m(const Eigen::Vector3d& p_m) const {
    double nearest_m = std::numeric_limits<double>::infinity();
    for (const field::SensorSetting& setting : search_.design().settings)
      nearest_m = std::min(nearest_m, (setting.tracker_from_sensor.position_m - p_m).norm());
    return nearest_m;
  }

  static bool isInRoom(const TriedEffect& tried) { return tried.fitted.location_m.has_value(); }

  /// Adds the next effect, and others while they are worth it.
  EffectSelection grown(EffectSelection selection, const TriedEffect* next) {
    while (next != nullptr && !control_.stop.stop_requested()) {
      EffectSelection grown = selection;
      add(*next, grown);
      if (grown.ways.size() > 1) {
        exchange(grown);
        prune(grown);
        // What is added on an estimate can be dropped again once it is fitted, and would be added again for ever, for
        // less and less: where there are no more effects than before, it is an exchange, and must gain as much.
        const double least = grown.ways.size() > selection.ways.size() ? 0.0 : thresholds_.least_gain_exchange;
        if (!(priceOf(grown) < priceOf(selection) - least) || namesOneTwice(grown.model.model)) break;
      }
      selection = std::move(grown);
      if (static_cast<int>(selection.ways.size()) >= options_.most_effects) break;
      next = firstWorth(ranked(selection.model.model), thresholds_.least_gain_more);
    }
    selection.bic_gain = selection.ways.empty() ? 0.0 : none_bic_ - search_.bicOf(selection.model.model);
    return selection;
  }

  /// One flexible thing in the room can pass for two errors of the instrument, and the other way round. Grown step by
  /// step the two are never met, as the first of them falls behind that thing: so the other kind is grown by itself,
  /// and with the rest of the catalogue from where it explains a good part.
  EffectSelection grownOfOtherKind(const std::vector<TriedEffect>& first, const TriedEffect& best) {
    only_kind_ = !isInRoom(best);
    const double least = std::max(thresholds_.least_gain_first, thresholds_.other_kind_start * best.bic_gain);
    EffectSelection selection = grown({}, firstWorth(first, least));
    only_kind_.reset();
    if (selection.bic_gain < std::max(least, thresholds_.other_kind_share * best.bic_gain)) return {};
    if (static_cast<int>(selection.ways.size()) >= options_.most_effects) return selection;
    return grown(selection, firstWorth(ranked(selection.model.model), thresholds_.least_gain_more));
  }

  EffectSelection finished(EffectSelection selection, const std::vector<TriedEffect>& first) {
    if (selection.ways.empty()) selection.model = search_.none();
    selection.first = first;
    selection.alternatives = first;
    if (selection.ways.size() > 1) findLeading(selection);
    if (selection.ways.size() == 1) takeOver(selection);
    holdLeading(selection);
    settle(selection);
    selection.bic_gain = none_bic_ - search_.bicOf(selection.model.model);
    return selection;
  }

  /// What growing lowers: the criterion, and for each effect what it must at least be worth.
  double priceOf(const EffectSelection& selection) const {
    return search_.bicOf(selection.model.model) +
           thresholds_.least_gain_more * static_cast<double>(selection.ways.size());
  }

  void add(const TriedEffect& tried, EffectSelection& selection) const {
    selection.model.model = fittedOf(tried);
    selection.ways.push_back(tried.way);
  }

  GapModel fittedOf(const TriedEffect& tried) const {
    return tried.is_refined ? tried.model : search_.fitted(tried.model);
  }

  /// Covariance and cost are told of what is selected in the end.
  void settle(EffectSelection& selection) const {
    if (!selection.ways.empty()) selection.model = search_.withCovariance(selection.model.model);
  }

  GapModel without(const EffectSelection& selection, std::size_t term) const {
    return search_.fitted(withoutTerm(selection.model.model, term));
  }

  /// Each effect left out in turn.
  std::vector<GapModel> withoutEach(const EffectSelection& selection) const {
    std::vector<GapModel> rests(selection.ways.size());
    control_.parallel_for(rests.size(), [&](std::size_t term) { rests[term] = without(selection, term); });
    return rests;
  }

  /// Replaces earlier effects by others where these are better now that the last one is there.
  void exchange(EffectSelection& selection) {
    for (std::size_t term = 0; term + 1 < selection.ways.size(); ++term) {
      const double bic = search_.bicOf(selection.model.model);
      const GapModel rest = without(selection, term);
      const std::vector<TriedEffect>& tried = ranked(rest);
      if (tried.empty()) return;
      const TriedEffect* best = firstWorth(tried, 0.0);
      if (best == nullptr || search_.bicOf(best->model) > bic - thresholds_.least_gain_exchange) continue;
      selection.ways.erase(selection.ways.begin() + static_cast<std::ptrdiff_t>(term));
      selection.model.model = fittedOf(*best);
      selection.ways.push_back(best->way);
    }
  }

  /// Drops effects whose removal costs less than they are worth, the cheapest first.
  void prune(EffectSelection& selection) {
    while (selection.ways.size() > 1) {
      const double bic = search_.bicOf(selection.model.model);
      double least = thresholds_.least_gain_more;
      std::optional<std::size_t> cheapest;
      std::vector<GapModel> rests = withoutEach(selection);
      for (std::size_t term = 0; term < rests.size(); ++term) {
        const double cost = search_.bicOf(rests[term]) - bic;
        if (cost >= least) continue;
        least = cost;
        cheapest = term;
      }
      if (!cheapest) return;
      selection.model.model = std::move(rests[*cheapest]);
      selection.ways.erase(selection.ways.begin() + static_cast<std::ptrdiff_t>(*cheapest));
    }
  }

  /// A single effect that exchanging and dropping ended at may be worse than another alone.
  void takeOver(EffectSelection& selection) const {
    const double gain = none_bic_ - search_.bicOf(selection.model.model);
    const effects::Effect* effect = search_.ways()[selection.ways.front()].effect;
    const TriedEffect* best = firstWorth(selection.alternatives, gain + thresholds_.least_gain_exchange);
    if (best == nullptr || search_.ways()[best->way].effect == effect) return;
    selection.ways.clear();
    add(*best, selection);
  }

  /// The effect whose absence costs most leads, and stands first; the candidates are its alternatives with the others
  /// present.
  void findLeading(EffectSelection& selection) {
    rankAlternatives(selection);
    const double bic = search_.bicOf(selection.model.model);
    const TriedEffect* best = firstWorth(selection.alternatives, 0.0);
    if (best == nullptr || search_.bicOf(best->model) > bic - thresholds_.least_gain_exchange) return;
    selection.ways.erase(selection.ways.begin());
    add(*best, selection);
    putFirst(selection.ways.size() - 1, selection);
  }

  void rankAlternatives(EffectSelection& selection) {
    std::vector<double> costs;
    const std::vector<GapModel> rests = withoutEach(selection);
    for (const GapModel& rest : rests) costs.push_back(search_.bicOf(rest));
    const auto leading = static_cast<std::size_t>(std::max_element(costs.begin(), costs.end()) - costs.begin());
    selection.alternatives = ranked(rests[leading]);
    putFirst(leading, selection);
  }

  void putFirst(std::size_t term, EffectSelection& selection) const {
    if (term == 0) return;
    const auto at = static_cast<std::ptrdiff_t>(term);
    GapModel model = selection.model.model;
    std::rotate(model.terms.begin(), model.terms.begin() + at, model.terms.begin() + at + 1);
    std::rotate(selection.ways.begin(), selection.ways.begin() + at, selection.ways.begin() + at + 1);
    selection.model.model = search_.fitted(model);
  }

  /// Among the alternatives the leading effect stands as it was selected, where that is the better fit: it was tried
  /// before the others were there.
  void holdLeading(EffectSelection& selection) const {
    if (selection.ways.empty()) return;
    const std::size_t leading = selection.ways.front();
    const double gain = search_.bicOf(without(selection, 0)) - search_.bicOf(selection.model.model);
    for (TriedEffect& tried : selection.alternatives) {
      if (search_.ways()[tried.way].effect != search_.ways()[leading].effect || tried.bic_gain >= gain) continue;
      GapModel last = withoutTerm(selection.model.model, 0);
      last.terms.push_back(selection.model.model.terms.front());
      tried.way = leading;
      tried.model = search_.fitted(last);
      tried.is_refined = true;
      tried.bic_gain = gain;
    }
  }

  struct Ranked {
    GapModel model;
    std::vector<TriedEffect> tried;
  };

  const GapSearch& search_;
  const Thresholds& thresholds_;
  const EffectSelectionOptions& options_;
  const RunControl& control_;
  double none_bic_ = 0.0;
  std::optional<bool> only_kind_;  ///< In the room, or not: what may be added; either where it is empty.
  std::list<Ranked> ranked_;
};

}  // namespace

EffectSelection selectEffects(const GapSearch& search, const EffectSelectionOptions& options,
                              const RunControl& control) {
  return Selector(search, options, control).run();
}

void rankAnew(const GapSearch& search, EffectSelection& selection, const RunControl& control) {
  Selector(search, {}, control).rankAnew(selection);
}

}  // namespace fieldtrue::identify
