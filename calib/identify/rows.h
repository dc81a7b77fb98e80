#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/effects/effect_fit.h"
#include "calib/identify/thresholds.h"

namespace fieldtrue::identify {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// One row of a table as the diagnosis reads it.
struct GapRow {
  int node = 0;
  int visit = 0;
  std::size_t sensor = 0;  ///< Index into GapRows::sensors.
  std::size_t place = 0;   ///< Rows of one place share it; every hold-out removes whole places.
  Pose reference_from_sensor;
  Pose tracker_from_sensor;
  std::optional<std::array<int, 3>> index;
  double time_s = 0.0;
  Eigen::Matrix3d mean_covariance_m2 = Eigen::Matrix3d::Zero();  ///< Of the mean of the samples; 0 = not stated.
  double mean_rotation_variance_rad2 = 0.0;                      ///< Per axis; 0 = not stated.
};

/// A table as the diagnosis reads it, with what is known of its noise.
struct GapRows {
  std::vector<GapRow> rows;
  std::vector<int> place_nodes;    ///< Node number of each place.
  std::vector<int> sensors = {0};  ///< Number of each sensor, each in a mounting of its own.
  /// Whether the physics of a transmitter of dipoles may be claimed; else only what the rig does has a name.
  bool has_dipoles = true;
  bool has_orientation = true;
  bool has_times = false;
  bool several_orientations = false;
  int n_orientations = 1;
  bool alignment_known = false;
  Pose stated_tracker_from_reference;  ///< Where the alignment is known.
  double alignment_tolerance_m = 0.0;
  double alignment_tolerance_rad = 0.0;
  /// SD of placing per axis; unset where nothing is stated, then the residuals tell.
  std::optional<double> placing_sd_m;
  std::optional<double> placing_sd_rad;
  field::Excitation excitation;

  int channels() const { return has_orientation ? 6 : 3; }  ///< Residuals a row.
};

/// The most that may be placing, SD per axis: what scatters more is none, whatever it is, and stays above the floor.
double worstPlacing_m(const GapRows& rows, const Thresholds& thresholds);
double worstPlacing_rad(const GapRows& rows, const Thresholds& thresholds);

/// @param nodes rows that count, cleaned
/// @error kTooFewNodes below Thresholds::fewest_places
Result<GapRows> makeGapRows(std::span<const Node> nodes, const TableMetadata& metadata,
                            const Thresholds& thresholds = {});

/// Noise covariance of one row: samples, placing and quantum; position [m^2] before rotation [rad^2].
Matrix6d noiseOf(const GapRow& row, double placing_sd_m, double placing_sd_rad);

/// The sensors whose tracked positions fit a mirror image of the true ones far better than any turn of them.
std::vector<int> mirroredSensors(const GapRows& rows, const Thresholds& thresholds = {});

/// Eight blocks of places by the octant of their box they lie in, along the tracker's axes, those of fewer than
/// `fewest` places joined with the smallest other; for each row its block.
std::vector<int> octantBlocks(const GapRows& rows, std::size_t fewest = 3);
/// Blocks of rows that follow each other in time, whole places kept together by their first visit.
std::vector<int> timeBlocks(const GapRows& rows, int count = 8);

}  // namespace fieldtrue::identify
