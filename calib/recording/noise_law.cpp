#include "calib/recording/noise_law.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "calib/core/statistics.h"
#include "calib/core/units.h"

namespace fieldtrue::recording {

namespace {

constexpr std::size_t kFewestNoiseRows = 12;
constexpr int kFewestReadingsOfAVisit = 5;
/// SD of the logarithm of range below which no power can be told.
constexpr double kLeastSpread = 0.1;
constexpr int kDraws = 200;
/// Variances below so many of the quantum's own say nothing of the noise.
constexpr double kTimesQuantumVariance = 2.0;
/// Total position SD over sigma r^4/C: one radial axis of 1/(3 sqrt(6)), two transverse ones of sqrt(5)/3.
const double kTotalPerCoupling = std::sqrt(1.0 / 54.0 + 2.0 * 5.0 / 9.0);

struct Point {
  double x = 0.0;
  double y = 0.0;
};

struct Line {
  double offset = 0.0;
  double slope = 0.0;
};

Line weightedLine(const std::vector<Point>& points, const std::vector<double>& weights) {
  double w = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    w += weights[i];
    x += weights[i] * points[i].x;
    y += weights[i] * points[i].y;
  }
  x /= w;
  y /= w;
  for (std::size_t i = 0; i < points.size(); ++i) {
    xx += weights[i] * (points[i].x - x) * (points[i].x - x);
    xy += weights[i] * (points[i].x - x) * (points[i].y - y);
  }
  const double slope = xx > 0.0 ? xy / xx : 0.0;
  return {y - slope * x, slope};
}

/// Huber's line: rows far off weigh less, so a stop at which somebody leaned on the jig does not turn it.
Line robustLine(const std::vector<Point>& points) {
  std::vector<double> weights(points.size(), 1.0);
  Line line;
  for (int round = 0; round < 10; ++round) {
    line = weightedLine(points, weights);
    std::vector<double> sizes;
    for (const Point& point : points) sizes.push_back(std::abs(point.y - line.offset - line.slope * point.x));
    const double scale = std::max(kSdPerMad * median(sizes), 1e-6);
    for (std::size_t i = 0; i < points.size(); ++i) weights[i] = std::min(1.0, 1.5 * scale / std::max(sizes[i], 1e-12));
  }
  return line;
}

/// The figure and its scatter over resampled rows.
Uncertain resampled(const std::vector<Point>& points, const std::function<double(const std::vector<Point>&)>& figure) {
  std::mt19937_64 generator(1);
  double sum = 0.0, squares = 0.0;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<Point> drawn;
    for (std::size_t i = 0; i < points.size(); ++i) drawn.push_back(points[generator() % points.size()]);
    const double value = figure(drawn);
    sum += value;
    squares += value * value;
  }
  const double mean = sum / kDraws;
  return {figure(points), std::sqrt(std::max(1e-12, squares / kDraws - mean * mean))};
}

double spreadOf(const std::vector<Point>& points) {
  double mean = 0.0, squares = 0.0;
  for (const Point& point : points) mean += point.x / static_cast<double>(points.size());
  for (const Point& point : points) squares += (point.x - mean) * (point.x - mean);
  return std::sqrt(squares / static_cast<double>(points.size()));
}

/// Splits a covariance into the line of sight and across it.
std::optional<NoiseRow> noiseRow(const Eigen::Vector3d& p_m, const Eigen::Matrix3d& covariance_m2, double quantum_m) {
  const double range_m = p_m.norm();
  if (range_m < 1e-3) return std::nullopt;
  const Eigen::Vector3d u = p_m / range_m;
  const double quantum_m2 = quantum_m * quantum_m / 12.0;
  const double radial_m2 = u.dot(covariance_m2 * u);
  const double transverse_m2 = 0.5 * (covariance_m2.trace() - radial_m2);
  if (!(std::min(radial_m2, transverse_m2) > 1e-18)) return std::nullopt;
  if (transverse_m2 < (1.0 + kTimesQuantumVariance) * quantum_m2) return std::nullopt;
  NoiseRow row;
  row.range_m = range_m;
  row.transverse_sd_m = std::sqrt(transverse_m2 - quantum_m2);
  row.radial_sd_m = std::sqrt(std::max(radial_m2 - quantum_m2, 0.05 * radial_m2));
  return row;
}

}  // namespace

std::vector<NoiseRow> noiseRows(const std::vector<SampleVisit>& visits, double correlation, double quantum_m) {
  std::vector<NoiseRow> rows;
  const double worth_one = (1.0 + correlation) / (1.0 - correlation);
  for (const SampleVisit& visit : visits) {
    const auto n = static_cast<double>(visit.deviations.rows());
    if (worth_one > 0.5 * n) continue;
    const Eigen::MatrixXd covariance = visit.deviations.transpose() * visit.deviations / (n - worth_one);
    auto row = noiseRow(visit.mean_m, covariance.topLeftCorner<3, 3>(), quantum_m);
    if (!row) continue;
    const double rotation_rad2 = covariance.bottomRightCorner<3, 3>().trace();
    if (rotation_rad2 > 1e-14) row->rotation_sd_rad = std::sqrt(rotation_rad2);
    rows.push_back(*row);
  }
  return rows;
}

std::vector<NoiseRow> noiseRows(std::span<const Node> nodes, double quantum_m) {
  std::vector<NoiseRow> rows;
  for (const Node& node : nodes) {
    if (!node.covariance_m2 || node.n_used < kFewestReadingsOfAVisit || node.role == NodeRole::kSkipped) continue;
    auto row = noiseRow(node.tracker_from_sensor.position_m, *node.covariance_m2, quantum_m);
    if (!row) continue;
    if (node.has_orientation && node.sd_rot_rad && *node.sd_rot_rad > 2e-6) row->rotation_sd_rad = node.sd_rot_rad;
    rows.push_back(*row);
  }
  return rows;
}

std::optional<NoiseLaw> fitNoiseLaw(const std::vector<NoiseRow>& rows) {
  std::vector<Point> position, rotation, anisotropy, level;
  NoiseLaw law;
  for (const NoiseRow& row : rows) {
    const double x = std::log(row.range_m);
    const double total_m = std::hypot(row.radial_sd_m, std::sqrt(2.0) * row.transverse_sd_m);
    position.push_back({x, std::log(total_m)});
    anisotropy.push_back({x, std::log(row.transverse_sd_m / row.radial_sd_m)});
    level.push_back({x, std::log(total_m / kTotalPerCoupling) - kPositionNoisePower * x});
    if (row.rotation_sd_rad) rotation.push_back({x, std::log(*row.rotation_sd_rad)});
    law.nearest_m = law.rows == 0 ? row.range_m : std::min(law.nearest_m, row.range_m);
    law.farthest_m = std::max(law.farthest_m, row.range_m);
    ++law.rows;
  }
  if (rows.size() < kFewestNoiseRows || spreadOf(position) < kLeastSpread) return std::nullopt;
  const auto slope = [](const std::vector<Point>& points) { return robustLine(points).slope; };
  const auto middle = [](const std::vector<Point>& points) {
    std::vector<double> values;
    for (const Point& point : points) values.push_back(point.y);
    return median(std::move(values));
  };
  law.position_power = resampled(position, slope);
  if (rotation.size() >= kFewestNoiseRows && spreadOf(rotation) >= kLeastSpread) {
    law.rotation_power = resampled(rotation, slope);
  }
  law.log_transverse_to_radial = resampled(anisotropy, middle);
  law.log_coupling_noise = resampled(level, middle);
  return law;
}

}  // namespace fieldtrue::recording
