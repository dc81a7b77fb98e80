#include "calib/correctors/harmonic/harmonic_field_slips.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "calib/core/chi_square.h"
#include "calib/core/statistics.h"

namespace fieldtrue::correctors {
namespace {

constexpr double kFreedom = 4.0;

/// What a fit leaves at one place, and the noise that its rows were whitened by.
struct Left {
  Eigen::Vector3d left_m;
  Eigen::Matrix3d noise_m2;
  PlaceDerivative place;
  double square() const { return left_m.dot(noise_m2.inverse() * left_m); }
};

std::vector<Left> leftBy(const FitData& data, const HarmonicFit& fit) {
  std::vector<Left> all(data.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    Left& one = all[i];
    one.place = PlaceDerivative::of(fit.field, data.p_tracked_m[i]);
    one.left_m = fit.field_from_truth * data.p_true_m[i] - one.place.at_m;
    one.noise_m2 = fit.placing_sd_m * fit.placing_sd_m * Eigen::Matrix3d::Identity();
    if (!data.noise_m2.empty())
      one.noise_m2 += one.place.by_tracked * data.noise_m2[i] * one.place.by_tracked.transpose();
  }
  return all;
}

/// Variance, in units of that noise, that half of the places show; no less than what is stated.
double coreOf(const std::vector<Left>& all, bool is_stated) {
  constexpr double kLeast = 1e-16;
  std::vector<double> squares;
  for (const Left& one : all) squares.push_back(one.square());
  return std::max(is_stated ? 1.0 : kLeast, median(std::move(squares)) / kMedianOfChiSquare3);
}

/// Square of how far a place lies off what the others make of it, in units of the noise.
/// @param core of all places, see coreOf
double squareWithoutIt(const Left& one, const HarmonicFit& fit, double core) {
  constexpr double kMostLeverage = 0.98;
  const Eigen::Matrix3d noise_m2 = core * one.noise_m2;
  const Eigen::Matrix3d by_fit_m2 = core / fit.noise_factor * fit.posterior.covariance_m2(one.place);
  const Eigen::Matrix3d whitening = Eigen::Matrix3d(noise_m2.llt().matrixL()).inverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> leverage(whitening * by_fit_m2 * whitening.transpose());
  const Eigen::Vector3d along = leverage.eigenvectors().transpose() * (whitening * one.left_m);
  return (along.array().square() / (1.0 - leverage.eigenvalues().array().min(kMostLeverage))).sum();
}

/// Minus the log likelihood of squared distances of three numbers each under a Student t law of its likeliest scale,
/// but for what is the same of all such laws of one count.
double lawCost_nats(const std::vector<double>& squares, double freedom) {
  const auto n = static_cast<double>(squares.size());
  double scale2 = std::accumulate(squares.begin(), squares.end(), 1e-12) / (3.0 * n);
  for (int step = 0; step < 50; ++step) {
    double sum = 0.0;
    for (const double square : squares) sum += (freedom + 3.0) / (freedom + square / scale2) * square;
    scale2 = std::max(1e-12, sum / (3.0 * n));
  }
  const double constant = std::lgamma(0.5 * freedom) + 1.5 * std::log(freedom) - std::lgamma(0.5 * (freedom + 3.0));
  double cost = n * (1.5 * std::log(scale2) + constant);
  for (const double square : squares) cost += 0.5 * (freedom + 3.0) * std::log1p(square / (freedom * scale2));
  return cost;
}

}  // namespace

std::optional<FitData> easedOfSlips(const FitData& data, const HarmonicFit& fit) {
  constexpr double kFarOff = 30.0;  // Of a normal law one place in a million is farther.
  const std::vector<Left> all = leftBy(data, fit);
  const double core = coreOf(all, data.jig_sd_m > 0.0);
  std::vector<double> squares;
  for (const Left& one : all) squares.push_back(squareWithoutIt(one, fit, core));
  if (*std::max_element(squares.begin(), squares.end()) < kFarOff) return std::nullopt;
  FitData eased = data;
  eased.noise_m2.resize(data.size(), Eigen::Matrix3d::Zero());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double weight = std::min(1.0, (kFreedom + 3.0) / (kFreedom + squares[i]));
    const double more_m2 = (1.0 / weight - 1.0) * fit.placing_sd_m * fit.placing_sd_m;
    // Noise is stated of the tracked position.
    const Eigen::Matrix3d back = all[i].place.by_tracked.inverse();
    eased.noise_m2[i] += more_m2 * back * back.transpose();
  }
  return eased;
}

double robustCost_nats(const FitData& data, const HarmonicFit& fit) {
  std::vector<double> squares;
  for (const Left& one : leftBy(data, fit)) squares.push_back(one.square());
  double cost = std::numeric_limits<double>::infinity();
  for (const double freedom : {kFreedom, 8.0, 100.0}) cost = std::min(cost, lawCost_nats(squares, freedom));
  const auto unknowns = static_cast<double>(kPerChosen) * static_cast<double>(fit.field.sources().size());
  return cost + 0.5 * unknowns * std::log(3.0 * static_cast<double>(data.size()));
}

}  // namespace fieldtrue::correctors
