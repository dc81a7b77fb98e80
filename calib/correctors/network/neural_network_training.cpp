#include "calib/correctors/network/neural_network_training.h"

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <random>

namespace fieldtrue::correctors {
namespace {

/// Errors of the outputs, three a pair. One block for all pairs: a block each costs a network each and more than half
/// of the time.
class SetCost : public ceres::CostFunction {
 public:
  SetCost(const FeedForwardNetwork& layers, const TrainingSet& set) : layers_(layers), set_(set) {
    set_num_residuals(3 * static_cast<int>(set.input.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(layers.weights().size()));
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    FeedForwardNetwork network = layers_;
    const Eigen::Index n_weights = network.weights().size();
    network.setWeights(Eigen::Map<const Eigen::VectorXd>(parameters[0], n_weights));
    FeedForwardNetwork::WeightJacobian jacobian;
    bool is_finite = true;
    for (std::size_t i = 0; i < set_.input.size(); ++i) {
      Eigen::Map<Eigen::Vector3d> error(residuals + 3 * i);
      if (jacobians == nullptr || jacobians[0] == nullptr) {
        error = network.output(set_.input[i]) - set_.target[i];
      } else {
        error = network.outputWithWeightJacobian(set_.input[i], jacobian) - set_.target[i];
        Eigen::Map<FeedForwardNetwork::WeightJacobian>(jacobians[0] + 3 * static_cast<Eigen::Index>(i) * n_weights, 3,
                                                       n_weights) = jacobian;
      }
      is_finite = is_finite && error.allFinite();
    }
    return is_finite;
  }

 private:
  const FeedForwardNetwork& layers_;
  const TrainingSet& set_;
};

/// Counts iterations over all starts, and ends a start on request.
class Watch : public ceres::IterationCallback {
 public:
  Watch(const RunControl& control, std::atomic<int>& n_done, int n_planned)
      : control_(control), n_done_(n_done), n_planned_(n_planned) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    const int n_done = ++n_done_;
    control_.progress(std::min(1.0, static_cast<double>(n_done) / n_planned_));
    return control_.stop.stop_requested() ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }

 private:
  const RunControl& control_;
  std::atomic<int>& n_done_;
  int n_planned_;
};

/// Where one start ends with one penalty.
struct Ending {
  FeedForwardNetwork::Weights weights;
  double held_out = HUGE_VAL;  ///< Mean square of the error at each pair without it, to first order.
};

double heldOutError(const FeedForwardNetwork& network, const TrainingSet& set, double weight_penalty) {
  const std::size_t n_pairs = set.input.size();
  const Eigen::Index n_weights = network.weights().size();
  std::vector<FeedForwardNetwork::WeightJacobian> jacobians(n_pairs);
  std::vector<Eigen::Vector3d> errors(n_pairs);
  Eigen::MatrixXd normal =
      weight_penalty * static_cast<double>(n_pairs) * Eigen::MatrixXd::Identity(n_weights, n_weights);
  for (std::size_t i = 0; i < n_pairs; ++i) {
    errors[i] = network.outputWithWeightJacobian(set.input[i], jacobians[i]) - set.target[i];
    normal.noalias() += jacobians[i].transpose() * jacobians[i];
  }
  const Eigen::LDLT<Eigen::MatrixXd> factor(normal);
  double sum = 0.0;
  for (std::size_t i = 0; i < n_pairs; ++i) {
    const Eigen::Matrix3d hat = jacobians[i] * factor.solve(jacobians[i].transpose());
    sum += (Eigen::Matrix3d::Identity() - hat).partialPivLu().solve(errors[i]).squaredNorm();
  }
  return std::isfinite(sum) ? sum / static_cast<double>(n_pairs) : HUGE_VAL;
}

Ending trainFrom(const FeedForwardNetwork& start, const TrainingSet& set, double weight_penalty, int max_iterations,
                 Watch& watch) {
  Ending ending{start.weights(), HUGE_VAL};
  ceres::Problem problem;
  problem.AddResidualBlock(new SetCost(start, set), nullptr, ending.weights.data());
  if (weight_penalty > 0.0) {
    const auto n_weights = ending.weights.size();
    const double factor = std::sqrt(weight_penalty * static_cast<double>(set.input.size()));
    problem.AddResidualBlock(
        new ceres::NormalPrior(factor * ceres::Matrix::Identity(n_weights, n_weights), ceres::Vector::Zero(n_weights)),
        nullptr, ending.weights.data());
  }
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  solver.max_num_iterations = max_iterations;
  solver.num_threads = 1;
  solver.logging_type = ceres::SILENT;
  solver.callbacks.push_back(&watch);
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  if (!summary.IsSolutionUsable()) return ending;
  FeedForwardNetwork network = start;
  network.setWeights(ending.weights);
  ending.held_out = heldOutError(network, set, weight_penalty);
  return ending;
}

tl::unexpected<Error> stopped() {
  return fail(ErrorCode::kCancelled, "The training of the network was stopped on request");
}

/// Fisher and Yates, the same order on every platform.
void shuffle(std::vector<std::size_t>& order, std::mt19937_64& generator) {
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[generator() % i]);
}

/// Of the iterations of a start's first penalty, what a further one has: it begins where the one before ended.
constexpr int kFurtherShare = 4;

}  // namespace

