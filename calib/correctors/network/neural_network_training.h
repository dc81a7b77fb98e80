#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "calib/core/error.h"
#include "calib/core/run_control.h"
#include "calib/correctors/network/feed_forward_network.h"

namespace fieldtrue::correctors {

/// Pairs of inputs and wanted outputs, both scaled to about [-1, 1].
struct TrainingSet {
  std::vector<Eigen::Vector3d> input;
  std::vector<Eigen::Vector3d> target;
};

/// Least squares by Levenberg-Marquardt with a penalty of the weights. Of several penalties the one is taken whose
/// networks foretell best the pairs of four parts, each left out in turn, and no network (all weights zero) where an
/// output of zero foretells them as well. All pairs are then fitted from several random starts, and the end that
/// foretells single pairs best is kept: by the error at each pair without it, to first order e_i / (1 - H_ii), H the
/// hat matrix of the linearised fit.
/// @source of that error: Cook, Weisberg 1982, section 2.2.3, with Gauss and Newton's matrix
struct LevenbergMarquardtOptions {
  int n_starts = 4;
  int max_iterations = 150;
  /// Factors of the squared weights beside the squared errors of a pair, on average, the lightest first.
  std::vector<double> weight_penalties = {0.0};
  std::uint64_t seed = 1;
};

/// Starts run through control.parallel_for and do not depend on each other; each is Ceres on one thread.
/// @param network its layers; the weights it holds do not matter
/// @error kCancelled
Result<FeedForwardNetwork> trainByLevenbergMarquardt(const FeedForwardNetwork& network, const TrainingSet& set,
                                                     const LevenbergMarquardtOptions& options,
                                                     const RunControl& control);

/// Standard back-propagation: one pair at a time in shuffled order, down the gradient of half the squared error.
struct BackPropagationOptions {
  double learning_rate = 0.05;
  double momentum = 0.9;     ///< Share of the last change in the next one.
  double stop_error = 0.01;  ///< Mean length of the output error over an epoch, in units of the target.
  int max_epochs = 3000;
  std::uint64_t seed = 1;
};

/// What back-propagation came to.
struct BackPropagationResult {
  FeedForwardNetwork network;
  double mean_error = 0.0;  ///< Of the last epoch, in units of the target.
  int n_epochs = 0;
};

/// @error kCancelled; kDegenerate when the weights diverge
Result<BackPropagationResult> trainByBackPropagation(const FeedForwardNetwork& network, const TrainingSet& set,
                                                     const BackPropagationOptions& options, const RunControl& control);

}  // namespace fieldtrue::correctors
