#include "calib/identify/search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "calib/core/statistics.h"

namespace fieldtrue::identify {
namespace {

constexpr double kGuessedPlacing_m = 1e-3;
constexpr double kGuessedPlacing_rad = 3e-3;

double pitchOf_m(std::span<const field::SensorSetting> settings) {
  std::vector<double> nearest_m;
  for (const field::SensorSetting& a : settings) {
    double least = std::numeric_limits<double>::infinity();
    for (const field::SensorSetting& b : settings) {
      const double d = (a.tracker_from_sensor.position_m - b.tracker_from_sensor.position_m).norm();
      if (d > 0.03) least = std::min(least, d);
    }
    if (std::isfinite(least)) nearest_m.push_back(least);
    if (nearest_m.size() > 300) break;
  }
  return nearest_m.empty() ? 0.1 : median(std::move(nearest_m));
}

/// A part of what already runs in several threads, stopped with the whole.
RunControl inOneThread(const RunControl& control) {
  RunControl part;
  part.stop = control.stop;
  return part;
}

}  // namespace

GapSearch::GapSearch(const GapRows& rows, std::vector<std::unique_ptr<field::PhysicalEffect>> believed, NoiseFrom noise,
                     const Thresholds& thresholds, const RunControl& control)
    : rows_(rows), thresholds_(thresholds), physics_(rows, std::move(believed)), space_blocks_(octantBlocks(rows)) {
  time_blocks_ = rows.has_times ? timeBlocks(rows) : space_blocks_;
  none_.model.alignment = initialAlignment(rows);
  placing_sd_m_ = rows.placing_sd_m.value_or(kGuessedPlacing_m);
  placing_sd_rad_ = rows.placing_sd_rad.value_or(kGuessedPlacing_rad);
  if (noise == NoiseFrom::kResiduals) structure_ = settleNoise(none_);
  whitening_ = makeWhitening(rows, placing_sd_m_, placing_sd_rad_);
  none_ = refineJointly(physics_, none_.model, whitening_, {law_});
  vantage_ = none_.model.alignment;
  settleWays();
  const std::optional<GapModel> strong = settleVantage(control);
  if (!strong || noise != NoiseFrom::kResiduals) return;
  RefinedModel beside{*strong, {}, 0, 0.0};
  settleNoise(beside);
  whitening_ = makeWhitening(rows, placing_sd_m_, placing_sd_rad_);
  none_ = refineJointly(physics_, none_.model, whitening_, {law_});
}

/// A model without effects follows bent readings with its alignment, and from there nothing is seen where it is. So the
/// likeliest of the simplest effects is looked for, and again from the alignment that stands beside it, as long as that
/// makes one likelier.
/// @return the model with it; none where readings are not bent strongly, or nothing makes them likelier
std::optional<GapModel> GapSearch::settleVantage(const RunControl& control) {
  constexpr int kMostRounds = 4;
  constexpr double kLikelier = 2.0;  // In BIC units.
  if (!isBent(none_.model)) return std::nullopt;
  std::optional<GapModel> strong;
  double best = bicOf(none_.model) - kLikelier;
  for (int round = 0; round < kMostRounds; ++round) {
    const std::vector<GapModel> tried = simplestBesideAlignment(control);
    std::vector<double> bic;
    for (const GapModel& one : tried) bic.push_back(bicOf(one));
    const auto likeliest = std::min_element(bic.begin(), bic.end());
    if (likeliest == bic.end() || *likeliest >= best) break;
    best = *likeliest - kLikelier;
    strong = tried[static_cast<std::size_t>(likeliest - bic.begin())];
    vantage_ = strong->alignment;
    settleWays();
  }
  return strong;
}

/// One of the simplest effects each, fitted together with the alignment from several starts. Where the places stand is
/// what is looked for, so none bounds where the effect may be.
std::vector<GapModel> GapSearch::simplestBesideAlignment(const RunControl& control) const {
  constexpr std::size_t kStrongStarts = 8;
  constexpr std::size_t kMostParameters = 4;  // Of a plane, or a sphere.
  const GapModel from = seenFrom(none_.model);
  const Linearized at(physics_, from, whitening_, space_blocks_, ResponseAt::kHalfWayIfBent);
  std::vector<GapModel> models;
  for (const EffectWay& way : ways_) {
    const std::size_t searched = way.fit->searched().size();
    if (searched == 0 || way.needs_time || searched + way.fit->linear().size() > kMostParameters) continue;
    for (const ScanResult::Start& start : scan(at, *way.fit, way.fit->starts(), kStrongStarts, control).best) {
      const LocalFit local = refineLocally(at, *way.fit, start.searched);
      models.push_back(from);
      models.back().terms.push_back({way.effect, way.fit, local.searched, local.linear});
    }
  }
  RefineOptions options;
  options.law = law_;
  options.bounded_by_places = false;
  control.parallel_for(models.size(), [&](std::size_t i) {
    if (!control.stop.stop_requested()) models[i] = refineJointly(physics_, models[i], whitening_, options).model;
  });
  return models;
}

bool GapSearch::isBent(const GapModel& model) const {
  return isBentStrongly(rows_, physics_.residuals(model), whitening_);
}

GapModel GapSearch::seenFrom(const GapModel& model) const {
  if (!isBent(model)) return model;
  GapModel from = model;
  from.alignment = vantage_;
  return from;
}

/// Where the rig's tolerance is not stated, it is what the flexible fit leaves beyond the samples' noise; the law of
/// the residuals is the one under which that remainder is most likely.
Structure GapSearch::settleNoise(RefinedModel& about) {
  constexpr int kRounds = 3;
  Structure structure;
  for (int round = 0; round < kRounds; ++round) {
    whitening_ = makeWhitening(rows_, placing_sd_m_, placing_sd_rad_);
    about = refineJointly(physics_, about.model, whitening_, {});
    structure =
        findStructure(Linearized(physics_, about.model, whitening_, space_blocks_), rows_, round == kRounds - 1);
    noise_left_ = structure.left;
    // A stated tolerance may be wrong: position and rotation must weigh as they deserve, so both follow the remainder.
    placing_sd_m_ = placingFrom(Channel::kPosition, placing_sd_m_);
    if (rows_.has_orientation) placing_sd_rad_ = placingFrom(Channel::kRotation, placing_sd_rad_);
  }
  law_ = likeliestLaw(noise_left_, rows_.has_orientation);
  return structure;
}

/// The placing SD under which the whitened remainder of the flexible fit has unit scale, the samples' noise taken as
/// stated; next to nothing where that alone is more than enough.
double GapSearch::placingFrom(Channel channel, double present) const {
  constexpr double kLeast = 1e-6;
  constexpr double kTimes = 30.0;  // At most, in either direction and round.
  const bool is_position = channel == Channel::kPosition;
  const auto varianceAt = [&](const GapRow& row, double placing) {
    const double own = is_position ? row.mean_covariance_m2.trace() / 3.0 : row.mean_rotation_variance_rad2;
    return own + placing * placing + kLeast * kLeast;
  };
  const auto scaleAt = [&](double placing) {
    std::vector<Vector6d> left(noise_left_.size(), Vector6d::Zero());
    for (std::size_t i = 0; i < left.size(); ++i) {
      const double factor = std::sqrt(varianceAt(rows_.rows[i], present) / varianceAt(rows_.rows[i], placing));
      left[i].head<3>() = factor * (is_position ? noise_left_[i].head<3>() : noise_left_[i].tail<3>());
    }
    return normalScaleOf(left);
  };
  double low = std::max(kLeast, present / kTimes);
  double high = std::max(kLeast, present * kTimes);
  for (int step = 0; step < 40; ++step) {
    const double middle = std::sqrt(low * high);
    (scaleAt(middle) > 1.0 ? low : high) = middle;
  }
  return std::sqrt(low * high);
}

double GapSearch::whitenedUnit_mm() const {
  double sum_m2 = 0.0;
  for (const GapRow& row : rows_.rows)
    sum_m2 += noiseOf(row, placing_sd_m_, placing_sd_rad_).topLeftCorner<3, 3>().trace();
  return 1e3 * std::sqrt(sum_m2 / static_cast<double>(rows_.rows.size()));
}

double GapSearch::floorPlacingSd_m() const { return std::min(placing_sd_m_, worstPlacing_m(rows_, thresholds_)); }

double GapSearch::floorPlacingSd_rad() const { return std::min(placing_sd_rad_, worstPlacing_rad(rows_, thresholds_)); }

double GapSearch::shareAstray() const {
  const std::vector<Pose> predicted = physics_.predictions(none_.model);
  const auto n = static_cast<double>(predicted.size());
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();
  for (const Pose& pose : predicted) middle_m += pose.position_m / n;
  std::vector<double> off_m;
  double spread_m2 = 0.0;
  for (std::size_t i = 0; i < predicted.size(); ++i) {
    off_m.push_back((rows_.rows[i].tracker_from_sensor.position_m - predicted[i].position_m).norm());
    spread_m2 += (predicted[i].position_m - middle_m).squaredNorm() / n;
  }
  return median(std::move(off_m)) / std::sqrt(spread_m2);
}

bool GapSearch::belongTogether() const {
  return mirroredSensors(rows_, thresholds_).empty() && shareAstray() <= thresholds_.astray;
}

void GapSearch::settleWays() {
  ways_.clear();
  design_ = {};
  settings_ = physics_.settings(vantage_);
  design_.settings = settings_;
  for (const field::SensorSetting& setting : settings_) design_.places_m.extend(setting.tracker_from_sensor.position_m);
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
  for (const effects::Effect& effect : effects::effects()) {
    if (effect.fits == nullptr || (effect.needs_dipoles && !rows_.has_dipoles)) continue;
    for (auto& fit : effect.fits(design_)) ways_.push_back({&effect, std::move(fit), effect.acts_in_time});
  }
}

double GapSearch::bicOf(const GapModel& model, std::span<const char> used) const {
  std::vector<Vector6d> left = whitenedResiduals(physics_, model, whitening_);
  if (!used.empty()) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < left.size(); ++i)
      if (used[i] != 0) left[kept++] = left[i];
    left.resize(kept);
  }
  const auto parameters = static_cast<double>(parametersOf(model));
  const double count = static_cast<double>(left.size()) * rows_.channels();
  return devianceOf(left, rows_.has_orientation, law_).value + parameters * std::log(count) +
         priorCost(physics_, model);
}

