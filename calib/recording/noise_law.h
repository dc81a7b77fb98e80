#pragma once

#include <optional>
#include <span>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/recording/sample_visits.h"

namespace fieldtrue::recording {

/// An unweighted least-squares tracker with equal noise in its nine couplings: SD of position as range^4, of rotation
/// as range^3, across the line of sight sqrt(30) times that along it.
inline constexpr double kPositionNoisePower = 4.0;
inline constexpr double kRotationNoisePower = 3.0;
inline constexpr double kTransverseToRadial = 5.477225575051661;

/// Noise of a single reading at one row, by the direction from the transmitter.
struct NoiseRow {
  double range_m = 0.0;
  double radial_sd_m = 0.0;
  double transverse_sd_m = 0.0;           ///< Per axis, RMS of both.
  std::optional<double> rotation_sd_rad;  ///< RMS rotation angle.
};

/// @param correlation of successive readings: a stop's scatter shows less than their whole noise
/// @param quantum_m of the readings; rows whose noise it hides are left out, of the others its share is taken off
std::vector<NoiseRow> noiseRows(const std::vector<SampleVisit>& visits, double correlation, double quantum_m);
/// From the covariances that a table states, of rows of at least 5 readings.
std::vector<NoiseRow> noiseRows(std::span<const Node> nodes, double quantum_m);

/// A number and the SD of its error.
struct Uncertain {
  double value = 0.0;
  double sd = 0.0;
};

/// How the noise of a reading grows with range: SD = a r^b.
struct NoiseLaw {
  std::size_t rows = 0;
  double nearest_m = 0.0;
  double farthest_m = 0.0;
  Uncertain position_power;
  std::optional<Uncertain> rotation_power;
  Uncertain log_transverse_to_radial;
  Uncertain log_coupling_noise;  ///< Natural logarithm of the coupling SD over the dipole constant [1/m^3].
};

/// Robust lines through logarithms, their errors by resampling the rows.
/// @return nothing below 12 rows or where the ranges are too much alike to tell a power
/// @source radial SD sigma r^4/(3 sqrt(6) C), transverse sqrt(5)/3 sigma r^4/C: the covariance
/// (J^T J)^-1 of the nine couplings of Raab et al. 1979
std::optional<NoiseLaw> fitNoiseLaw(const std::vector<NoiseRow>& rows);

}  // namespace fieldtrue::recording
