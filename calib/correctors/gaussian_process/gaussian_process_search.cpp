#include "calib/correctors/gaussian_process/gaussian_process_search.h"

#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace fieldtrue::correctors {
namespace {

constexpr double kRatioSd = 0.5;  ///< Of a length to their geometric mean.
constexpr double kLengthSd = 1.5;
constexpr double kSignalSd = 2.0;
constexpr double kNuggetSd = 3.0;
constexpr double kMostRatio = 0.6;      ///< log 1.8
constexpr double kLeastSpacings = 0.4;  ///< log 1.5
constexpr double kWallSd = 0.05;

class Objective : public ceres::FirstOrderFunction {
 public:
  Objective(const LogLikelihood& cost, std::size_t n_parameters, const RunControl& control)
      : cost_(cost), n_parameters_(n_parameters), control_(control) {}

  bool Evaluate(const double* parameters, double* cost, double* gradient) const override {
    constexpr double kFarthest = 40.0;
    if (control_.stop.stop_requested()) return false;
    const bool is_near =
        std::all_of(parameters, parameters + n_parameters_, [](double value) { return std::abs(value) < kFarthest; });
    if (!is_near) return false;
    const auto value = cost_(parameters, gradient);
    if (value) *cost = *value;
    return value.has_value();
  }
  int NumParameters() const override { return static_cast<int>(n_parameters_); }

 private:
  const LogLikelihood& cost_;
  std::size_t n_parameters_;
  const RunControl& control_;
};

}  // namespace

WeakPrior::WeakPrior(double residual_variance_m2, double spread_m, double spacing_m)
    : length(std::log(2.0 * spread_m)),
      signal(0.5 * std::log(residual_variance_m2)),
      nugget(signal + std::log(0.1)),
      spacing(std::log(spacing_m)) {}

double WeakPrior::add(const double* point, double n_places, double* gradient) const {
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

std::optional<Optimum> minimise(const LogLikelihood& cost, std::span<const double> start, int iterations,
                                const RunControl& control) {
  const ceres::GradientProblem problem(new Objective(cost, start.size(), control));
  ceres::GradientProblemSolver::Options options;
  options.max_num_iterations = iterations;
  options.function_tolerance = 1e-6;
  options.gradient_tolerance = 1e-6;
  options.logging_type = ceres::SILENT;
  ceres::GradientProblemSolver::Summary summary;
  Optimum optimum{{start.begin(), start.end()}, HUGE_VAL};
  ceres::Solve(options, problem, optimum.parameters.data(), &summary);
  optimum.cost = summary.final_cost;
  // A line search that ends without progress has still come somewhere; one that never began has not.
  const bool is_there = summary.initial_cost > -HUGE_VAL && std::isfinite(summary.final_cost) &&
                        (summary.IsSolutionUsable() || !summary.iterations.empty());
  return is_there && !control.stop.stop_requested() ? std::optional(optimum) : std::nullopt;
}

}  // namespace fieldtrue::correctors