RefinedModel GapSearch::refined(const GapModel& start, std::span<const char> used) const {
  RefineOptions options;
  options.used = used;
  options.law = law_;
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
                                             const GapModel& base, const RunControl& control) const {
  constexpr std::size_t kStarts = 5;
  const EffectWay& chosen = ways_[way];
  const Linearized& at = chosen.needs_time ? in_time : in_space;
  TriedEffect tried;
  tried.way = way;
  tried.bic_gain = -std::numeric_limits<double>::infinity();
  tried.scan = scan(at, *chosen.fit, chosen.fit->starts(), kStarts, control);
  if (tried.scan.best.empty()) return std::nullopt;
  refineFrom(tried.scan.best, at, base, tried);
  tried.held_out_gain = std::accumulate(tried.scan.held_out_gain.begin(), tried.scan.held_out_gain.end(), 0.0);
  return tried;
}

void GapSearch::refineFrom(std::span<const ScanResult::Start> starts, const Linearized& at, const GapModel& base,
                           TriedEffect& tried) const {
  const EffectWay& chosen = ways_[tried.way];
  constexpr double kHopeful = 0.4;  // Of the best start's gain.
  std::optional<LocalFit> best;
  for (const ScanResult::Start& start : starts) {
    if (best && start.gain < kHopeful * starts.front().gain) break;
    LocalFit local = refineLocally(at, *chosen.fit, start.searched);
    if (!best || local.gain > best->gain) best = std::move(local);
  }
  if (!best) return;
  GapTerm term{chosen.effect, chosen.fit, best->searched, best->linear};
  const double count = static_cast<double>(rows_.rows.size()) * rows_.channels();
  const double sum = at.residual().squaredNorm();
  const double left = std::max(1e-9 * sum, sum - best->gain);
  const double gain = count * std::log(sum / left) - static_cast<double>(parametersOf({{}, {term}})) * std::log(count);
  if (gain <= tried.bic_gain) return;
  tried.bic_gain = gain;
  tried.model = base;
  tried.model.terms.push_back(std::move(term));
}

