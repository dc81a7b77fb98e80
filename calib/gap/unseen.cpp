#include "calib/gap/unseen.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <random>

namespace fieldtrue::gap {
namespace {

constexpr std::size_t kWaysAFold = 6;  ///< Effects that a fold may choose from at each step, the selected among them.
constexpr std::size_t kSearchedAFold = 2;  ///< Of these, how many are searched to the end.

/// The ways that a fold chooses from: those selected, and the best of the others.
std::vector<std::size_t> shortList(const identify::EffectSelection& selection) {
  std::vector<std::size_t> ways = selection.ways;
  for (const auto* tried : {&selection.alternatives, &selection.first}) {
    for (const identify::TriedEffect& one : *tried) {
      if (ways.size() >= kWaysAFold + selection.ways.size()) break;
      if (std::find(ways.begin(), ways.end(), one.way) == ways.end()) ways.push_back(one.way);
    }
  }
  return ways;
}

class FoldFitter {
 public:
  FoldFitter(const identify::GapSearch& search, const identify::EffectSelection& selection,
             const identify::UnnamedRival& rival, const RivalLaws& laws, std::span<const int> blocks,
             UnseenScores& scores, const RunControl& control)
      : search_(search),
        selection_(selection),
        rival_(rival),
        laws_(laws),
        blocks_(blocks),
        scores_(scores),
        ways_(shortList(selection)) {
    if (selection.ways.empty()) return;
    const identify::Linearized at(search.physics(), search.seenFrom(search.none().model), search.whitening(), blocks,
                                  identify::ResponseAt::kHalfWayIfBent);
    const identify::Scanner scanner(at);
    first_.resize(ways_.size());
    control.parallel_for(ways_.size(), [&](std::size_t w) {
      if (!control.stop.stop_requested()) first_[w] = scanned(scanner, ways_[w]);
    });
  }

  void run(int block, const RunControl& control) const {
    std::vector<char> used(blocks_.size());
    for (std::size_t i = 0; i < used.size(); ++i) used[i] = blocks_[i] != block ? 1 : 0;
    identify::GapModel none;
    none.alignment = search_.none().model.alignment;
    none = search_.fitted(none, used);
    const std::vector<identify::GapModel> steps = likelierOf(block, used, none, control);
    if (control.stop.stop_requested()) return;
    std::vector<identify::Vector6d> left;
    for (std::size_t s = 0; s < steps.size(); ++s) {
      left = search_.physics().residuals(steps[s]);
      score(left, used, scores_.step[s]);
      if (s == 0) scoreBeside({&laws_.alone, 1}, left, used, scores_.smooth);
    }
    const std::array either = {laws_.alone, laws_.beside};
    scoreBeside(either, left, used, scores_.both);
  }

 private:
  identify::ScanResult scanned(const identify::Scanner& scanner, std::size_t way) const {
    const identify::EffectWay& one = search_.ways()[way];
    return scanner.scan(*one.fit, one.fit->starts(), 1, {});
  }

  enum class From { kAllWays, kNamedWay };

  /// The models after none, one, two ... effects, which the fold's own rows choose. Taking the best at each step can
  /// end at a poor set, where one thing passes for two others, or at a poor place of the right one: what the whole
  /// recording names is fitted to the fold's rows too, and these decide between the two.
  std::vector<identify::GapModel> likelierOf(int block, std::span<const char> used, const identify::GapModel& none,
                                             const RunControl& control) const {
    std::vector<identify::GapModel> chosen = {none};
    for (std::size_t s = 0; s < selection_.ways.size() && !control.stop.stop_requested(); ++s) {
      chosen.push_back(chosen.back());
      addBest(block, used, s, From::kAllWays, chosen.back());
    }
    if (selection_.ways.empty() || control.stop.stop_requested()) return chosen;
    std::vector<identify::GapModel> named = {namedOn(block, used)};
    if (!(priceOf(named.front(), used) < priceOf(chosen.back(), used))) return chosen;
    while (!named.front().terms.empty()) {
      const identify::GapModel fewer = identify::withoutTerm(named.front(), named.front().terms.size() - 1);
      named.insert(named.begin(), fewer.terms.empty() ? none : search_.fitted(fewer, used));
    }
    return named;
  }

  /// What the whole recording names, fitted to the fold's rows from its places. Where it changes in time it is searched
  /// anew: which body it was and when it moved is told by so few rows that its places would bring the fold what its own
  /// rows do not know.
  identify::GapModel namedOn(int block, std::span<const char> used) const {
    if (!actsInTime()) return search_.fitted(selection_.model.model, used);
    identify::GapModel model = search_.none().model;
    for (std::size_t s = 0; s < selection_.ways.size(); ++s) addBest(block, used, s, From::kNamedWay, model);
    return model;
  }

  bool actsInTime() const {
    return std::any_of(selection_.ways.begin(), selection_.ways.end(),
                       [this](std::size_t way) { return search_.ways()[way].needs_time; });
  }

  /// The criterion on the fold's rows, and what each effect must at least be worth of them.
  double priceOf(const identify::GapModel& model, std::span<const char> used) const {
    double price = search_.bicOf(model, used);
    for (std::size_t s = 0; s < model.terms.size(); ++s) price += leastGain(s, used);
    return price;
  }

  double leastGain(std::size_t step, std::span<const char> used) const {
    const identify::Thresholds& thresholds = search_.thresholds();
    return (step == 0 ? thresholds.least_gain_first : thresholds.least_gain_more) *
           static_cast<double>(std::count(used.begin(), used.end(), 1)) / static_cast<double>(used.size());
  }

