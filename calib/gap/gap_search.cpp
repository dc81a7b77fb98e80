#include "calib/gap/gap_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "calib/core/statistics.h"

namespace fieldtrue {
namespace {

constexpr double kGuessedPlacing_m = 1e-3;
constexpr double kGuessedPlacing_rad = 3e-3;
constexpr double kImplausibleCost = 12.0;  // In BIC units.

bool isOfTime(const std::string& effect) { return effect == "gain_drift" || effect == "metal_moved"; }

double pitchOf_m(std::span<const SensorSetting> settings) {
  std::vector<double> nearest_m;
  for (const SensorSetting& a : settings) {
    double least = std::numeric_limits<double>::infinity();
    for (const SensorSetting& b : settings) {
      const double d = (a.tracker_from_sensor.position_m - b.tracker_from_sensor.position_m).norm();
      if (d > 0.03) least = std::min(least, d);
    }
    if (std::isfinite(least)) nearest_m.push_back(least);
    if (nearest_m.size() > 300) break;
  }
  return nearest_m.empty() ? 0.1 : median(std::move(nearest_m));
}

int parametersOf(const GapTerm& term) { return static_cast<int>(term.linear.size() + term.searched.size()); }

}  // namespace

GapSearch::GapSearch(const GapRows& rows, std::vector<std::unique_ptr<PhysicalEffect>> believed, NoiseFrom noise)
    : rows_(rows), physics_(rows, std::move(believed)), space_blocks_(octantBlocks(rows)) {
  time_blocks_ = rows.has_times ? timeBlocks(rows) : space_blocks_;
  none_.model.alignment = initialAlignment(rows);
  placing_sd_m_ = rows.placing_sd_m.value_or(kGuessedPlacing_m);
  placing_sd_rad_ = rows.placing_sd_rad.value_or(kGuessedPlacing_rad);
  if (noise == NoiseFrom::kResiduals) settleNoise();
  whitening_ = makeWhitening(rows, placing_sd_m_, placing_sd_rad_);
  none_ = refineJointly(physics_, none_.model, whitening_, {law_});
  settleWays();
}

/// Where the rig's tolerance is not stated, it is what the flexible fit leaves beyond the samples' noise; the law of
/// the residuals is the one under which that remainder is most likely.
void GapSearch::settleNoise() {
  for (int round = 0; round < 3; ++round) {
    whitening_ = makeWhitening(rows_, placing_sd_m_, placing_sd_rad_);
    none_ = refineJointly(physics_, none_.model, whitening_, {});
    structure_ = findStructure(Linearized(physics_, none_.model, whitening_, space_blocks_), rows_, round == 2);
    // A stated tolerance may be wrong: position and rotation must weigh as they deserve, so both follow the remainder.
    placing_sd_m_ *= std::clamp(structure_.scale.position, 0.05, 20.0);
    placing_sd_rad_ *= std::clamp(structure_.scale.rotation, 0.05, 20.0);
  }
  double best = std::numeric_limits<double>::infinity();
  for (const double nu : {4.0, 8.0, 100.0}) {
    const double deviance = devianceOf(structure_.left, rows_.has_orientation, {nu}).value;
    if (deviance < best) {
      best = deviance;
      law_.degrees_of_freedom = nu;
    }
  }
}

void GapSearch::settleWays() {
  settings_ = physics_.settings(none_.model.alignment);
  design_.settings = settings_;
  for (const SensorSetting& setting : settings_) design_.places_m.extend(setting.tracker_from_sensor.position_m);
  design_.pitch_m = pitchOf_m(settings_);
  design_.has_times = rows_.has_times;
  const auto by_time = [](const GapRow& a, const GapRow& b) { return a.time_s < b.time_s; };
  const auto [first, last] = std::minmax_element(rows_.rows.begin(), rows_.rows.end(), by_time);
  design_.start_s = first->time_s;
  design_.end_s = last->time_s;
  design_.alignment_known = rows_.alignment_known;
  design_.has_orientation = rows_.has_orientation;
  design_.several_orientations = rows_.several_orientations;
  design_.excitation = rows_.excitation;
  for (const Effect& effect : effects()) {
    if (effect.fits == nullptr) continue;
    for (auto& fit : effect.fits(design_)) ways_.push_back({&effect, std::move(fit), isOfTime(effect.id)});
  }
}

double GapSearch::bicOf(const GapModel& model) const {
  const std::vector<Vector6d> left = whitenedResiduals(physics_, model, whitening_);
  double parameters = 0.0;
  for (const GapTerm& term : model.terms) parameters += parametersOf(term);
  const double count = static_cast<double>(rows_.rows.size()) * rows_.channels();
  return devianceOf(left, rows_.has_orientation, law_).value + parameters * std::log(count) +
         priorCost(physics_, model);
}

RefinedModel GapSearch::refined(const GapModel& start, std::span<const char> used) const {
  RefineOptions options;
  options.law = law_;
  options.used = used;
  return refineJointly(physics_, start, whitening_, options);
}

RefinedModel GapSearch::refinedWithout(const GapModel& start, Eigen::Index frozen) const {
  RefineOptions options;
  options.law = law_;
  options.frozen = frozen;
  options.most_steps = 8;
  return refineJointly(physics_, start, whitening_, options);
}

std::optional<TriedEffect> GapSearch::tryWay(std::size_t way, const Linearized& in_space, const Linearized& in_time,
                                             const RefinedModel& base, const RunControl& control) const {
  constexpr std::size_t kStarts = 5;
  const EffectWay& chosen = ways_[way];
  const Linearized& at = chosen.needs_time ? in_time : in_space;
  TriedEffect tried;
  tried.way = way;
  tried.scan = scan(at, *chosen.fit, kStarts, control);
  if (tried.scan.best.empty()) return std::nullopt;
  std::optional<LocalFit> best;
  for (const ScanResult::Start& start : tried.scan.best) {
    LocalFit local = refineLocally(at, *chosen.fit, start.searched);
    if (!best || local.gain > best->gain) best = std::move(local);
  }
  tried.model = base.model;
  tried.model.terms.push_back({chosen.effect, chosen.fit, best->searched, best->linear});
  const double count = static_cast<double>(rows_.rows.size()) * rows_.channels();
  const double sum = at.residual().squaredNorm();
  const double left = std::max(1e-9 * sum, sum - best->gain);
  tried.bic_gain = count * std::log(sum / left) - parametersOf(tried.model.terms.back()) * std::log(count);
  tried.held_out_gain = std::accumulate(tried.scan.held_out_gain.begin(), tried.scan.held_out_gain.end(), 0.0);
  return tried;
}

void GapSearch::finish(TriedEffect& tried, const RefinedModel& base, double base_bic) const {
  tried.refined = refined(tried.model);
  tried.model = tried.refined.model;
  const GapTerm& term = tried.model.terms.back();
  tried.fitted = term.fit->describe(term.searched, term.linear);
  tried.bic_gain = base_bic - bicOf(tried.model) - (tried.fitted.is_plausible ? 0.0 : kImplausibleCost);
  (void)base;
}

std::vector<TriedEffect> GapSearch::rank(const RefinedModel& base, const RunControl& control) const {
  const Linearized in_space(physics_, base.model, whitening_, space_blocks_);
  const Linearized in_time(physics_, base.model, whitening_, time_blocks_);
  std::vector<TriedEffect> tried;
  for (std::size_t way = 0; way < ways_.size(); ++way) {
    if (control.stop.stop_requested()) return {};
    if (auto one = tryWay(way, in_space, in_time, base, control)) tried.push_back(std::move(*one));
  }
  const auto better = [](const TriedEffect& a, const TriedEffect& b) { return a.bic_gain > b.bic_gain; };
  std::stable_sort(tried.begin(), tried.end(), better);
  // The linearised gain of a strong effect can be a fifth off.
  constexpr double kNear = 60.0;
  constexpr double kNearShare = 0.35;
  const double best = tried.empty() ? 0.0 : tried.front().bic_gain;
  const double base_bic = bicOf(base.model);
  std::vector<char> is_finished(tried.size(), 0);
  control.parallel_for(tried.size(), [&](std::size_t i) {
    if (tried[i].bic_gain < best - std::max(kNear, kNearShare * best)) return;
    finish(tried[i], base, base_bic);
    is_finished[i] = 1;
  });
  for (std::size_t i = 0; i < tried.size(); ++i) {
    if (is_finished[i] != 0) continue;
    const GapTerm& term = tried[i].model.terms.back();
    tried[i].fitted = term.fit->describe(term.searched, term.linear);
    if (!tried[i].fitted.is_plausible) tried[i].bic_gain -= kImplausibleCost;
  }
  std::stable_sort(tried.begin(), tried.end(), better);
  std::vector<TriedEffect> of_each;
  for (TriedEffect& one : tried) {
    const bool is_new = std::none_of(of_each.begin(), of_each.end(), [&](const TriedEffect& other) {
      return ways_[other.way].effect == ways_[one.way].effect;
    });
    if (is_new) of_each.push_back(std::move(one));
  }
  return of_each;
}

namespace {

class Selector {
 public:
  Selector(const GapSearch& search, const SelectionOptions& options, const RunControl& control)
      : search_(search), options_(options), control_(control) {}

