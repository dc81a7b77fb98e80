#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/recording/sample_spectrum.h"

namespace fieldtrue::recording {

/// How many independent readings those of one stand are worth, by the variance of their mean: down to one, where the
/// noise is as slow as the stand is long.
///
/// The variance is the sum of the autocovariances up to where they vanish, of the readings and, where noise that lasts
/// longer hides in faster noise, of means of more and more of them.
/// @param values a reading a row at equal steps of time, a channel of the same unit a column; at least one row
/// @return 1 to the number of rows
/// @source Geyer 1992, initial monotone sequence; Anderson 1971 for the mean that is taken out
double independentReadings(const Eigen::MatrixXd& values);

/// Those of a spectrum's lines that one whole stand bears out, each with the frequency at which it stands out most: a
/// line goes on in step through a stand, and slow noise, which a part of the stand takes for one, does not.
/// @param times_s of the readings
/// @param values a reading a row, a channel a column
/// @param within_hz how far off the frequencies may be
/// @source Schuster 1898 for the periodogram; Rife and Boorstyn 1974 for the frequency's error
std::vector<SpectralLine> linesOfStand(const std::vector<double>& times_s, const Eigen::MatrixXd& values,
                                       const std::vector<SpectralLine>& lines, double within_hz);

}  // namespace fieldtrue::recording
