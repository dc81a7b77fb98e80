#include "calib/correctors/gaussian_process/gaussian_process_tuning.h"

#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "calib/core/spacing.h"
#include "calib/core/statistics.h"
#include "calib/correctors/gaussian_process/gaussian_process_likelihood.h"

namespace fieldtrue::correctors {
namespace {

using Parameters = RestrictedLikelihood::Parameters;

constexpr std::size_t kPlacesOfStarts = 200;
constexpr int kIterationsOfStarts = 25;
constexpr int kIterations = 40;

/// Where the parameters are expected, and how far from there they are let [log m]: weak beside a hundred places, it
/// matters only along directions that the data leave open, such as a length far beyond the region. And walls, which
/// weigh as much as the data: a grid cannot tell a field of shorter length than its spacing from layers that have
/// nothing to do with each other, and the likelihood then prefers the layers; and a harmonic field's curvatures add up
/// to zero, so that no axis can have a length all of its own.
struct WeakPrior {
  static constexpr double kRatioSd = 0.5;  ///< Of a length to their geometric mean.
  static constexpr double kLengthSd = 1.5;
  static constexpr double kSignalSd = 2.0;
  static constexpr double kNuggetSd = 3.0;
  static constexpr double kMostRatio = 0.6;      ///< log 1.8
  static constexpr double kLeastSpacings = 0.4;  ///< log 1.5
  static constexpr double kWallSd = 0.05;
  double length = 0.0;
  double signal = 0.0;
  double nugget = 0.0;
  double spacing = 0.0;

  WeakPrior(const RestrictedLikelihood& likelihood, double spread_m, double spacing_m)
      : length(std::log(2.0 * spread_m)),
        signal(0.5 * std::log(likelihood.residualVariance_m2())),
        nugget(signal + std::log(0.1)),
        spacing(std::log(spacing_m)) {}

  /// Minus twice its logarithm. @param gradient added to, unless null
  double add(const Parameters& point, double n_places, double* gradient) const {
    const double mean = (point[0] + point[1] + point[2]) / 3.0;
    std::array<double, 3> of_lengths{};
    double of_mean = 0.0, value = 0.0;
    const auto square = [&value](double off, double sd, double& slope) {
      value += off * off / (sd * sd);
      slope += 2.0 * off / (sd * sd);
    };
    square(mean - length, kLengthSd, of_mean);
    const double wall_sd = kWallSd / std::sqrt(n_places);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double ratio = point[axis] - mean;
      double of_ratio = 0.0;
      square(ratio, kRatioSd, of_ratio);
      if (ratio > kMostRatio) square(ratio - kMostRatio, wall_sd, of_ratio);
      if (ratio < -kMostRatio) square(ratio + kMostRatio, wall_sd, of_ratio);
      of_lengths[axis] += of_ratio;
      of_mean -= of_ratio;
      const double above = point[axis] - spacing - kLeastSpacings;
      if (above < 0.0) square(above, wall_sd, of_lengths[axis]);
    }
    double of_signal = 0.0, of_nugget = 0.0;
    square(point[3] - signal, kSignalSd, of_signal);
    square(point[4] - nugget, kNuggetSd, of_nugget);
    if (gradient == nullptr) return value;
    for (std::size_t axis = 0; axis < 3; ++axis) gradient[axis] += of_lengths[axis] + of_mean / 3.0;
    gradient[3] += of_signal;
    gradient[4] += of_nugget;
    return value;
  }
};

/// -2 log of the restricted likelihood and prior, per place so that tolerances mean the same for any number of them.
class Objective : public ceres::FirstOrderFunction {
 public:
  /// @param is_isotropic the first parameter is the length along every axis, and the next two count for nothing
  Objective(const RestrictedLikelihood& likelihood, const WeakPrior& prior, bool is_isotropic,
            const RunControl& control)
      : likelihood_(likelihood), prior_(prior), is_isotropic_(is_isotropic), control_(control) {}

  bool Evaluate(const double* parameters, double* cost, double* gradient) const override {
    constexpr double kFarthest = 40.0;
    Parameters point{};
    std::copy_n(parameters, point.size(), point.begin());
    if (is_isotropic_) point[1] = point[2] = point[0];
    if (control_.stop.stop_requested()) return false;
    for (const double value : point)
      if (!(std::abs(value) < kFarthest)) return false;
    const auto value = likelihood_.evaluate(point, gradient);
    if (!value) return false;
    const auto n_places = static_cast<double>(likelihood_.size());
    *cost = (*value + prior_.add(point, n_places, gradient)) / n_places;
    if (gradient == nullptr) return true;
    for (std::size_t k = 0; k < point.size(); ++k) gradient[k] /= n_places;
    if (is_isotropic_) {
      gradient[0] += gradient[1] + gradient[2];
      gradient[1] = gradient[2] = 0.0;
    }
    return true;
  }
  int NumParameters() const override { return static_cast<int>(RestrictedLikelihood::kParameters); }

