#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/recording/sample_visits.h"

namespace fieldtrue::recording {

/// One part with a jump in it may not pass for a line in all: its powers are cut here. exp(-12) of noise is.
inline constexpr double kHighestPower = 12.0;
/// Frequencies half the parts' resolution apart.
inline constexpr int kPerResolution = 2;
/// Below 2 periods a part cannot tell a line from drift, nor are there neighbours below it.
inline constexpr int kFirstBin = 4;
/// Of the neighbours of a frequency on either side, the farthest bin.
inline constexpr int kFarthest = 9;

/// A stop's readings, or a part of a long stop's: channels of unit variance, one reading a row.
struct Part {
  Eigen::VectorXd times_s;  ///< From the part's first reading.
  Eigen::MatrixXd values;
};

/// Stops, and parts of those longer than 128 readings, mean and slope taken off; of more than 1500 stops an even
/// choice.
std::vector<Part> partsOf(const std::vector<SampleVisit>& visits, double rate_hz);

std::size_t medianLength(const std::vector<Part>& parts);
const Part& ofMedianLength(const std::vector<Part>& parts);

/// How many independent channels the correlated ones of all parts are worth: tr(C)^2 / tr(C^2).
double independentSeries(const std::vector<Part>& parts);

/// Correlation of successive readings over all parts, without the bias that fitting mean and slope brings.
/// @source Marriott and Pope 1954, Biometrika 41 390
double pooledCorrelation(const std::vector<Part>& parts);

/// Differences x_k - rho x_(k-1): white where the noise is autoregressive of first order.
std::vector<Part> prewhitened(const std::vector<Part>& parts, double rho);

/// The parts without a sinusoid of a frequency.
std::vector<Part> withoutSinusoid(std::vector<Part> parts, double frequency_hz);

/// Mean power of all parts and channels, 1 for white noise, each cut at kHighestPower.
std::vector<double> pooledPower(const std::vector<Part>& parts, const std::vector<double>& frequencies_hz);

}  // namespace fieldtrue::recording
