#include "calib/gap/row_tails.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace fieldtrue::gap {
namespace {

/// Upper tail of the squared size of some whitened numbers under a Student t of them together: over their count it
/// follows Fisher's F of that count and `freedom` degrees, by the finite sum that the incomplete beta function is for
/// whole a.
/// @param freedom even
/// @source Abramowitz and Stegun 1964, 26.6.2 and 26.5.6
double tailOf(double square, int count, double freedom) {
  const double half = 0.5 * count;
  const double beyond = freedom / (freedom + square);
  double term = std::pow(1.0 - beyond, half), sum = 0.0;
  for (int j = 0; j < static_cast<int>(0.5 * freedom); ++j) {
    sum += term;
    term *= (half + j) / (1.0 + j) * beyond;
  }
  return std::clamp(1.0 - sum, 1e-15, 1.0);
}

/// Marks the hypotheses that may be rejected with a false-discovery rate of at most `rate`.
std::vector<char> discoveries(const std::vector<double>& p, double rate) {
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return p[a] < p[b]; });
  std::size_t count = 0;
  for (std::size_t k = 0; k < order.size(); ++k)
    if (p[order[k]] <= rate * static_cast<double>(k + 1) / static_cast<double>(p.size())) count = k + 1;
  std::vector<char> found(p.size(), 0);
  for (std::size_t k = 0; k < count; ++k) found[order[k]] = 1;
  return found;
}

/// @param parts of the rows, three numbers each
std::vector<std::size_t> straysOfPart(std::vector<identify::Vector6d> parts, const identify::Thresholds& thresholds) {
  constexpr std::size_t kOneOf = 33, kAlways = 3, kOfFew = 8;
  const std::size_t most = std::max(parts.size() / kOneOf, std::min(kAlways, parts.size() / kOfFew));
  std::vector<std::size_t> order(parts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return parts[a].squaredNorm() > parts[b].squaredNorm(); });
  std::vector<identify::Vector6d> farthest_first;
  for (const std::size_t i : order) farthest_first.push_back(parts[i]);
  std::size_t strays = 0;
  for (std::size_t k = 0; k < most; ++k) {
    const std::span<const identify::Vector6d> others = std::span(farthest_first).subspan(k + 1);
    const identify::ResidualLaw law = identify::likeliestLaw(others, false);
    // Readings without any noise have the whitening's own.
    const double scale = std::max(1.0, identify::devianceOf(others, false, law).scale.position);
    const double square = farthest_first[k].squaredNorm() / (scale * scale);
    const double chance = tailOf(square, 3, law.degrees_of_freedom) * static_cast<double>(parts.size());
    if (square > 3.0 * thresholds.far_off * thresholds.far_off && chance < thresholds.sure_stray) strays = k + 1;
  }
  order.resize(strays);
  return order;
}

}  // namespace

std::vector<std::size_t> straysAmong(std::span<const identify::Vector6d> whitened, bool has_orientation,
                                     const identify::Thresholds& thresholds) {
  std::vector<identify::Vector6d> position(whitened.size(), identify::Vector6d::Zero()), rotation = position;
  for (std::size_t i = 0; i < whitened.size(); ++i) {
    position[i].head<3>() = whitened[i].head<3>();
    rotation[i].head<3>() = whitened[i].tail<3>();
  }
  std::vector<std::size_t> strays = straysOfPart(std::move(position), thresholds);
  if (!has_orientation) return strays;
  for (const std::size_t i : straysOfPart(std::move(rotation), thresholds))
    if (std::find(strays.begin(), strays.end(), i) == strays.end()) strays.push_back(i);
  return strays;
}

std::vector<char> farOff(const identify::GapSearch& search, std::span<const identify::Vector6d> whitened, double rate) {
  const bool has_orientation = search.physics().rows().has_orientation;
  const identify::ResidualScale scale = identify::devianceOf(search.noiseLeft(), has_orientation, search.law()).scale;
  const double unit2 = has_orientation ? 0.5 * (scale.position * scale.position + scale.rotation * scale.rotation)
                                       : scale.position * scale.position;
  std::vector<double> p;
  for (const identify::Vector6d& row : whitened)
    p.push_back(tailOf(row.squaredNorm() / unit2, has_orientation ? 6 : 3, search.law().degrees_of_freedom));
  return discoveries(p, rate);
}

}  // namespace fieldtrue::gap