 private:
  const RestrictedLikelihood& likelihood_;
  const WeakPrior& prior_;
  bool is_isotropic_;
  const RunControl& control_;
};

struct Optimum {
  Parameters parameters{};
  double cost = HUGE_VAL;
};

std::optional<Optimum> minimise(const RestrictedLikelihood& likelihood, const WeakPrior& prior, const Parameters& start,
                                bool is_isotropic, const RunControl& control) {
  const ceres::GradientProblem problem(new Objective(likelihood, prior, is_isotropic, control));
  ceres::GradientProblemSolver::Options options;
  options.max_num_iterations = is_isotropic ? kIterationsOfStarts : kIterations;
  options.function_tolerance = 1e-6;
  options.gradient_tolerance = 1e-6;
  options.logging_type = ceres::SILENT;
  ceres::GradientProblemSolver::Summary summary;
  Optimum optimum{start, HUGE_VAL};
  ceres::Solve(options, problem, optimum.parameters.data(), &summary);
  optimum.cost = summary.final_cost;
  // A line search that ends without progress has still come somewhere; one that never began has not.
  const bool is_there = summary.initial_cost > -HUGE_VAL && std::isfinite(summary.final_cost) &&
                        (summary.IsSolutionUsable() || !summary.iterations.empty());
  return is_there && !control.stop.stop_requested() ? std::optional(optimum) : std::nullopt;
}

/// The first start is the usual case, the next two have shorter and longer lengths, and the others are drawn.
Parameters startOf(const WeakPrior& prior, int start, std::mt19937_64& generator) {
  const auto uniform = [&generator] { return 2.0 * static_cast<double>(generator() >> 11U) * 0x1p-53 - 1.0; };
  constexpr std::array<double, 3> kFirst = {0.5, 0.15, 1.5};
  const double ratio =
      start < static_cast<int>(kFirst.size()) ? kFirst[static_cast<std::size_t>(start)] : std::exp(2.0 * uniform());
  Parameters point{};
  std::fill_n(point.begin(), 3, prior.length + std::log(ratio));
  point[3] = prior.signal + std::max(0.0, std::log(2.0 * ratio));
  point[4] = prior.nugget + (start < static_cast<int>(kFirst.size()) ? 0.0 : 2.0 * uniform());
  return point;
}

std::optional<RestrictedLikelihood> likelihoodOf(RadialKernel kernel, const FieldFrame& frame,
                                                 std::span<const Eigen::Vector3d> p_m, const Eigen::MatrixXd& y,
                                                 const Eigen::VectorXd& noise_m2, std::size_t most) {
  const std::vector<std::size_t> used = spreadPlaces(p_m, most);
  std::vector<Eigen::Vector3d> used_m;
  Eigen::MatrixXd used_y(static_cast<Eigen::Index>(used.size()), 3);
  Eigen::VectorXd used_m2(used_y.rows());
  for (std::size_t i = 0; i < used.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    used_m.push_back(p_m[used[i]]);
    used_y.row(row) = y.row(static_cast<Eigen::Index>(used[i]));
    used_m2[row] = noise_m2[static_cast<Eigen::Index>(used[i])];
  }
  return RestrictedLikelihood::of(kernel, frame, std::move(used_m), std::move(used_y), std::move(used_m2));
}

}  // namespace

std::optional<GaussianProcessScales> fitScales(RadialKernel kernel, const FieldFrame& frame,
                                               std::span<const Eigen::Vector3d> p_m, const Eigen::MatrixXd& y,
                                               const Eigen::VectorXd& noise_m2, int restarts,
                                               const RunControl& control) {
  const auto few = likelihoodOf(kernel, frame, p_m, y, noise_m2, kPlacesOfStarts);
  const auto full = likelihoodOf(kernel, frame, p_m, y, noise_m2, p_m.size());
  if (!few || !full) return std::nullopt;
  const double spread_m = rmsSpread_m(p_m);
  const WeakPrior prior(*full, spread_m, std::max(medianSpacing_m(p_m), 1e-6));
  std::mt19937_64 generator(1);
  Optimum best;
  for (int start = 0; start < restarts; ++start) {
    const auto optimum = minimise(*few, prior, startOf(prior, start, generator), true, control);
    if (optimum && optimum->cost < best.cost) best = *optimum;
  }
  if (!std::isfinite(best.cost)) return std::nullopt;
  best.parameters[1] = best.parameters[2] = best.parameters[0];
  const auto optimum = minimise(*full, prior, best.parameters, false, control);
  if (control.stop.stop_requested()) return std::nullopt;
  return scalesOf(optimum ? optimum->parameters : best.parameters);
}

}  // namespace fieldtrue::correctors
