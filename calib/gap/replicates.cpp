#include "calib/gap/replicates.h"

#include <Eigen/LU>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <random>

#include "calib/core/statistics.h"
#include "calib/effects/registry.h"
#include "calib/gap/verdict.h"
#include "calib/geometry/geometry.h"
#include "calib/identify/unnamed.h"

namespace fieldtrue::gap {
namespace {

using identify::Vector6d;

/// A world to draw recordings from: poses without noise, and the noise.
class World {
 public:
  World(const identify::GapSearch& search, const identify::GapModel& model) : search_(search) {
    const identify::GapPhysics& physics = search.physics();
    poses_ = physics.predictions(model);
    const identify::UnnamedRival rival(search);
    const std::vector<Vector6d> left = physics.residuals(model);
    const std::vector<Vector6d> smooth = rival.foretold(rival.likeliestLaws(left), left);
    for (std::size_t i = 0; i < poses_.size(); ++i) poses_[i] = moved(poses_[i], smooth[i]);
    scale_ =
        identify::devianceOf(leftBy(search, model).structure.left, physics.rows().has_orientation, search.law()).scale;
  }

  const identify::Thresholds& thresholds() const { return search_.thresholds(); }

  identify::GapRows drawn(std::uint64_t seed) const {
    std::mt19937_64 generator(seed);
    identify::GapRows rows = search_.physics().rows();
    for (std::size_t i = 0; i < rows.rows.size(); ++i) {
      const Eigen::Matrix3d& whitening = search_.whitening().position[i];
      Vector6d noise;
      noise.head<3>() = whitening.inverse() * (scale_.position * student(generator));
      noise.tail<3>() = scale_.rotation / search_.whitening().rotation[i] * student(generator);
      rows.rows[i].tracker_from_sensor = moved(poses_[i], noise);
    }
    return rows;
  }

 private:
  static Pose moved(const Pose& pose, const Vector6d& change) {
    return {pose.position_m + change.head<3>(), (rotationFromVector(change.tail<3>()) * pose.orientation).normalized()};
  }

  /// Three components of one Student t of unit scale.
  Eigen::Vector3d student(std::mt19937_64& generator) const {
    const double nu = search_.law().degrees_of_freedom;
    std::normal_distribution<double> normal(0.0, 1.0);
    std::chi_squared_distribution<double> chi2(nu);
    const double shrink = std::sqrt(chi2(generator) / nu);
    return Eigen::Vector3d(normal(generator), normal(generator), normal(generator)) / shrink;
  }

  const identify::GapSearch& search_;
  std::vector<Pose> poses_;
  identify::ResidualScale scale_;
};

/// What was named in one recording.
struct Named {
  bool is_done = false;
  std::vector<std::string> effects;                               ///< Sorted.
  std::vector<std::pair<std::string, Eigen::Vector3d>> placed_m;  ///< What stands in the room, and where.
};

std::vector<std::pair<std::string, Eigen::Vector3d>> placedIn(const identify::GapModel& model) {
  std::vector<std::pair<std::string, Eigen::Vector3d>> placed_m;
  for (const identify::GapTerm& term : model.terms)
    if (const auto at_m = term.fit->describe(term.searched, term.linear).location_m)
      placed_m.emplace_back(term.effect->id, *at_m);
  return placed_m;
}

/// How far the things in the room were found again from where they were found first, the nearest of its kind to each:
/// the farthest of them.
void addOff(const std::vector<std::pair<std::string, Eigen::Vector3d>>& first, const Named& again,
            std::vector<double>& off_m) {
  std::optional<double> farthest_m;
  for (const auto& [effect, at_m] : first) {
    std::optional<double> nearest_m;
    for (const auto& [other, there_m] : again.placed_m)
      if (other == effect) nearest_m = std::min(nearest_m.value_or(1e9), (there_m - at_m).norm());
    if (nearest_m) farthest_m = std::max(farthest_m.value_or(0.0), *nearest_m);
  }
  if (farthest_m) off_m.push_back(*farthest_m);
}

Named namedBy(const identify::GapRows& rows, const BelievedEffects& believed, const ReplicateOptions& options,
              const identify::Thresholds& thresholds, const RunControl& control) {
  const identify::GapSearch search(rows, believed(), identify::NoiseFrom::kResiduals, thresholds);
  identify::EffectSelectionOptions selecting;
  selecting.most_effects = options.most_effects;
  const Judgement judgement = judge(search, identify::selectEffects(search, selecting, control), control);
  Named named;
  for (const identify::GapTerm& term : judgement.selection.model.model.terms) {
    named.effects.push_back(term.effect->id);
  }
  named.placed_m = placedIn(judgement.selection.model.model);
  std::sort(named.effects.begin(), named.effects.end());
  named.is_done = !control.stop.stop_requested();
  return named;
}

class Replicator {
 public:
  Replicator(const BelievedEffects& believed, const ReplicateOptions& options, const RunControl& control)
      : believed_(believed), options_(options), control_(control), began_(Clock::now()) {}

