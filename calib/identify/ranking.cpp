#include "calib/identify/ranking.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

namespace fieldtrue::identify {
namespace {

/// A part of what already runs in several threads, stopped with the whole.
RunControl inOneThread(const RunControl& control) {
  RunControl part;
  part.stop = control.stop;
  return part;
}

/// Whether two fits search places and, but for the last parameter, the same shape, so that one may start where another
/// ended.
bool areOfOneShape(const effects::EffectFit& a, const effects::EffectFit& b) {
  constexpr std::size_t kPlaceOnly = 3;
  const std::vector<effects::FitParameter> of_a = a.searched(), of_b = b.searched();
  return a.searchesPlace() && of_a.size() > kPlaceOnly + 1 && of_a.size() == of_b.size() &&
         std::equal(of_a.begin(), of_a.end() - 1, of_b.begin(),
                    [](const auto& x, const auto& y) { return x.name == y.name; });
}

double sumOf(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

bool isBetter(const TriedEffect& a, const TriedEffect& b) { return a.bic_gain > b.bic_gain; }

class Ranking {
 public:
  Ranking(const GapSearch& search, const GapModel& base, const RunControl& control)
      : search_(search),
        thresholds_(search.thresholds()),
        base_(base),
        from_(search.seenFrom(base)),
        in_space_(search, from_, search.spaceBlocks()),
        in_time_(search, from_, search.timeBlocksOfRows()),
        control_(control) {}

  std::vector<TriedEffect> run() const {
    std::vector<std::optional<TriedEffect>> of_ways(search_.ways().size());
    control_.parallel_for(of_ways.size(), [&](std::size_t way) { of_ways[way] = tryWay(way); });
    if (control_.stop.stop_requested()) return {};
    std::vector<TriedEffect> tried;
    for (auto& one : of_ways)
      if (one) tried.push_back(std::move(*one));
    std::stable_sort(tried.begin(), tried.end(), isBetter);
    shareCenters(tried);
    shareShapes(tried);
    std::stable_sort(tried.begin(), tried.end(), isBetter);
    finishBest(tried);
    for (TriedEffect& one : tried) {
      if (one.is_refined) continue;
      const GapTerm& term = one.model.terms.back();
      one.fitted = term.fit->describe(term.searched, term.linear);
      if (!one.fitted.is_plausible) one.bic_gain -= thresholds_.implausible_cost;
    }
    std::stable_sort(tried.begin(), tried.end(), isBetter);
    return bestOfEach(std::move(tried));
  }

 private:
  /// What effects are added to, held out by blocks of one kind.
  struct View {
    View(const GapSearch& search, const GapModel& from, std::span<const int> blocks)
        : at(search.physics(), from, search.whitening(), blocks, ResponseAt::kHalfWayIfBent), scanner(at), near(at) {}
    View(const View&) = delete;
    View& operator=(const View&) = delete;
    Linearized at;
    Scanner scanner;
    LocalFitter near;
  };

  const EffectWay& wayOf(const TriedEffect& tried) const { return search_.ways()[tried.way]; }
  const View& viewOf(const EffectWay& way) const { return way.needs_time ? in_time_ : in_space_; }

  std::optional<TriedEffect> tryWay(std::size_t index) const {
    constexpr std::size_t kStarts = 5;
    const EffectWay& way = search_.ways()[index];
    TriedEffect tried;
    tried.way = index;
    tried.bic_gain = -std::numeric_limits<double>::infinity();
    const ScanResult scan = viewOf(way).scanner.scan(*way.fit, way.fit->starts(), kStarts, inOneThread(control_));
    if (scan.best.empty()) return std::nullopt;
    refineFrom(scan.best, tried);
    tried.held_out_gain = sumOf(scan.held_out_gain);
    return tried;
  }

  /// Keeps the best of what local refinement makes of the starts, where it beats what `tried` has.
  void refineFrom(std::span<const ScanResult::Start> starts, TriedEffect& tried) const {
    constexpr double kHopeful = 0.4;  // Of the best start's gain.
    const EffectWay& way = wayOf(tried);
    std::optional<LocalFit> best;
    for (const ScanResult::Start& start : starts) {
      if (best && start.gain < kHopeful * starts.front().gain) break;
      LocalFit local = viewOf(way).near.from(*way.fit, start.searched);
      if (!best || local.gain > best->gain) best = std::move(local);
    }
    if (!best) return;
    GapTerm term{way.effect, way.fit, best->searched, best->linear};
    const GapRows& rows = search_.physics().rows();
    const double count = static_cast<double>(rows.rows.size()) * rows.channels();
    const double sum = viewOf(way).at.residual().squaredNorm();
    const double left = std::max(1e-9 * sum, sum - best->gain);
    const double gain =
        count * std::log(sum / left) - static_cast<double>(parametersOf({{}, {term}})) * std::log(count);
    if (gain <= tried.bic_gain) return;
    tried.bic_gain = gain;
    tried.model = from_;
    tried.model.terms.push_back(std::move(term));
  }

  /// Where one thing in the room fits well, others may fit too: each is tried at the places of the best.
  void shareCenters(std::vector<TriedEffect>& tried) const {
    constexpr std::size_t kStarts = 2;
    const std::vector<Eigen::Vector3d> centers_m = centersOf(tried);
    control_.parallel_for(tried.size(), [&](std::size_t i) {
      TriedEffect& one = tried[i];
      const EffectWay& way = wayOf(one);
      if (!way.fit->searchesPlace() || control_.stop.stop_requested()) return;
      const ScanResult again =
          viewOf(way).scanner.scan(*way.fit, startsAt(*way.fit, centers_m), kStarts, inOneThread(control_));
      refineFrom(again.best, one);
      one.held_out_gain = std::max(one.held_out_gain, sumOf(again.held_out_gain));
    });
  }

  /// Of the best, those that are apart.
  static std::vector<Eigen::Vector3d> centersOf(const std::vector<TriedEffect>& tried) {
    constexpr std::size_t kCenters = 4;
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
    return centers_m;
  }

  /// Things of other physics that are searched by the same shape as well: each starts where the others ended.
  void shareShapes(std::vector<TriedEffect>& tried) const {
    std::vector<GapTerm> ended;
    for (const TriedEffect& one : tried) ended.push_back(one.model.terms.back());
    control_.parallel_for(tried.size(), [&](std::size_t i) {
      const EffectWay& way = wayOf(tried[i]);
      for (std::size_t k = 0; k < ended.size(); ++k) {
        if (k == i || control_.stop.stop_requested() || !areOfOneShape(*way.fit, *ended[k].fit)) continue;
        const effects::FitParameter last = way.fit->searched().back();
        Eigen::VectorXd start = ended[k].searched;
        start.tail<1>()[0] = std::clamp(start.tail<1>()[0], last.low, last.high);
        const ScanResult::Start from{start, 0.0};
        if (way.fit->allows(start)) refineFrom({&from, 1}, tried[i]);
      }
    });
  }

  /// The linearised gain of a strong effect can be a fifth off, and flatters: whatever is near the best of those fitted
  /// exactly is fitted exactly too.
  void finishBest(std::vector<TriedEffect>& tried) const {
    constexpr double kNear = 60.0;
    constexpr double kNearNothing = 25.0;
    constexpr double kNearShare = 0.2;
    const double base_bic = search_.bicOf(base_);
    double best = tried.empty() ? 0.0 : tried.front().bic_gain;
    double margin = best < kNearNothing ? kNearNothing : std::max(kNear, kNearShare * best);
    for (;;) {
      std::vector<std::size_t> due;
      for (std::size_t i = 0; i < tried.size(); ++i)
        if (!tried[i].is_refined && tried[i].bic_gain >= best - margin) due.push_back(i);
      if (due.empty() || control_.stop.stop_requested()) return;
      control_.parallel_for(due.size(), [&](std::size_t k) { finish(tried[due[k]], base_bic); });
      best = 0.0;
      for (const TriedEffect& one : tried)
        if (one.is_refined) best = std::max(best, one.bic_gain);
      margin = std::clamp(best, kNearNothing, kNear);
    }
  }

  void finish(TriedEffect& tried, double base_bic) const {
    tried.model = search_.fitted(tried.model);
    tried.is_refined = true;
    const GapTerm& term = tried.model.terms.back();
    if (tried.held_out_gain <= 0.0 && term.searched.size() > 0)
      tried.held_out_gain = viewOf(wayOf(tried)).scanner.heldOutGainFrom(*term.fit, term.searched);
    tried.fitted = term.fit->describe(term.searched, term.linear);
    const double cost = tried.fitted.is_plausible ? 0.0 : thresholds_.implausible_cost;
    tried.bic_gain = base_bic - search_.bicOf(tried.model) - cost;
    if (term.effect->is_freer) tried.bic_gain -= thresholds_.share_of_freer * std::max(0.0, tried.bic_gain);
  }

  std::vector<TriedEffect> bestOfEach(std::vector<TriedEffect> tried) const {
    std::vector<TriedEffect> of_each;
    for (TriedEffect& one : tried) {
      const bool is_new = std::none_of(of_each.begin(), of_each.end(), [&](const TriedEffect& other) {
        return wayOf(other).effect == wayOf(one).effect;
      });
      if (is_new) of_each.push_back(std::move(one));
    }
    return of_each;
  }

  const GapSearch& search_;
  const Thresholds& thresholds_;
  const GapModel& base_;
  GapModel from_;
  View in_space_;
  View in_time_;
  const RunControl& control_;
};

}  // namespace

std::vector<TriedEffect> rankEffects(const GapSearch& search, const GapModel& base, const RunControl& control) {
  return Ranking(search, base, control).run();
}

}  // namespace fieldtrue::identify