void GapSearch::shareCenters(std::vector<TriedEffect>& tried, const Linearized& in_space, const Linearized& in_time,
                             const GapModel& base, const RunControl& control) const {
  constexpr std::size_t kCenters = 4;
  constexpr std::size_t kStarts = 2;
  constexpr double kApart_m = 0.1;
  std::vector<Eigen::Vector3d> centers_m;
  for (const TriedEffect& one : tried) {
    if (centers_m.size() >= kCenters) break;
    const GapTerm& term = one.model.terms.back();
    if (!term.fit->searchesPlace()) continue;
    const Eigen::Vector3d center_m = term.searched.head<3>();
    const auto is_near = [&](const Eigen::Vector3d& other_m) { return (other_m - center_m).norm() < kApart_m; };
    if (std::none_of(centers_m.begin(), centers_m.end(), is_near)) centers_m.push_back(center_m);
  }
  control.parallel_for(tried.size(), [&](std::size_t i) {
    TriedEffect& one = tried[i];
    const EffectWay& way = ways_[one.way];
    if (!way.fit->searchesPlace() || control.stop.stop_requested()) return;
    const Linearized& at = way.needs_time ? in_time : in_space;
    const ScanResult again = scan(at, *way.fit, startsAt(*way.fit, centers_m), kStarts, inOneThread(control));
    refineFrom(again.best, at, base, one);
    const double held_out = std::accumulate(again.held_out_gain.begin(), again.held_out_gain.end(), 0.0);
    one.held_out_gain = std::max(one.held_out_gain, held_out);
  });
}

