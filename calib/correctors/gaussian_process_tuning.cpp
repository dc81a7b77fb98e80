#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "calib/correctors/gaussian_process_likelihood.h"

namespace fieldtrue {
namespace {

using Parameters = RestrictedLikelihood::Parameters;

constexpr std::size_t kPlacesOfStarts = 200;
constexpr int kIterationsOfStarts = 25;
constexpr int kIterations = 40;

/// Where the parameters are expected, and how far from there they are let [log m]. Weak beside a hundred places: it
/// matters only along directions that the data leave open, such as a length far beyond the region.
struct WeakPrior {
  Parameters center{};
  Parameters sd{};

  WeakPrior(const RestrictedLikelihood& likelihood, double spread_m) {
    const double residual_sd = std::sqrt(likelihood.residualVariance_m2());
    center.fill(std::log(2.0 * spread_m));
    sd.fill(1.5);
    center[3] = std::log(residual_sd);
    sd[3] = 2.0;
    center[4] = std::log(0.1 * residual_sd);
    sd[4] = 3.0;
  }
};

/// -2 log of the restricted likelihood and prior, per place so that tolerances mean the same for any number of them.
class Objective : public ceres::FirstOrderFunction {
 public:
  Objective(const RestrictedLikelihood& likelihood, const WeakPrior& prior, const RunControl& control)
      : likelihood_(likelihood), prior_(prior), control_(control) {}

  bool Evaluate(const double* parameters, double* cost, double* gradient) const override {
    constexpr double kFarthest = 40.0;
    Parameters point{};
    std::copy_n(parameters, point.size(), point.begin());
    if (control_.stop.stop_requested()) return false;
    for (const double value : point)
      if (!(std::abs(value) < kFarthest)) return false;
    const auto value = likelihood_.evaluate(point, gradient);
    if (!value) return false;
    const auto n = static_cast<double>(likelihood_.size());
    *cost = *value;
    for (std::size_t k = 0; k < point.size(); ++k) {
      const double off = (point[k] - prior_.center[k]) / prior_.sd[k];
      *cost += off * off;
      if (gradient != nullptr) gradient[k] = (gradient[k] + 2.0 * off / prior_.sd[k]) / n;
    }
    *cost /= n;
    return true;
  }
  int NumParameters() const override { return static_cast<int>(RestrictedLikelihood::kParameters); }

 private:
  const RestrictedLikelihood& likelihood_;
  const WeakPrior& prior_;
  const RunControl& control_;
};

struct Optimum {
  Parameters parameters{};
  double cost = HUGE_VAL;
};

std::optional<Optimum> minimise(const RestrictedLikelihood& likelihood, const WeakPrior& prior, const Parameters& start,
                                int iterations, const RunControl& control) {
  const ceres::GradientProblem problem(new Objective(likelihood, prior, control));
  ceres::GradientProblemSolver::Options options;
  options.max_num_iterations = iterations;
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

/// The first start is the usual case; the others are drawn around it.
Parameters startOf(const WeakPrior& prior, int start, std::mt19937_64& generator) {
  Parameters point = prior.center;
  for (std::size_t k = 0; k < 3; ++k) point[k] -= std::log(2.0);
  if (start == 0) return point;
  const auto uniform = [&generator] { return 2.0 * static_cast<double>(generator() >> 11U) * 0x1p-53 - 1.0; };
  const double shared = 1.2 * uniform();
  for (std::size_t k = 0; k < 3; ++k) point[k] += shared + 0.3 * uniform();
  point[3] += uniform();
  point[4] += 2.0 * uniform();
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
  const WeakPrior prior(*full, spread_m);
  std::mt19937_64 generator(1);
  Optimum best;
  for (int start = 0; start < restarts; ++start) {
    const auto optimum = minimise(*few, prior, startOf(prior, start, generator), kIterationsOfStarts, control);
    if (optimum && optimum->cost < best.cost) best = *optimum;
  }
  if (!std::isfinite(best.cost)) return std::nullopt;
  if (full->size() > few->size()) {
    if (const auto optimum = minimise(*full, prior, best.parameters, kIterations, control)) best = *optimum;
  }
  if (control.stop.stop_requested()) return std::nullopt;
  return scalesOf(best.parameters);
}

}  // namespace fieldtrue