Result<FeedForwardNetwork> trainByLevenbergMarquardt(const FeedForwardNetwork& network, const TrainingSet& set,
                                                     const LevenbergMarquardtOptions& options,
                                                     const RunControl& control) {
  FT_CHECK(set.input.size() == set.target.size() && !set.input.empty() && options.n_starts > 0 &&
           !options.weight_penalties.empty());
  const std::size_t n_penalties = options.weight_penalties.size();
  const int further_iterations = std::max(1, options.max_iterations / kFurtherShare);
  const int n_planned =
      options.n_starts * (options.max_iterations + static_cast<int>(n_penalties - 1) * further_iterations);
  std::vector<Ending> endings(static_cast<std::size_t>(options.n_starts) * n_penalties);
  std::atomic<int> n_done = 0;
  control.parallel_for(static_cast<std::size_t>(options.n_starts), [&](std::size_t k) {
    FeedForwardNetwork start = network;
    start.setRandomWeights(1000003 * options.seed + k);
    Watch watch(control, n_done, n_planned);
    for (std::size_t penalty = 0; penalty < n_penalties && !control.stop.stop_requested(); ++penalty) {
      Ending& ending = endings[k * n_penalties + penalty];
      ending = trainFrom(start, set, options.weight_penalties[penalty],
                         penalty == 0 ? options.max_iterations : further_iterations, watch);
      if (std::isfinite(ending.held_out)) start.setWeights(ending.weights);
    }
  });
  if (control.stop.stop_requested()) return stopped();
  const auto best = std::min_element(endings.begin(), endings.end(),
                                     [](const Ending& a, const Ending& b) { return a.held_out < b.held_out; });
  if (!std::isfinite(best->held_out))
    return fail(ErrorCode::kDegenerate, "The training of the network failed from each of its " +
                                            std::to_string(options.n_starts) + " starts; try another seed");
  FeedForwardNetwork trained = network;
  trained.setWeights(best->weights);
  return trained;
}

Result<BackPropagationResult> trainByBackPropagation(const FeedForwardNetwork& network, const TrainingSet& set,
                                                     const BackPropagationOptions& options, const RunControl& control) {
  FT_CHECK(set.input.size() == set.target.size() && !set.input.empty());
  BackPropagationResult result{network, HUGE_VAL, 0};
  result.network.setRandomWeights(1000003 * options.seed);
  std::mt19937_64 generator(options.seed);
  std::vector<std::size_t> order(set.input.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  FeedForwardNetwork::Weights weights = result.network.weights();
  FeedForwardNetwork::Weights change = FeedForwardNetwork::Weights::Zero(weights.size());
  FeedForwardNetwork::WeightJacobian jacobian;
  while (result.n_epochs < options.max_epochs && result.mean_error >= options.stop_error) {
    if (control.stop.stop_requested()) return stopped();
    shuffle(order, generator);
    double sum = 0.0;
    for (const std::size_t i : order) {
      const Eigen::Vector3d error = result.network.outputWithWeightJacobian(set.input[i], jacobian) - set.target[i];
      change = options.momentum * change - options.learning_rate * jacobian.transpose() * error;
      weights += change;
      result.network.setWeights(weights);
      sum += error.norm();
    }
    ++result.n_epochs;
    result.mean_error = sum / static_cast<double>(order.size());
    if (!std::isfinite(result.mean_error) || !weights.allFinite())
      return fail(ErrorCode::kDegenerate, "Back-propagation diverged in epoch " + std::to_string(result.n_epochs) +
                                              "; a lower learning_rate or momentum is needed");
    control.progress(static_cast<double>(result.n_epochs) / options.max_epochs);
  }
  return result;
}

}  // namespace fieldtrue::correctors
