#include "calib/gap/held_out.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>

#include "calib/core/statistics.h"

namespace fieldtrue::gap {
namespace {

/// Squared whitened residuals of each row with the first 0, 1, ... effects, from fits that did not see the row.
using RowSquares = std::vector<std::vector<double>>;

class FoldFitter {
 public:
  FoldFitter(const identify::GapSearch& search, const identify::EffectSelection& selection, std::span<const int> blocks)
      : search_(search), selection_(selection), blocks_(blocks) {}

  void run(int block, RowSquares& squares, const RunControl& control) const {
    std::vector<char> used(blocks_.size());
    for (std::size_t i = 0; i < used.size(); ++i) used[i] = blocks_[i] != block ? 1 : 0;
    identify::GapModel model;
    model.alignment = search_.none().model.alignment;
    model = search_.refined(model, used).model;
    score(model, used, 0, squares);
    for (std::size_t s = 0; s < selection_.ways.size() && !control.stop.stop_requested(); ++s) {
      const identify::EffectWay& way = search_.ways()[selection_.ways[s]];
      const identify::Linearized at(search_.physics(), model, search_.whitening(), blocks_);
      const auto held_out = static_cast<std::size_t>(block);
      RunControl quiet;
      quiet.stop = control.stop;
      const identify::ScanResult scanned = identify::scan(at, *way.fit, way.fit->starts(), 1, quiet);
      if (scanned.without_block.size() <= held_out) return;
      const identify::LocalFit local =
          identify::refineLocally(at, *way.fit, scanned.without_block[held_out].searched, held_out);
      model.terms.push_back({way.effect, way.fit, local.searched, local.linear});
      model = search_.refined(model, used).model;
      score(model, used, s + 1, squares);
    }
  }

 private:
  void score(const identify::GapModel& model, const std::vector<char>& used, std::size_t step,
             RowSquares& squares) const {
    const std::vector<identify::Vector6d> left =
        identify::whitenedResiduals(search_.physics(), model, search_.whitening());
    for (std::size_t i = 0; i < left.size(); ++i)
      if (used[i] == 0) squares[step][i] = left[i].squaredNorm();
  }

  const identify::GapSearch& search_;
  const identify::EffectSelection& selection_;
  std::span<const int> blocks_;
};

/// Means over places drawn with replacement of the fall from step 0 to each step.
std::vector<std::vector<double>> bootstrapFalls(const RowSquares& squares, const identify::GapRows& rows) {
  constexpr int kDraws = 300;
  const std::size_t n_places = rows.place_nodes.size();
  const std::size_t steps = squares.size();
  std::vector<std::vector<double>> by_place(steps, std::vector<double>(n_places, 0.0));
  std::vector<double> count(n_places, 0.0);
  for (std::size_t i = 0; i < rows.rows.size(); ++i) {
    count[rows.rows[i].place] += rows.channels();
    for (std::size_t s = 0; s < steps; ++s) by_place[s][rows.rows[i].place] += squares[0][i] - squares[s][i];
  }
  std::mt19937_64 generator(20240601);
  std::vector<std::vector<double>> falls(steps);
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<double> sum(steps, 0.0);
    double total = 0.0;
    for (std::size_t k = 0; k < n_places; ++k) {
      const std::size_t p = generator() % n_places;
      total += count[p];
      for (std::size_t s = 0; s < steps; ++s) sum[s] += by_place[s][p];
    }
    for (std::size_t s = 0; s < steps; ++s) falls[s].push_back(sum[s] / total);
  }
  return falls;
}

}  // namespace

double HeldOutGap::fractionAfter(std::size_t effects) const {
  if (effects == 0 || !(before > 0.0)) return 1.0;
  return std::sqrt(std::max(0.0, after[effects - 1]) / before);
}

double whitenedSquares(const identify::GapSearch& search, const identify::GapModel& model) {
  double sum = 0.0;
  for (const identify::Vector6d& r : identify::whitenedResiduals(search.physics(), model, search.whitening()))
    sum += r.squaredNorm();
  return sum;
}

HeldOutGap holdOut(const identify::GapSearch& search, const identify::EffectSelection& selection,
                   const identify::Structure& structure, const RunControl& control) {
  const identify::GapRows& rows = search.physics().rows();
  const double count = static_cast<double>(rows.rows.size()) * rows.channels();
  const bool by_time = !selection.ways.empty() && search.ways()[selection.ways.front()].needs_time;
  const std::span<const int> blocks = by_time ? search.timeBlocksOfRows() : search.spaceBlocks();
  const int n_blocks = 1 + *std::max_element(blocks.begin(), blocks.end());
  RowSquares squares(selection.ways.size() + 1, std::vector<double>(rows.rows.size(), 0.0));
  const FoldFitter fitter(search, selection, blocks);
  control.parallel_for(static_cast<std::size_t>(n_blocks), [&](std::size_t block) {
    if (!control.stop.stop_requested()) fitter.run(static_cast<int>(block), squares, control);
  });
  HeldOutGap gap;
  gap.left = std::max(0.0, structure.energy) / count;
  gap.left_sd = structure.energy_sd / count;
  const double none = whitenedSquares(search, search.none().model);
  const double last = whitenedSquares(search, selection.model.model);
  double parameters = 0.0;
  for (const identify::GapTerm& term : selection.model.model.terms)
    parameters += static_cast<double>(term.linear.size() + term.searched.size());
  gap.before = std::max(0.0, (none - last - parameters) / count) + gap.left;
  if (selection.ways.empty()) gap.before = gap.left;
  const std::vector<std::vector<double>> falls = bootstrapFalls(squares, rows);
  gap.before_low90 = std::max(0.0, gap.before - 1.645 * gap.left_sd);
  gap.before_high90 = gap.before + 1.645 * gap.left_sd;
  for (std::size_t s = 1; s < squares.size(); ++s) {
    double fall = 0.0;
    for (std::size_t i = 0; i < rows.rows.size(); ++i) fall += (squares[0][i] - squares[s][i]) / count;
    gap.after.push_back(std::max(0.0, gap.before - fall));
    // The start's own uncertainty enters both ends alike, so only the fall's counts here.
    gap.after_low90.push_back(std::max(0.0, gap.before - quantile(falls[s], 0.95) - gap.left_sd));
    gap.after_high90.push_back(std::max(0.0, gap.before - quantile(falls[s], 0.05) + gap.left_sd));
  }
  return gap;
}

std::vector<double> creditShares(const identify::GapSearch& search, const identify::EffectSelection& selection) {
  const std::size_t n = selection.ways.size();
  if (n == 0) return {};
  if (n == 1) return {1.0};
  const identify::GapModel& full = selection.model.model;
  std::vector<double> value(std::size_t{1} << n, 0.0);
  for (std::size_t subset = 0; subset < value.size(); ++subset) {
    identify::GapModel model;
    model.alignment = full.alignment;
    for (std::size_t t = 0; t < n; ++t)
      if ((subset >> t & 1U) != 0) model.terms.push_back(full.terms[t]);
    value[subset] = -whitenedSquares(search, search.refined(model).model);
  }
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
