#include "acquisition/sampling/signal_report.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "acquisition/sampling/stillness.h"
#include "calib/core/statistics.h"
#include "calib/recording/stand_noise.h"

namespace fieldtrue::acquisition {

namespace {

constexpr std::size_t kDriftParts = 10;
constexpr double kShortestDrift_s = 20.0;
/// As averageSamples has it where the readings show no step.
constexpr double kFinestStep_m = 1e-6;
/// The spectrum pools stops: one stand is cut into as many as it needs at least.
constexpr std::size_t kSpectrumParts = 4;
/// A line of parts of the stand may be off by so many of the spectrum's steps.
constexpr double kStepsOff = 4.0;

std::vector<Sample> goodOfStand(const SensorSignal& signal) {
  std::vector<Sample> good;
  if (!signal.rests_from_s) return good;
  std::copy_if(signal.recent.begin(), signal.recent.end(), std::back_inserter(good), [&](const Sample& sample) {
    return sample.time_s >= *signal.rests_from_s && sample.time_s <= signal.seconds.back().t_s && isGood(sample);
  });
  return good;
}

std::optional<recording::SampleSpectrum> spectrumOf(const std::vector<Sample>& samples, double rate_hz) {
  SampleTable table;
  table.metadata.rate_hz = rate_hz;
  for (std::size_t i = 0; i < samples.size(); ++i)
    table.rows.push_back({static_cast<int>(i * kSpectrumParts / samples.size()), 0, samples[i]});
  auto spectrum = recording::sampleSpectrum(recording::sampleVisits(table), table.metadata);
  if (!spectrum || spectrum->lines.empty()) return spectrum;
  for (SampleRow& row : table.rows) row.node = 0;
  const auto stand = recording::sampleVisits(table);
  if (stand.size() != 1) return spectrum;
  const double within_hz = kStepsOff * (spectrum->frequencies_hz[1] - spectrum->frequencies_hz[0]);
  spectrum->lines =
      recording::linesOfStand(stand.front().times_s, stand.front().deviations, spectrum->lines, within_hz);
  return spectrum;
}

/// Positions of what was averaged, a row each.
Eigen::MatrixXd positionsOf_m(const std::vector<Sample>& samples, const NodeStatistics& statistics) {
  std::vector<bool> is_left_out(samples.size(), false);
  for (const Rejection& rejection : statistics.rejections) is_left_out[rejection.sample] = true;
  Eigen::MatrixXd positions_m(static_cast<Eigen::Index>(statistics.n_used), 3);
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < samples.size(); ++i)
    if (!is_left_out[i]) positions_m.row(row++) = samples[i].tracker_from_sensor.position_m;
  return positions_m;
}

double rateOf(const std::vector<Sample>& samples) {
  if (samples.size() < 2) return 0.0;
  const double span_s = samples.back().time_s - samples.front().time_s;
  return span_s > 0.0 ? static_cast<double>(samples.size() - 1) / span_s : 0.0;
}

void addStand(const SensorSignal& signal, SignalReport& report) {
  const std::vector<Sample> good = goodOfStand(signal);
  const auto statistics = averageSamples(good);
  if (!statistics) return;
  constexpr double kHalfASecond_s = 0.5;
  report.rested_s = signal.seconds.back().t_s + kHalfASecond_s - *signal.rests_from_s;
  report.stand = statistics->mean;
  report.noise = noiseEllipsoid(statistics->covariance_m2, statistics->mean.position_m);
  report.sd_rot_rad = statistics->sd_rot_rad;
  report.correlation = statistics->autocorrelation;
  report.worth = recording::independentReadings(positionsOf_m(good, *statistics));
  report.least_sd_m = (statistics->quantum_m > 0.0 ? statistics->quantum_m : kFinestStep_m) / std::sqrt(12.0);
  report.of_stand = statistics->n_used;
  report.spectrum = spectrumOf(good, report.rate_hz);
  report.drift = driftOf(signal.seconds);
}

}  // namespace

NoiseEllipsoid noiseEllipsoid(const Eigen::Matrix3d& covariance_m2, const Eigen::Vector3d& position_m) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance_m2);
  NoiseEllipsoid noise;
  noise.sds_m = solver.eigenvalues().reverse().cwiseMax(0.0).cwiseSqrt();
  noise.axes = solver.eigenvectors().rowwise().reverse();
  if (const double range_m = position_m.norm(); range_m > 0.0) {
    const double cosine = std::abs(noise.axes.col(0).dot(position_m)) / range_m;
    noise.from_line_of_sight_rad = std::acos(std::min(1.0, cosine));
  }
  return noise;
}

std::optional<Drift> driftOf(const std::vector<SecondMean>& seconds) {
  if (seconds.size() < 2 * kDriftParts || seconds.back().t_s - seconds.front().t_s < kShortestDrift_s - 1.5)
    return std::nullopt;
  Eigen::Matrix<double, kDriftParts, 1> times_s;
  Eigen::Matrix<double, kDriftParts, 3> means_m;
  for (std::size_t part = 0; part < kDriftParts; ++part) {
    const std::size_t first = part * seconds.size() / kDriftParts, end = (part + 1) * seconds.size() / kDriftParts;
    const auto row = static_cast<Eigen::Index>(part);
    times_s[row] = 0.0;
    means_m.row(row).setZero();
    for (std::size_t i = first; i < end; ++i) {
      times_s[row] += seconds[i].t_s / static_cast<double>(end - first);
      means_m.row(row) += seconds[i].mean_m.transpose() / static_cast<double>(end - first);
    }
  }
  const auto centred_s = (times_s.array() - times_s.mean()).matrix().eval();
  const Eigen::Matrix<double, kDriftParts, 3> centred_m = means_m.rowwise() - means_m.colwise().mean();
  Drift drift;
  drift.m_per_s = centred_m.transpose() * centred_s / centred_s.squaredNorm();
  const double left_m2 = (centred_m - centred_s * drift.m_per_s.transpose()).squaredNorm();
  drift.sd_m_per_s = std::sqrt(left_m2 / (kDriftParts - 2) / centred_s.squaredNorm());
  drift.over_s = seconds.back().t_s - seconds.front().t_s;
  return drift;
}

SignalReport signalReport(const SensorSignal& signal) {
  SignalReport report;
  report.sensor = signal.sensor;
  report.readings = signal.recent.size();
  report.rate_hz = rateOf(signal.recent);
  for (const Sample& sample : signal.recent) {
    if (!sample.status.empty()) ++report.marks[sample.status];
  }
  if (!signal.recent.empty()) report.newest = signal.recent.back();
  if (signal.rests_from_s) addStand(signal, report);
  return report;
}

}  // namespace fieldtrue::acquisition
