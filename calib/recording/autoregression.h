#pragma once

#include <span>
#include <vector>

namespace fieldtrue::recording {

/// Noise that follows its own past: x_k = a_1 x_(k-1) + a_2 x_(k-2) + ... + e_k.
struct Autoregression {
  std::vector<double> coefficients;
  double variance = 1.0;  ///< Of e.

  /// Spectral density relative to white noise of variance 1.
  /// @param frequency in cycles per reading, 0 to 0.5
  double powerAt(double frequency) const;
};

/// The autoregression of given autocovariances, of the order that is likeliest for its number of coefficients.
/// @param autocovariances at lags 0, 1, ... up to the highest order tried; the first is not 0
/// @param n_values how many independent values they are the means of
/// @source Durbin 1960 for the recursion; Schwarz 1978 for the order
Autoregression fittedAutoregression(std::span<const double> autocovariances, double n_values);

}  // namespace fieldtrue::recording
