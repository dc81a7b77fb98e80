#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/recording/spectrum_parts.h"

namespace fieldtrue::recording {

/// What the noise shows at a frequency by all others: the readings' autoregression, which knows a filter's lobe or a
/// hand's sway, and at the low end, where few neighbours are below or none, the likeliest slow noise.
class NoiseElsewhere {
 public:
  /// @param white the parts, prewhitened by rho; must outlive this
  /// @param series independent ones
  NoiseElsewhere(const std::vector<Part>& parts, const std::vector<Part>& white, double rate_hz, double step_hz,
                 double series, double rho);

  /// Expected power, 1 for white noise.
  double powerAt(double frequency_hz) const;

 private:
  double slow(const Eigen::VectorXd& power, double at) const;
  double autoregressive(Eigen::VectorXd power, double at) const;

  const std::vector<Part>& white_;
  double n_values_;
  std::vector<double> grid_hz_;
  Eigen::MatrixXd shapes_;  ///< Of the lowest bins of the grid.
};

}  // namespace fieldtrue::recording
