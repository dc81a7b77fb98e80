#include "calib/recording/relaxation_noise.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>

namespace fieldtrue::recording {

namespace {

constexpr double kShortestMemory = 0.5;  ///< In readings; one of less is white.
constexpr double kLongestMemory = 2.0;   ///< In lengths of the series; one of more is a random walk.
constexpr double kSmallestPower = 1e-9;
/// Enough that more change no fitted power by 1 %.
constexpr int kSteps = 300;

/// Covariances of the noises whose sum is fitted, of variance 1 but for the walk's.
std::vector<Eigen::MatrixXd> covariances(const Eigen::VectorXd& times, double correlation) {
  const Eigen::Index n = times.size();
  const Eigen::ArrayXXd apart = (times.replicate(1, n) - times.transpose().replicate(n, 1)).array().abs();
  std::vector<Eigen::MatrixXd> all = {Eigen::MatrixXd::Identity(n, n)};
  for (double memory = kShortestMemory; memory <= kLongestMemory * times[n - 1]; memory *= 2.0)
    all.emplace_back((-apart / memory).exp());
  // A walk's levels are taken off with the mean: half the distance, with the sign turned, stands for its covariance.
  all.emplace_back(-0.5 * apart);
  // What prewhitening makes flat, also where successive readings shy away from one another.
  Eigen::MatrixXd flattened(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) flattened(i, j) = std::pow(correlation, std::round(apart(i, j)));
  all.push_back(std::move(flattened));
  return all;
}

}  // namespace

Eigen::MatrixXd detrended(const Eigen::VectorXd& times_s, const Eigen::MatrixXd& values) {
  Eigen::MatrixXd basis(values.rows(), 2);
  basis.col(0).setOnes();
  basis.col(1) = times_s.array() - times_s.mean();
  const Eigen::MatrixXd normal = basis.transpose() * basis;
  return values - basis * normal.ldlt().solve(basis.transpose() * values);
}

Eigen::MatrixXd relaxationPowers(const Eigen::VectorXd& times, double correlation,
                                 const std::vector<double>& frequencies) {
  const Eigen::Index n = times.size();
  const auto n_frequencies = static_cast<Eigen::Index>(frequencies.size());
  const Eigen::MatrixXd level = detrended(times, Eigen::MatrixXd::Identity(n, n));
  const Eigen::MatrixXd treated =
      detrended(times.tail(n - 1), level.bottomRows(n - 1) - correlation * level.topRows(n - 1));
  const Eigen::RowVectorXd turns_rad =
      2.0 * std::numbers::pi * Eigen::Map<const Eigen::RowVectorXd>(frequencies.data(), n_frequencies);
  const Eigen::ArrayXXd angles_rad = times.tail(n - 1) * turns_rad;
  const Eigen::MatrixXd cosines = treated.transpose() * angles_rad.cos().matrix();
  const Eigen::MatrixXd sines = treated.transpose() * angles_rad.sin().matrix();
  const std::vector<Eigen::MatrixXd> noises = covariances(times, correlation);
  Eigen::MatrixXd powers(n_frequencies, static_cast<Eigen::Index>(noises.size()));
  for (Eigen::Index k = 0; k < powers.cols(); ++k) {
    const Eigen::MatrixXd& noise = noises[static_cast<std::size_t>(k)];
    powers.col(k) = (cosines.cwiseProduct(noise * cosines) + sines.cwiseProduct(noise * sines)).colwise().sum();
    powers.col(k) = powers.col(k).cwiseMax(0.0).eval() / powers.col(k).mean();
  }
  return powers;
}

Eigen::VectorXd likeliestSum(const Eigen::MatrixXd& shapes, const Eigen::VectorXd& measured) {
  Eigen::VectorXd weights =
      Eigen::VectorXd::Constant(shapes.cols(), measured.mean() / static_cast<double>(shapes.cols()));
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::ArrayXd fitted = (shapes * weights).array().max(kSmallestPower);
    const Eigen::ArrayXd wanted = shapes.transpose() * (measured.array() / fitted.square()).matrix();
    const Eigen::ArrayXd had = shapes.transpose() * fitted.inverse().matrix();
    weights.array() *= wanted / had.max(kSmallestPower);
  }
  return weights;
}

}  // namespace fieldtrue::recording
