#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "calib/core/run_control.h"

namespace fieldtrue::correctors {

/// The first five parameters of every Gaussian process: logarithms of three lengths, the signal's SD and the nugget's
/// SD [log m].
inline constexpr std::size_t kFieldParameters = 5;

/// Where the parameters are expected, and how far from there they are let [log m]: weak beside a hundred places, it
/// matters only along directions that the data leave open, such as a length far beyond the region. And walls, which
/// weigh as much as the data: a grid cannot tell a field of shorter length than its spacing from layers that have
/// nothing to do with each other, and the likelihood then prefers the layers; and a harmonic field's curvatures add up
/// to zero, so that no axis can have a length all of its own.
struct WeakPrior {
  double length = 0.0;
  double signal = 0.0;
  double nugget = 0.0;
  double spacing = 0.0;

  /// @param residual_variance_m2 mean square of an output about its linear trend
  WeakPrior(double residual_variance_m2, double spread_m, double spacing_m);

  /// Minus twice its logarithm. @param point, gradient the first five parameters; gradient added to, unless null
  double add(const double* point, double n_places, double* gradient) const;
};

/// Minus twice a log-likelihood at a point, and its slope unless `gradient` is null; none where there is none.
using LogLikelihood = std::function<std::optional<double>(const double* point, double* gradient)>;

struct Optimum {
  std::vector<double> parameters;
  double cost = 0.0;
};

/// Maximises a likelihood from a start by L-BFGS. The cost should be per place, so that tolerances mean the same for
/// any number of them.
/// @return none when it leads nowhere, or on a request to stop
std::optional<Optimum> minimise(const LogLikelihood& cost, std::span<const double> start, int iterations,
                                const RunControl& control);

}  // namespace fieldtrue::correctors