  std::vector<Named> run(const World& world, int wanted, int fewest, std::uint64_t seed, double from, double to) {
    std::vector<Named> all(static_cast<std::size_t>(wanted));
    std::atomic<int> done = 0;
    control_.parallel_for(all.size(), [&](std::size_t k) {
      const bool is_late = secondsGone() > options_.most_s && static_cast<int>(k) >= fewest;
      if (is_late || control_.stop.stop_requested()) return;
      RunControl quiet;
      quiet.stop = control_.stop;
      all[k] = namedBy(world.drawn(seed + k), believed_, options_, world.thresholds(), quiet);
      control_.progress(from + (to - from) * static_cast<double>(++done) / static_cast<double>(wanted));
    });
    std::erase_if(all, [](const Named& one) { return !one.is_done; });
    return all;
  }

 private:
  using Clock = std::chrono::steady_clock;
  double secondsGone() const { return std::chrono::duration<double>(Clock::now() - began_).count(); }

  const BelievedEffects& believed_;
  const ReplicateOptions& options_;
  const RunControl& control_;
  Clock::time_point began_;
};

/// Names that stand for one another on this grid count as one.
class Classes {
 public:
  explicit Classes(const std::vector<GapCandidate>& candidates) : candidates_(candidates) {}

  bool areAlike(const std::vector<std::string>& a, const std::vector<std::string>& b) const {
    return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [&](const auto& x, const auto& y) {
             return x == y || isIn(x, y) || isIn(y, x);
           });
  }

 private:
  bool isIn(const std::string& effect, const std::string& of) const {
    for (const GapCandidate& c : candidates_)
      if (c.effect == of) return std::count(c.equivalents.begin(), c.equivalents.end(), effect) > 0;
    return false;
  }

  const std::vector<GapCandidate>& candidates_;
};

std::string timesText(int count, std::size_t of) {
  return std::to_string(count) + (count == 1 ? " time of " : " times of ") + std::to_string(of);
}

/// "within 9 cm in 45": the distance that nine in ten of those named right stay within.
std::string withinText(std::vector<double> off_m) {
  if (off_m.empty()) return "";
  std::sort(off_m.begin(), off_m.end());
  const std::size_t most = std::max<std::size_t>(1, (9 * off_m.size() + 9) / 10);
  return ", within " + shown(100.0 * off_m[most - 1]) + " cm in " + std::to_string(most);
}

std::vector<std::string> idsOf(const identify::EffectSelection& selection, const identify::GapSearch& search) {
  std::vector<std::string> ids;
  for (const std::size_t way : selection.ways) ids.push_back(search.ways()[way].effect->id);
  std::sort(ids.begin(), ids.end());
  return ids;
}

/// The likeliest other cause with a fit of its own.
const identify::TriedEffect* runnerUp(const Judgement& judgement, const std::vector<GapCandidate>& candidates,
                                      const identify::GapSearch& search) {
  for (const GapCandidate& candidate : candidates) {
    for (const identify::TriedEffect& tried : judgement.selection.alternatives) {
      const std::string& id = search.ways()[tried.way].effect->id;
      const bool is_named = std::any_of(judgement.selection.ways.begin(), judgement.selection.ways.end(),
                                        [&](std::size_t way) { return search.ways()[way].effect->id == id; });
      if (id == candidate.effect && !is_named && tried.is_refined) return &tried;
    }
  }
  return nullptr;
}

}  // namespace

Replicates replicate(const identify::GapSearch& search, const Judgement& judgement,
                     const std::vector<GapCandidate>& candidates, const BelievedEffects& believed,
                     const ReplicateOptions& options, const RunControl& control) {
  const Classes classes(candidates);
  Replicator replicator(believed, options, control);
  const std::vector<std::string> named = idsOf(judgement.selection, search);
  const World found(search, judgement.selection.model.model);
  const std::vector<Named> all = replicator.run(found, options.wanted, options.fewest, 1000 * options.seed, 0.0, 0.7);
  Replicates result;
  result.n = static_cast<int>(all.size());
  std::vector<double> off_m;
  const auto placed_m = placedIn(judgement.selection.model.model);
  for (const Named& one : all) {
    if (!classes.areAlike(one.effects, named)) continue;
    ++result.named_right;
    addOff(placed_m, one, off_m);
  }
  if (!off_m.empty()) result.within_m_median = median(off_m);
  result.text = named.empty() ? "If no cause of the catalogue is behind this, none is named so " +
                                    timesText(result.named_right, all.size()) + "."
                              : "If this is the cause, it is named so " + timesText(result.named_right, all.size()) +
                                    withinText(off_m) + ".";
  const identify::TriedEffect* other = named.empty() ? nullptr : runnerUp(judgement, candidates, search);
  if (other == nullptr || control.stop.stop_requested()) return result;
  const World otherwise(search, other->model);
  std::vector<std::string> other_named;
  for (const identify::GapTerm& term : other->model.terms) other_named.push_back(term.effect->id);
  std::sort(other_named.begin(), other_named.end());
  const std::vector<Named> others =
      replicator.run(otherwise, options.wanted / 2, options.fewest / 2, 1000 * options.seed + 500, 0.7, 1.0);
  result.runner_up = search.ways()[other->way].effect->id;
  result.runner_up_n = static_cast<int>(others.size());
  for (const Named& one : others) {
    result.runner_up_named_right += classes.areAlike(one.effects, other_named) ? 1 : 0;
    result.runner_up_named_as_this += classes.areAlike(one.effects, named) ? 1 : 0;
  }
  result.text += " If it were " + effects::labelOf(result.runner_up) + ", it would be taken for this " +
                 timesText(result.runner_up_named_as_this, others.size()) + ".";
  return result;
}

}  // namespace fieldtrue::gap
