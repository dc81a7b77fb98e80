#include "calib/gap/how_far.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "calib/core/statistics.h"
#include "calib/evaluation/base/intervals.h"
#include "calib/gap/row_tails.h"
#include "calib/geometry/region_shares.h"

namespace fieldtrue::gap {
namespace {

struct Moments {
  double mean_a = 0.0;
  double mean_b = 0.0;
  double var_a = 0.0;  ///< Of the means.
  double var_b = 0.0;
  double cov = 0.0;
};

Moments momentsOf(std::span<const double> a, std::span<const double> b) {
  const auto n = static_cast<double>(a.size());
  Moments m;
  for (std::size_t i = 0; i < a.size(); ++i) {
    m.mean_a += a[i] / n;
    m.mean_b += b[i] / n;
  }
  for (std::size_t i = 0; i < a.size(); ++i) {
    m.var_a += (a[i] - m.mean_a) * (a[i] - m.mean_a);
    m.var_b += (b[i] - m.mean_b) * (b[i] - m.mean_b);
    m.cov += (a[i] - m.mean_a) * (b[i] - m.mean_b);
  }
  const double scale = n > 1.0 ? 1.0 / (n * (n - 1.0)) : 0.0;
  m.var_a *= scale;
  m.var_b *= scale;
  m.cov *= scale;
  return m;
}

Bounded meanOf(std::span<const double> values) {
  const Moments m = momentsOf(values, values);
  Bounded mean{m.mean_a, {}, {}};
  if (values.size() < 3) return mean;
  const double half = evaluation::studentPoint95(static_cast<double>(values.size() - 1)) * std::sqrt(m.var_a);
  mean.low90 = mean.value - half;
  mean.high90 = mean.value + half;
  return mean;
}

/// Mean over the rows of each place, times its share of the region and the number of places: their plain mean is the
/// region's.
template <class Value>
std::vector<double> byPlace(const identify::GapRows& rows, std::span<const double> shares, Value value) {
  std::vector<double> sums(rows.place_nodes.size(), 0.0);
  std::vector<double> counts(sums.size(), 0.0);
  for (std::size_t i = 0; i < rows.rows.size(); ++i) {
    sums[rows.rows[i].place] += value(i);
    counts[rows.rows[i].place] += 1.0;
  }
  for (std::size_t p = 0; p < sums.size(); ++p) sums[p] *= shares[p] * static_cast<double>(sums.size()) / counts[p];
  return sums;
}

double meanOver(const identify::GapRows& rows, std::span<const double> shares, const std::vector<double>& squares) {
  const std::vector<double> by_place = byPlace(rows, shares, [&](std::size_t i) { return squares[i]; });
  return std::accumulate(by_place.begin(), by_place.end(), 0.0) / static_cast<double>(by_place.size());
}

/// How clearly an excess stands above nothing, in standard errors.
double clarity(const Bounded& excess) {
  if (!excess.low90) return 0.0;
  const double half = excess.value - *excess.low90;
  return half > 0.0 ? excess.value / half : 0.0;
}

}  // namespace

Bounded ratioOfMeans(std::span<const double> numerators, std::span<const double> denominators) {
  const Moments m = momentsOf(numerators, denominators);
  Bounded ratio{m.mean_a / m.mean_b, {}, {}};
  if (numerators.size() < 3) return ratio;
  // All f for which the mean of a - f b is not clearly other than zero.
  const double t = evaluation::studentPoint95(static_cast<double>(numerators.size() - 1));
  const double a = m.mean_b * m.mean_b - t * t * m.var_b;
  const double b = m.mean_a * m.mean_b - t * t * m.cov;
  const double c = m.mean_a * m.mean_a - t * t * m.var_a;
  const double root = b * b - a * c;
  if (a <= 0.0 || m.mean_b <= 0.0 || root < 0.0) return ratio;  // The start itself is not clear of the floor.
  ratio.low90 = (b - std::sqrt(root)) / a;
  ratio.high90 = (b + std::sqrt(root)) / a;
  return ratio;
}

std::vector<double> regionShares(const identify::GapRows& rows) {
  std::vector<Eigen::Vector3d> places_m(rows.place_nodes.size());
  for (const identify::GapRow& row : rows.rows) places_m[row.place] = row.reference_from_sensor.position_m;
  return fieldtrue::regionShares(places_m);
}

namespace {

/// As much noise as the recording's own samples and its rig allow.
void setAllowed(const identify::GapSearch& search, std::size_t row, RowNoise& noise) {
  const identify::GapRows& rows = search.physics().rows();
  const identify::Matrix6d allowed =
      identify::noiseOf(rows.rows[row], search.floorPlacingSd_m(), search.floorPlacingSd_rad());
  noise.square_m2[row] = allowed.topLeftCorner<3, 3>().trace();
  noise.square_rad2[row] = allowed.bottomRightCorner<3, 3>().trace();
  noise.whitened[row] = rows.channels();
}

}  // namespace

RowNoise noiseLeftBy(const identify::GapSearch& search, const identify::Structure& structure) {
  const identify::GapRows& rows = search.physics().rows();
  const auto share = [](double floor, double placing) {
    return floor < placing ? floor * floor / (placing * placing) : 1.0;
  };
  const double share_m2 = share(search.floorPlacingSd_m(), search.placingSd_m());
  const double share_rad2 = share(search.floorPlacingSd_rad(), search.placingSd_rad());
  const std::size_t count = rows.rows.size();
  RowNoise noise{std::vector<double>(count), std::vector<double>(count), std::vector<double>(count), {}};
  if (!search.belongTogether()) {
    for (std::size_t i = 0; i < count; ++i) setAllowed(search, i, noise);
    return noise;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const identify::Vector6d& left = structure.noise[i];
    const Eigen::Vector3d left_m = search.whitening().position[i].triangularView<Eigen::Lower>().solve(left.head<3>());
    noise.square_m2[i] = share_m2 * left_m.squaredNorm();
    noise.whitened[i] = left.squaredNorm();
    noise.square_rad2[i] = share_rad2 * (left.tail<3>() / search.whitening().rotation[i]).squaredNorm();
  }
  noise.strays = straysAmong(structure.noise, rows.has_orientation, search.thresholds());
  for (const std::size_t i : noise.strays) setAllowed(search, i, noise);
  return noise;
}

namespace {

/// Of the whitened squares of all rows those of some.
double shareOf(const std::vector<std::size_t>& some, const std::vector<UnseenRow>& rows) {
  double of_some = 0.0, of_all = 0.0;
  for (const std::size_t i : some) of_some += rows[i].whitened;
  for (const UnseenRow& row : rows) of_all += row.whitened;
  return of_all > 0.0 ? of_some / of_all : 0.0;
}

}  // namespace

double signedRoot_mm(double square_m2) { return 1e3 * std::copysign(std::sqrt(std::abs(square_m2)), square_m2); }

HowFar howFar(const UnseenScores& scores, const RowNoise& noise, const identify::GapRows& rows) {
  HowFar far;
  const std::vector<double> shares = regionShares(rows);
  far.floor_m2 = meanOver(rows, shares, noise.square_m2);
  if (rows.has_orientation) far.floor_rad2 = meanOver(rows, shares, noise.square_rad2);
  std::vector<std::vector<double>> by_m2;
  std::vector<std::vector<double>> by_rad2;
  for (const std::vector<UnseenRow>& step : scores.step) {
    by_m2.push_back(byPlace(rows, shares, [&](std::size_t i) { return step[i].square_m2 - noise.square_m2[i]; }));
    by_rad2.push_back(byPlace(rows, shares, [&](std::size_t i) {
      return rows.has_orientation ? step[i].square_rad2 - noise.square_rad2[i] : 0.0;
    }));
    far.excess_m2.push_back(meanOf(by_m2.back()));
    far.excess_rad2.push_back(meanOf(by_rad2.back()));
  }
  far.by_rotation = rows.has_orientation && clarity(far.excess_m2.front()) < 1.0 &&
                    clarity(far.excess_rad2.front()) > std::max(1.0, clarity(far.excess_m2.front()));
  const auto& by = far.by_rotation ? by_rad2 : by_m2;
  for (std::size_t s = 0; s < by.size(); ++s) {
    far.left_of_start.push_back(s == 0 ? Bounded{1.0, 1.0, 1.0} : ratioOfMeans(by[s], by[0]));
    far.left_of_before.push_back(s == 0 ? Bounded{1.0, 1.0, 1.0} : ratioOfMeans(by[s], by[s - 1]));
  }
  for (std::size_t i = 0; i < noise.whitened.size(); ++i)
    far.whitened_excess += scores.step.front()[i].whitened - noise.whitened[i];
  for (const UnseenRow& row : scores.step.back()) far.size_m.push_back(std::sqrt(row.square_m2));
  far.strays = noise.strays;
  far.strays_share = shareOf(far.strays, scores.step.front());
  return far;
}

double meanOverRegion(const identify::GapRows& rows, const std::vector<double>& values) {
  return meanOver(rows, regionShares(rows), values);
}

Bounded pairedDifference(const std::vector<UnseenRow>& first, const std::vector<UnseenRow>& second,
                         const identify::GapRows& rows) {
  return meanOf(
      byPlace(rows, regionShares(rows), [&](std::size_t i) { return first[i].whitened - second[i].whitened; }));
}

}  // namespace fieldtrue::gap
