#pragma once

#include <Eigen/Core>
#include <vector>

namespace fieldtrue::recording {

/// Takes mean and slope out of every column.
Eigen::MatrixXd detrended(const Eigen::VectorXd& times_s, const Eigen::MatrixXd& values);

/// Power that short series of slow noises show, one a column, at frequencies, one a row: white noise, relaxations of
/// one memory each (autoregressions of first order, memories an octave apart) and a random walk. Sums of them are noise
/// that falls by any power of the frequency from 0 to 2, with white noise beside it or without.
///
/// What a short series shows is not the noise's density: mean and slope are taken off it, and the strong low end leaks
/// up. Here it is computed as the readings' own power is, from the covariance, and so without error.
/// @param times in readings from the first, increasing
/// @param correlation of first order by which series are prewhitened: detrended, x_k - correlation x_(k-1), detrended
/// @param frequencies in cycles per reading, 0 to 0.5
/// @return each column of mean 1
/// @source van der Ziel 1950, Physica 16: 1/f noise as a sum of relaxations
Eigen::MatrixXd relaxationPowers(const Eigen::VectorXd& times, double correlation,
                                 const std::vector<double>& frequencies);

/// The likeliest sum of such powers, none negative, for powers measured.
/// @param shapes not negative, a frequency a row
/// @param measured positive, as many as rows
/// @return weights, as many as columns
/// @source Whittle 1953 for the likelihood; Fevotte, Bertin and Durrieu 2009 for the multiplicative steps
Eigen::VectorXd likeliestSum(const Eigen::MatrixXd& shapes, const Eigen::VectorXd& measured);

}  // namespace fieldtrue::recording