namespace {

/// Whether two fits search places and, but for the last parameter, the same shape, so that one may start where another
/// ended.
bool areOfOneShape(const effects::EffectFit& a, const effects::EffectFit& b) {
  constexpr std::size_t kPlaceOnly = 3;
  const std::vector<effects::FitParameter> of_a = a.searched(), of_b = b.searched();
  return a.searchesPlace() && of_a.size() > kPlaceOnly + 1 && of_a.size() == of_b.size() &&
         std::equal(of_a.begin(), of_a.end() - 1, of_b.begin(),
                    [](const auto& x, const auto& y) { return x.name == y.name; });
}

}  // namespace

void GapSearch::shareShapes(std::vector<TriedEffect>& tried, const Linearized& in_space, const Linearized& in_time,
                            const GapModel& base, const RunControl& control) const {
  std::vector<GapTerm> ended;
  for (const TriedEffect& one : tried) ended.push_back(one.model.terms.back());
  control.parallel_for(tried.size(), [&](std::size_t i) {
    const EffectWay& way = ways_[tried[i].way];
    for (std::size_t k = 0; k < ended.size(); ++k) {
      if (k == i || control.stop.stop_requested() || !areOfOneShape(*way.fit, *ended[k].fit)) continue;
      const effects::FitParameter last = way.fit->searched().back();
      Eigen::VectorXd start = ended[k].searched;
      start.tail<1>()[0] = std::clamp(start.tail<1>()[0], last.low, last.high);
      const ScanResult::Start from{start, 0.0};
      if (way.fit->allows(start)) refineFrom({&from, 1}, way.needs_time ? in_time : in_space, base, tried[i]);
    }
  });
}

