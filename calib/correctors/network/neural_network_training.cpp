#include "calib/correctors/network/neural_network_training.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <optional>
#include <random>

#include "calib/correctors/numerics/dense_solver.h"

namespace fieldtrue::correctors {
namespace {

double squaredError(const FeedForwardNetwork& network, const TrainingSet& set) {
  double sum = 0.0;
  for (std::size_t i = 0; i < set.input.size(); ++i)
    sum += (network.output(set.input[i]) - set.target[i]).squaredNorm();
  return std::isfinite(sum) ? sum : HUGE_VAL;
}

/// A network's errors to first order in its weights.
struct Linearised {
  Eigen::MatrixXd jacobians;  ///< J^T: three columns a pair, one row a weight.
  Eigen::MatrixXd normal;     ///< J^T J, lower triangle.
  Eigen::VectorXd gradient;   ///< J^T e.
  double error_squared = 0.0;
};

Linearised linearise(const FeedForwardNetwork& network, const TrainingSet& set) {
  Linearised linear;
  const auto n_pairs = static_cast<Eigen::Index>(set.input.size());
  linear.jacobians.resize(network.weights().size(), 3 * n_pairs);
  Eigen::VectorXd errors(3 * n_pairs);
  FeedForwardNetwork::WeightJacobian jacobian;
  for (Eigen::Index i = 0; i < n_pairs; ++i) {
    const auto pair = static_cast<std::size_t>(i);
    errors.segment<3>(3 * i) = network.outputWithWeightJacobian(set.input[pair], jacobian) - set.target[pair];
    linear.jacobians.middleCols<3>(3 * i) = jacobian.transpose();
  }
  linear.normal = timesOwnTranspose(linear.jacobians);
  linear.gradient = linear.jacobians * errors;
  linear.error_squared = errors.squaredNorm();
  return linear;
}

/// Cholesky's factor of J^T J with the penalty. Weights that do nothing leave it singular where there is none: the
/// least that helps is added.
bool factorise(Eigen::MatrixXd& normal, double penalty) {
  normal.diagonal().array() += penalty;
  const Eigen::MatrixXd given = normal;
  double added = 1e-14 * given.diagonal().mean();
  for (int attempt = 0; attempt < 8; ++attempt, added *= 100.0) {
    if (choleskyInPlace(normal)) return true;
    normal = given;
    normal.diagonal().array() += added;
  }
  return false;
}

/// Squared errors of the outputs and the penalty of the weights, as their normal equations: Ceres is handed the
/// Cholesky factor of J^T J in place of J, so cost, gradient and J^T J are the same, while a row a weight stands for
/// three a pair, and OpenBLAS sums the products.
class SetCost : public ceres::CostFunction {
 public:
  SetCost(const FeedForwardNetwork& layers, const TrainingSet& set, double weight_penalty)
      : layers_(layers), set_(set), penalty_(weight_penalty * static_cast<double>(set.input.size())) {
    const auto n_weights = static_cast<int>(layers.weights().size());
    set_num_residuals(n_weights + 1);
    mutable_parameter_block_sizes()->push_back(n_weights);
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    FeedForwardNetwork network = layers_;
    const Eigen::Index n_weights = network.weights().size();
    network.setWeights(Eigen::Map<const Eigen::VectorXd>(parameters[0], n_weights));
    Eigen::Map<Eigen::VectorXd> r(residuals, n_weights + 1);
    if (jacobians == nullptr || jacobians[0] == nullptr) {
      r.setZero();
      r[n_weights] = std::sqrt(squaredError(network, set_) + penalty_ * network.weights().squaredNorm());
      return r.allFinite();
    }
    Linearised linear = linearise(network, set_);
    linear.error_squared += penalty_ * network.weights().squaredNorm();
    linear.gradient += penalty_ * network.weights();
    if (!std::isfinite(linear.error_squared) || !factorise(linear.normal, penalty_)) return false;
    // r = L^-1 g, and what no change of the weights takes away.
    Eigen::VectorXd reachable = linear.gradient;
    choleskyForward(linear.normal, reachable);
    r.head(n_weights) = reachable;
    r[n_weights] = std::sqrt(std::max(0.0, linear.error_squared - reachable.squaredNorm()));
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> jacobian(
        jacobians[0], n_weights + 1, n_weights);
    jacobian.setZero();
    jacobian.topRows(n_weights) = linear.normal.triangularView<Eigen::Lower>().transpose();
    return r.allFinite();
  }