  /// Adds the effect that the fold's own rows like best, if they like any; or what is named at this step, where they
  /// put it.
  void addBest(int block, std::span<const char> used, std::size_t step, From from_ways,
               identify::GapModel& model) const {
    const identify::GapModel from = search_.seenFrom(step == 0 ? search_.none().model : model);
    const identify::Linearized at(search_.physics(), from, search_.whitening(), blocks_,
                                  identify::ResponseAt::kHalfWayIfBent);
    std::optional<identify::Scanner> scanner;
    if (step > 0) scanner.emplace(at);
    const auto held_out = static_cast<std::size_t>(block);
    struct Start {
      std::size_t way = 0;
      Eigen::VectorXd searched;
      double gain = 0.0;
    };
    std::vector<Start> starts;
    const auto n = static_cast<double>(std::count(used.begin(), used.end(), 1) * channels());
    for (std::size_t w = 0; w < ways_.size(); ++w) {
      const identify::EffectWay& way = search_.ways()[ways_[w]];
      const auto is_there = [&](const identify::GapTerm& term) { return term.effect == way.effect; };
      const bool is_named = from_ways == From::kNamedWay;
      if (is_named ? w != step : std::any_of(model.terms.begin(), model.terms.end(), is_there)) continue;
      const identify::ScanResult scan = scanner ? scanned(*scanner, ways_[w]) : first_[w];
      if (scan.without_block.size() <= held_out) continue;
      const identify::ScanResult::Start& start = scan.without_block[held_out];
      const auto parameters = static_cast<double>(way.fit->searched().size());
      starts.push_back({ways_[w], start.searched, start.gain - parameters * std::log(n)});
    }
    std::stable_sort(starts.begin(), starts.end(), [](const Start& a, const Start& b) { return a.gain > b.gain; });
    // The linearised scan ranks shapes that bend along with the search too low: what the whole recording names at this
    // step is searched to the end as well, from where the fold's own rows put it.
    const auto is_own = [&](const Start& start) { return start.way == ways_[step]; };
    const auto others = starts.begin() + static_cast<std::ptrdiff_t>(std::min(starts.size(), kSearchedAFold));
    starts.erase(std::stable_partition(others, starts.end(), is_own), starts.end());
    double best = from_ways == From::kNamedWay ? std::numeric_limits<double>::infinity()
                                               : search_.bicOf(model, used) - leastGain(step, used);
    const identify::GapModel before = search_.seenFrom(model);
    const identify::LocalFitter near(at, held_out);
    for (const Start& start : starts) {
      const identify::EffectWay& way = search_.ways()[start.way];
      const identify::LocalFit local = near.from(*way.fit, start.searched);
      identify::GapModel tried = before;
      tried.terms.push_back({way.effect, way.fit, local.searched, local.linear});
      tried = search_.fitted(tried, used);
      const double bic = search_.bicOf(tried, used);
      if (bic >= best) continue;
      best = bic;
      model = tried;
    }
  }

  int channels() const { return search_.physics().rows().channels(); }

  void score(std::span<const identify::Vector6d> left, std::span<const char> used, std::vector<UnseenRow>& rows) const {
    const std::vector<identify::Vector6d> white = identify::whitened({left.begin(), left.end()}, search_.whitening());
    for (std::size_t i = 0; i < left.size(); ++i) {
      if (used[i] != 0) continue;
      rows[i] = {left[i].head<3>().squaredNorm(), left[i].tail<3>().squaredNorm(), white[i].squaredNorm()};
    }
  }

  void scoreBeside(std::span<const identify::UnnamedLaws> laws, std::vector<identify::Vector6d> left,
                   std::span<const char> used, std::vector<UnseenRow>& rows) const {
    rival_.takeAway(laws, used, left);
    score(left, used, rows);
  }

  const identify::GapSearch& search_;
  const identify::EffectSelection& selection_;
  const identify::UnnamedRival& rival_;
  const RivalLaws& laws_;
  std::span<const int> blocks_;
  UnseenScores& scores_;
  std::vector<std::size_t> ways_;
  std::vector<identify::ScanResult> first_;  ///< Of each way, on the model without effects.
};

}  // namespace

std::vector<int> scatteredBlocks(const identify::GapRows& rows) {
  constexpr int kFolds = 10;
  std::vector<int> of_place(rows.place_nodes.size());
  for (std::size_t p = 0; p < of_place.size(); ++p) of_place[p] = static_cast<int>(p % kFolds);
  std::mt19937_64 generator(7);
  for (std::size_t n = of_place.size(); n > 1; --n) std::swap(of_place[n - 1], of_place[generator() % n]);
  std::vector<int> blocks;
  for (const identify::GapRow& row : rows.rows) blocks.push_back(of_place[row.place]);
  return blocks;
}

UnseenScores scoreUnseen(const identify::GapSearch& search, const identify::EffectSelection& selection,
                         const identify::UnnamedRival& rival, const RivalLaws& laws, std::span<const int> blocks,
                         const RunControl& control) {
  UnseenScores scores;
  const std::vector<UnseenRow> empty(blocks.size());
  scores.step.assign(selection.ways.size() + 1, empty);
  scores.smooth = scores.both = empty;
  const FoldFitter fitter(search, selection, rival, laws, blocks, scores, control);
  const int n_blocks = 1 + *std::max_element(blocks.begin(), blocks.end());
  control.parallel_for(static_cast<std::size_t>(n_blocks), [&](std::size_t block) {
    if (!control.stop.stop_requested()) fitter.run(static_cast<int>(block), control);
  });
  return scores;
}

}  // namespace fieldtrue::gap