void GapSearch::finish(TriedEffect& tried, const Linearized& at, double base_bic) const {
  tried.refined = refined(tried.model);
  tried.model = tried.refined.model;
  const GapTerm& term = tried.model.terms.back();
  if (tried.held_out_gain <= 0.0 && term.searched.size() > 0)
    tried.held_out_gain = heldOutGainFrom(at, *term.fit, term.searched);
  tried.fitted = term.fit->describe(term.searched, term.linear);
  tried.bic_gain = base_bic - bicOf(tried.model) - (tried.fitted.is_plausible ? 0.0 : thresholds_.implausible_cost);
  if (term.effect->is_freer) tried.bic_gain -= thresholds_.share_of_freer * std::max(0.0, tried.bic_gain);
}

/// The linearised gain of a strong effect can be a fifth off, and flatters: whatever is near the best of those fitted
/// exactly is fitted exactly too.
void GapSearch::finishBest(std::vector<TriedEffect>& tried, const Linearized& in_space, const Linearized& in_time,
                           const RefinedModel& base, const RunControl& control) const {
  constexpr double kNear = 60.0;
  constexpr double kNearNothing = 25.0;
  constexpr double kNearShare = 0.2;
  const double base_bic = bicOf(base.model);
  double best = tried.empty() ? 0.0 : tried.front().bic_gain;
  double margin = best < kNearNothing ? kNearNothing : std::max(kNear, kNearShare * best);
  for (;;) {
    std::vector<std::size_t> due;
    for (std::size_t i = 0; i < tried.size(); ++i)
      if (tried[i].refined.model.terms.empty() && tried[i].bic_gain >= best - margin) due.push_back(i);
    if (due.empty() || control.stop.stop_requested()) return;
    control.parallel_for(due.size(), [&](std::size_t k) {
      TriedEffect& one = tried[due[k]];
      finish(one, ways_[one.way].needs_time ? in_time : in_space, base_bic);
    });
    best = 0.0;
    for (const TriedEffect& one : tried)
      if (!one.refined.model.terms.empty()) best = std::max(best, one.bic_gain);
    margin = std::clamp(best, kNearNothing, kNear);
  }
}

std::vector<TriedEffect> GapSearch::rank(const RefinedModel& base, const RunControl& control) const {
  const GapModel from = seenFrom(base.model);
  const Linearized in_space(physics_, from, whitening_, space_blocks_, ResponseAt::kHalfWayIfBent);
  const Linearized in_time(physics_, from, whitening_, time_blocks_, ResponseAt::kHalfWayIfBent);
  std::vector<std::optional<TriedEffect>> of_ways(ways_.size());
  control.parallel_for(ways_.size(), [&](std::size_t way) {
    of_ways[way] = tryWay(way, in_space, in_time, from, inOneThread(control));
  });
  if (control.stop.stop_requested()) return {};
  std::vector<TriedEffect> tried;
  for (auto& one : of_ways)
    if (one) tried.push_back(std::move(*one));
  const auto better = [](const TriedEffect& a, const TriedEffect& b) { return a.bic_gain > b.bic_gain; };
  std::stable_sort(tried.begin(), tried.end(), better);
  shareCenters(tried, in_space, in_time, from, control);
  shareShapes(tried, in_space, in_time, from, control);
  std::stable_sort(tried.begin(), tried.end(), better);
  finishBest(tried, in_space, in_time, base, control);
  for (TriedEffect& one : tried) {
    if (!one.refined.model.terms.empty()) continue;
    const GapTerm& term = one.model.terms.back();
    one.fitted = term.fit->describe(term.searched, term.linear);
    if (!one.fitted.is_plausible) one.bic_gain -= thresholds_.implausible_cost;
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

}  // namespace fieldtrue::identify