  Selection run() {
    Selection selection;
    selection.model = search_.none();
    none_bic_ = search_.bicOf(selection.model.model);
    selection.first = search_.rank(selection.model, control_);
    selection.alternatives = selection.first;
    const TriedEffect* next = firstWorth(selection.first, options_.least_gain_first);
    while (next != nullptr && !control_.stop.stop_requested()) {
      add(*next, selection);
      if (selection.ways.size() > 1) {
        exchange(selection);
        prune(selection);
      }
      if (static_cast<int>(selection.ways.size()) >= options_.most_effects) break;
      following_ = search_.rank(selection.model, control_);
      next = firstWorth(following_, options_.least_gain_more);
    }
    if (selection.ways.size() > 1) findLeading(selection);
    if (selection.ways.size() == 1) takeOver(selection);
    selection.bic_gain = none_bic_ - search_.bicOf(selection.model.model);
    return selection;
  }

 private:
  /// The best effect worth adding: enough evidence, believable, and better on what it was not fitted to.
  static const TriedEffect* firstWorth(const std::vector<TriedEffect>& tried, double least_gain) {
    for (const TriedEffect& one : tried) {
      if (one.bic_gain < least_gain) break;
      if (one.fitted.is_plausible && one.held_out_gain > 0.0) return &one;
    }
    return nullptr;
  }

