#include "calib/recording/hemisphere.h"

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "calib/core/statistics.h"
#include "calib/geometry/geometry.h"
#include "calib/recording/cleaning.h"

namespace fieldtrue::recording {

namespace {

constexpr std::size_t kFewestHemisphereRows = 6;
/// Rows on which guesses are judged; the best is then judged on all.
constexpr std::size_t kMostJudged = 150;
constexpr int kTriples = 150;
constexpr int kRefinements = 12;
/// What calling a row mirrored must save, as a share of the median distance to the transmitter.
constexpr double kPrice = 0.25;
/// A mirrored row must lie this many times nearer its place once mirrored back.
constexpr double kTimesNearer = 3.0;

struct Pair {
  Eigen::Vector3d true_m;
  Eigen::Vector3d tracked_m;
};

/// A guess of the alignment and what is left under it.
struct Guess {
  Pose tracker_from_reference;
  double cost_m = std::numeric_limits<double>::infinity();
};

double distance_m(const Pair& pair, const Pose& alignment, double sign) {
  return (sign * pair.tracked_m - alignment * pair.true_m).norm();
}

bool isNearerMirrored(const Pair& pair, const Pose& alignment, double price_m) {
  return distance_m(pair, alignment, -1.0) + price_m < distance_m(pair, alignment, 1.0);
}

double cost_m(const std::vector<Pair>& pairs, const Pose& alignment, double price_m) {
  double sum_m = 0.0;
  for (const Pair& pair : pairs) {
    sum_m += std::min(distance_m(pair, alignment, 1.0), distance_m(pair, alignment, -1.0) + price_m);
  }
  return sum_m;
}

/// Weighted least-squares rigid transform (Umeyama 1991, without scale).
Pose weightedRigid(const std::vector<Pair>& pairs, const std::vector<double>& signed_weights) {
  Eigen::Vector3d from_m = Eigen::Vector3d::Zero(), to_m = Eigen::Vector3d::Zero();
  double total = 0.0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    from_m += std::abs(signed_weights[i]) * pairs[i].true_m;
    to_m += signed_weights[i] * pairs[i].tracked_m;
    total += std::abs(signed_weights[i]);
  }
  from_m /= total;
  to_m /= total;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double sign = std::copysign(1.0, signed_weights[i]);
    covariance +=
        std::abs(signed_weights[i]) * (sign * pairs[i].tracked_m - to_m) * (pairs[i].true_m - from_m).transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d flip(1.0, 1.0, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0);
  const Eigen::Matrix3d rotation = svd.matrixU() * flip.asDiagonal() * svd.matrixV().transpose();
  return {to_m - rotation * from_m, Eigen::Quaterniond(rotation)};
}

/// Least sum of distances by reweighting, the signs chosen anew in every round.
/// @param scale_m distances below it weigh alike
Pose refined(const std::vector<Pair>& pairs, Pose alignment, double price_m, double scale_m, int rounds) {
  std::vector<double> weights(pairs.size());
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const double sign = isNearerMirrored(pairs[i], alignment, price_m) ? -1.0 : 1.0;
      weights[i] = sign / std::max(distance_m(pairs[i], alignment, sign), scale_m);
    }
    alignment = weightedRigid(pairs, weights);
  }
  return alignment;
}

std::vector<Pair> judgedPairs(const std::vector<Pair>& pairs) {
  if (pairs.size() <= kMostJudged) return pairs;
  std::vector<Pair> judged;
  for (std::size_t i = 0; i < kMostJudged; ++i) judged.push_back(pairs[i * pairs.size() / kMostJudged]);
  return judged;
}

/// Alignments from three rows each, with every choice of their signs.
std::vector<Pose> guesses(const std::vector<Pair>& pairs) {
  std::vector<Pose> alignments = {weightedRigid(pairs, std::vector<double>(pairs.size(), 1.0))};
  std::mt19937_64 generator(1);
  for (int n = 0; n < kTriples; ++n) {
    std::array<std::size_t, 3> rows{};
    for (std::size_t& row : rows) row = static_cast<std::size_t>(generator() % pairs.size());
    for (unsigned signs = 0; signs < 8; ++signs) {
      std::vector<Pair> three;
      for (unsigned k = 0; k < 3; ++k) {
        const double sign = ((signs >> k) & 1U) != 0U ? -1.0 : 1.0;
        three.push_back({pairs[rows[k]].true_m, sign * pairs[rows[k]].tracked_m});
      }
      alignments.push_back(weightedRigid(three, {1.0, 1.0, 1.0}));
    }
  }
  return alignments;
}

Pose bestAlignment(const std::vector<Pair>& pairs, double price_m) {
  const std::vector<Pair> judged = judgedPairs(pairs);
  const double scale_m = 0.01 * price_m;
  std::vector<Guess> ranked;
  for (const Pose& alignment : guesses(judged)) {
    const Pose nearer = refined(judged, alignment, price_m, scale_m, 1);
    ranked.push_back({nearer, cost_m(judged, nearer, price_m)});
  }
  std::stable_sort(ranked.begin(), ranked.end(), [](const Guess& a, const Guess& b) { return a.cost_m < b.cost_m; });
  ranked.resize(std::min<std::size_t>(ranked.size(), 5));
  Guess best;
  for (const Guess& guess : ranked) {
    const Pose alignment = refined(pairs, guess.tracker_from_reference, price_m, scale_m, kRefinements);
    const double left_m = cost_m(pairs, alignment, price_m);
    if (left_m < best.cost_m) best = {alignment, left_m};
  }
  return best.tracker_from_reference;
}

/// Indices of one sensor's rows.
std::vector<std::size_t> rowsOf(const std::vector<Node>& nodes, int sensor) {
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i].sensor == sensor) rows.push_back(i);
  }
  return rows;
}

void markMirrored(const std::vector<Node>& nodes, const std::vector<std::size_t>& rows, std::vector<bool>& mirrored) {
  if (rows.size() < kFewestHemisphereRows) return;
  std::vector<Pair> pairs;
  std::vector<double> ranges_m;
  for (const std::size_t row : rows) {
    pairs.push_back({nodes[row].reference_from_sensor.position_m, nodes[row].tracker_from_sensor.position_m});
    ranges_m.push_back(pairs.back().tracked_m.norm());
  }
  const double price_m = kPrice * median(std::move(ranges_m));
  if (price_m <= 0.0) return;
  const Pose alignment = bestAlignment(pairs, price_m);
  std::size_t n_mirrored = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double as_is_m = distance_m(pairs[i], alignment, 1.0);
    const double back_m = distance_m(pairs[i], alignment, -1.0);
    mirrored[rows[i]] = back_m * kTimesNearer < as_is_m;
    if (mirrored[rows[i]]) ++n_mirrored;
  }
  // More than half the other way round is a hemisphere set otherwise than we think, not readings gone astray.
  if (2 * n_mirrored <= rows.size()) return;
  for (const std::size_t row : rows) mirrored[row] = false;
}

}  // namespace

std::vector<bool> mirroredRows(const std::vector<Node>& nodes) {
  std::vector<bool> mirrored(nodes.size(), false);
  std::vector<int> sensors;
  for (const Node& node : nodes) sensors.push_back(node.sensor);
  std::sort(sensors.begin(), sensors.end());
  sensors.erase(std::unique(sensors.begin(), sensors.end()), sensors.end());
  for (const int sensor : sensors) markMirrored(nodes, rowsOf(nodes, sensor), mirrored);
  return mirrored;
}

}  // namespace fieldtrue::recording