 private:
  const FeedForwardNetwork& layers_;
  const TrainingSet& set_;
  double penalty_;
};

/// Counts iterations over all starts, and ends a start on request.
class Watch : public ceres::IterationCallback {
 public:
  Watch(const RunControl& control, std::atomic<int>& n_done, int n_planned)
      : control_(control), n_done_(n_done), n_planned_(n_planned) {}

  bool isStopped() const { return control_.stop.stop_requested(); }

  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    const int n_done = ++n_done_;
    control_.progress(std::min(1.0, static_cast<double>(n_done) / n_planned_));
    return isStopped() ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }

 private:
  const RunControl& control_;
  std::atomic<int>& n_done_;
  int n_planned_;
};

/// Where one start ends.
struct Ending {
  FeedForwardNetwork network;
  double held_out = HUGE_VAL;  ///< Mean square of the error at each pair without it, to first order.
};

double heldOutError(const FeedForwardNetwork& network, const TrainingSet& set, double weight_penalty) {
  const std::size_t n_pairs = set.input.size();
  Linearised linear = linearise(network, set);
  if (!factorise(linear.normal, weight_penalty * static_cast<double>(n_pairs))) return HUGE_VAL;
  Eigen::MatrixXd solved = linear.jacobians;
  choleskySolve(linear.normal, solved);
  double sum = 0.0;
  for (std::size_t i = 0; i < n_pairs; ++i) {
    const Eigen::Index first = 3 * static_cast<Eigen::Index>(i);
    const Eigen::Matrix3d hat = linear.jacobians.middleCols<3>(first).transpose() * solved.middleCols<3>(first);
    const Eigen::Vector3d error = network.output(set.input[i]) - set.target[i];
    sum += (Eigen::Matrix3d::Identity() - hat).partialPivLu().solve(error).squaredNorm();
  }
  return std::isfinite(sum) ? sum / static_cast<double>(n_pairs) : HUGE_VAL;
}

/// When a start has gone far enough.
struct TrainingEnd {
  int max_iterations = 1;
  double least_fall = 1e-6;  ///< Of the cost in one iteration, as a share of it.
};

/// Nothing where the solver failed.
std::optional<FeedForwardNetwork> trainFrom(const FeedForwardNetwork& start, const TrainingSet& set,
                                            double weight_penalty, const TrainingEnd& end, Watch& watch) {
  FeedForwardNetwork::Weights weights = start.weights();
  ceres::Problem problem;
  problem.AddResidualBlock(new SetCost(start, set, weight_penalty), nullptr, weights.data());
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  solver.max_num_iterations = end.max_iterations;
  solver.function_tolerance = end.least_fall;
  solver.num_threads = 1;
  solver.logging_type = ceres::SILENT;
  solver.callbacks.push_back(&watch);
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  if (!summary.IsSolutionUsable()) return std::nullopt;
  FeedForwardNetwork network = start;
  network.setWeights(weights);
  return network;
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
/// Parts that are left out one after the other to choose the penalty.
constexpr std::size_t kParts = 4;
/// Where penalties are compared: what a start gains below it, it gains with each of them.
constexpr double kLeastFallOfParts = 2e-4;

int furtherIterations(const LevenbergMarquardtOptions& options) {
  return std::max(1, options.max_iterations / kFurtherShare);
}

/// The start of that number.
FeedForwardNetwork startOf(const FeedForwardNetwork& network, const LevenbergMarquardtOptions& options,
                           std::size_t number) {
  FeedForwardNetwork start = network;
  start.setRandomWeights(1000003 * options.seed + number);
  return start;
}

/// The pairs of one part, in a shuffled order, and all others.
struct Split {
  TrainingSet kept;
  TrainingSet left_out;
};

Split splitOf(const TrainingSet& set, std::size_t part, std::uint64_t seed) {
  std::vector<std::size_t> order(set.input.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::mt19937_64 generator(seed);
  shuffle(order, generator);
  Split split;
  for (std::size_t i = 0; i < order.size(); ++i) {
    TrainingSet& side = i % kParts == part ? split.left_out : split.kept;
    side.input.push_back(set.input[order[i]]);
    side.target.push_back(set.target[order[i]]);
  }
  return split;
}

/// Squared errors of the left-out part, a penalty each: one start goes from the first penalty to the last.
std::vector<double> leftOutErrors(const FeedForwardNetwork& network, const Split& split,
                                  const LevenbergMarquardtOptions& options, std::size_t part, Watch& watch) {
  FeedForwardNetwork start = startOf(network, options, part);
  std::vector<double> errors;
  for (const double penalty : options.weight_penalties) {
    if (watch.isStopped()) break;
    const int iterations = errors.empty() ? options.max_iterations : furtherIterations(options);
    const auto end = trainFrom(start, split.kept, penalty, {iterations, kLeastFallOfParts}, watch);
    if (end) start = *end;
    errors.push_back(end ? squaredError(*end, split.left_out) : HUGE_VAL);
  }
  return errors;
}

/// The penalty whose networks foretell the parts left out best; none when no network, an output of zero, does better.
std::optional<double> penaltyByParts(const FeedForwardNetwork& network, const TrainingSet& set,
                                     const LevenbergMarquardtOptions& options, const RunControl& control,
                                     Watch& watch) {
  std::vector<std::vector<double>> errors(kParts);
  control.parallel_for(kParts, [&](std::size_t part) {
    errors[part] = leftOutErrors(network, splitOf(set, part, options.seed), options, part, watch);
  });
  if (watch.isStopped()) return std::nullopt;
  double least = squaredError(FeedForwardNetwork(network.firstHidden(), network.secondHidden()), set);
  std::optional<double> best;
  for (std::size_t k = 0; k < options.weight_penalties.size(); ++k) {
    double sum = 0.0;
    for (const std::vector<double>& of_part : errors) sum += of_part[k];
    if (sum >= least) continue;
    least = sum;
    best = options.weight_penalties[k];
  }
  return best;
}

}  // namespace

Result<FeedForwardNetwork> trainByLevenbergMarquardt(const FeedForwardNetwork& network, const TrainingSet& set,
                                                     const LevenbergMarquardtOptions& options,
                                                     const RunControl& control) {
  FT_CHECK(set.input.size() == set.target.size() && !set.input.empty() && options.n_starts > 0 &&
           !options.weight_penalties.empty());
  const auto n_starts = static_cast<std::size_t>(options.n_starts);
  const auto n_further = static_cast<int>(options.weight_penalties.size()) - 1;
  const int n_by_parts = static_cast<int>(kParts) * (options.max_iterations + n_further * furtherIterations(options));
  std::atomic<int> n_done = 0;
  Watch watch(control, n_done, options.n_starts * options.max_iterations + (n_further > 0 ? n_by_parts : 0));
  std::optional<double> penalty = options.weight_penalties.front();
  if (n_further > 0) penalty = penaltyByParts(network, set, options, control, watch);
  if (control.stop.stop_requested()) return stopped();
  if (!penalty) return FeedForwardNetwork(network.firstHidden(), network.secondHidden());
  std::vector<Ending> endings(n_starts);
  control.parallel_for(n_starts, [&](std::size_t k) {
    const auto end = trainFrom(startOf(network, options, k), set, *penalty, {options.max_iterations}, watch);
    if (end) endings[k] = {*end, heldOutError(*end, set, *penalty)};
  });
  if (control.stop.stop_requested()) return stopped();
  const auto best = std::min_element(endings.begin(), endings.end(),
                                     [](const Ending& a, const Ending& b) { return a.held_out < b.held_out; });
  if (!std::isfinite(best->held_out))
    return fail(ErrorCode::kDegenerate, "The training of the network failed from each of its " +
                                            std::to_string(options.n_starts) + " starts; try another seed");
  return best->network;
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