  static void add(const TriedEffect& tried, Selection& selection) {
    selection.model = tried.refined.model.terms.empty() ? RefinedModel{tried.model, {}, 0, 0.0} : tried.refined;
    selection.ways.push_back(tried.way);
  }

  RefinedModel without(const Selection& selection, std::size_t term) const {
    GapModel model = selection.model.model;
    model.terms.erase(model.terms.begin() + static_cast<std::ptrdiff_t>(term));
    return search_.refined(model);
  }

  /// Replaces earlier effects by others where these are better now that the last one is there.
  void exchange(Selection& selection) {
    for (std::size_t term = 0; term + 1 < selection.ways.size(); ++term) {
      const double bic = search_.bicOf(selection.model.model);
      const RefinedModel rest = without(selection, term);
      const std::vector<TriedEffect> tried = search_.rank(rest, control_);
      if (tried.empty()) return;
      const TriedEffect* best = firstWorth(tried, 0.0);
      if (best == nullptr || search_.bicOf(best->model) > bic - 2.0) continue;
      selection.ways.erase(selection.ways.begin() + static_cast<std::ptrdiff_t>(term));
      selection.model = best->refined.model.terms.empty() ? search_.refined(best->model) : best->refined;
      selection.ways.push_back(best->way);
    }
  }

  /// Drops every effect whose removal costs less than it is worth.
  void prune(Selection& selection) {
    for (std::size_t term = 0; term < selection.ways.size() && selection.ways.size() > 1;) {
      const RefinedModel rest = without(selection, term);
      if (search_.bicOf(rest.model) - search_.bicOf(selection.model.model) < options_.least_gain_more) {
        selection.model = rest;
        selection.ways.erase(selection.ways.begin() + static_cast<std::ptrdiff_t>(term));
      } else {
        ++term;
      }
    }
  }

  /// A single effect that exchanging and dropping ended at may be fitted better than when it was first tried.
  void takeOver(Selection& selection) const {
    const double gain = none_bic_ - search_.bicOf(selection.model.model);
    const Effect* effect = search_.ways()[selection.ways.front()].effect;
    for (TriedEffect& tried : selection.alternatives) {
      if (search_.ways()[tried.way].effect != effect || tried.bic_gain >= gain) continue;
      tried.way = selection.ways.front();
      tried.refined = selection.model;
      tried.model = selection.model.model;
      tried.bic_gain = gain;
    }
  }

  /// The effect whose absence costs most leads; the candidates are its alternatives with the others present.
  void findLeading(Selection& selection) {
    double most = -std::numeric_limits<double>::infinity();
    RefinedModel rest;
    for (std::size_t term = 0; term < selection.ways.size(); ++term) {
      const RefinedModel reduced = without(selection, term);
      const double cost = search_.bicOf(reduced.model);
      if (cost > most) {
        most = cost;
        selection.leading = term;
        rest = reduced;
      }
    }
    selection.alternatives = search_.rank(rest, control_);
  }

  const GapSearch& search_;
  const SelectionOptions& options_;
  const RunControl& control_;
  double none_bic_ = 0.0;
  std::vector<TriedEffect> following_;
};

}  // namespace

Selection selectEffects(const GapSearch& search, const SelectionOptions& options, const RunControl& control) {
  return Selector(search, options, control).run();
}

}  // namespace fieldtrue
