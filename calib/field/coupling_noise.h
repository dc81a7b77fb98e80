#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <random>

namespace fieldtrue::field {

/// Standard normal numbers that are the same on every platform: the generator is fixed by the C++ standard, the
/// transform (Box and Muller 1958) is ours, for std::normal_distribution is left to each library.
class GaussianStream {
 public:
  /// @param purpose, index tell streams of one seed apart
  GaussianStream(std::uint64_t seed, std::uint32_t purpose, std::uint32_t index = 0);
  double next();
  Eigen::Vector3d nextVector();

 private:
  double uniform();
  std::mt19937_64 generator_;
  std::optional<double> spare_;
};

/// How a receiver's noise is spread over its nine couplings and over time.
struct CouplingNoiseModel {
  double sd = 0.0;           ///< Of each coupling in each reading, whatever the correlation.
  double correlation = 0.0;  ///< Between successive readings, [0, 1).
  double rate_hz = 120.0;    ///< Of successive readings.
};

/// Stationary noise of one receiver: independent between couplings, first-order autoregressive in time,
/// n' = rho^k n + sqrt(1 - rho^2k) sd w after k reading periods.
class CouplingNoise {
 public:
  CouplingNoise(const CouplingNoiseModel& model, std::uint64_t seed, std::uint32_t purpose, std::uint32_t sensor);
  /// The next reading's noise. Two readings are at least one period apart, whatever the clock says.
  Eigen::Matrix3d at(double time_s);
  /// The next reading is independent of all before.
  void forget() { last_time_s_.reset(); }

 private:
  CouplingNoiseModel model_;
  GaussianStream stream_;
  Eigen::Matrix3d noise_ = Eigen::Matrix3d::Zero();
  std::optional<double> last_time_s_;
};

}  // namespace fieldtrue::field
