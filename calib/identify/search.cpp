#include "calib/identify/search.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/core/statistics.h"
#include "calib/identify/scan.h"

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
  const Scanner scanner(at);
  const LocalFitter near(at);
  std::vector<GapModel> models;
  for (const EffectWay& way : ways_) {
    const std::size_t searched = way.fit->searched().size();
    if (searched == 0 || way.needs_time || searched + way.fit->linear().size() > kMostParameters) continue;
    for (const ScanResult::Start& start : scanner.scan(*way.fit, way.fit->starts(), kStrongStarts, control).best) {
      const LocalFit local = near.from(*way.fit, start.searched);
      models.push_back(from);
      models.back().terms.push_back({way.effect, way.fit, local.searched, local.linear});
    }
  }
  RefineOptions options;
  options.law = law_;
  options.bounded_by_places = false;
  control.parallel_for(models.size(), [&](std::size_t i) {
    if (!control.stop.stop_requested()) models[i] = fitJointly(physics_, models[i], whitening_, options);
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

RefinedModel GapSearch::withCovariance(const GapModel& fitted) const {
  return identify::withCovariance(physics_, fitted, whitening_, {law_});
}

GapModel GapSearch::fitted(const GapModel& start, std::span<const char> used) const {
  {
    const std::lock_guard lock(known_mutex_);
    for (const Known& one : known_)
      if (isSame(one.start, start) && std::ranges::equal(one.used, used)) return one.fitted;
  }
  GapModel fitted = fitJointly(physics_, start, whitening_, {law_, used});
  const std::lock_guard lock(known_mutex_);
  known_.push_back({start, {used.begin(), used.end()}, fitted});
  return fitted;
}

GapModel GapSearch::fittedWithout(const GapModel& start, Eigen::Index frozen) const {
  RefineOptions options;
  options.law = law_;
  options.frozen = frozen;
  options.most_steps = 8;
  return fitJointly(physics_, start, whitening_, options);
}

}  // namespace fieldtrue::identify
