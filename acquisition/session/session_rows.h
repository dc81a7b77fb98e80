#pragma once

#include <QSqlQuery>
#include <QVariantList>

#include "calib/core/calibration_table.h"
#include "calib/core/statistics.h"

namespace fieldtrue::acquisition {

/// Columns of table `places` after the key, in the order of placeValues.
inline constexpr const char* kPlaceColumns =
    "node, visit, i, j, k, x_true_m, y_true_m, z_true_m, qw_true, qx_true, qy_true, qz_true, role";
QVariantList placeValues(const PlannedPlace& place);
PlannedPlace readPlace(const QSqlQuery& row, int first_column);

/// Columns of table `takes` after the key, in the order of takeValues.
inline constexpr const char* kTakeColumns =
    "sensor, x_m, y_m, z_m, qw, qx, qy, qz, cov_xx_m2, cov_yy_m2, cov_zz_m2, cov_xy_m2, cov_xz_m2, cov_yz_m2,"
    " sd_rot_rad, autocorrelation, n_effective, quantum_m, n_used, n_rejected, t_start_s, t_end_s";
/// @param samples not empty
QVariantList takeValues(const std::vector<Sample>& samples, const NodeStatistics& statistics);
/// Of a mean whose samples are not known. What a mean may lack is written so: no orientation as a quaternion of zeros,
/// no scatter as zeros, no times as an end before the start.
QVariantList takeValues(const Node& mean);
/// The take's part of a node row; identity, truth and role are left alone.
void readTake(const QSqlQuery& row, int first_column, Node& node);

/// Columns of table `samples` after the key (action, seq), in the order of sampleValues.
inline constexpr const char* kSampleColumns = "sensor, t_s, x_m, y_m, z_m, qw, qx, qy, qz, status";
QVariantList sampleValues(const Sample& sample);
Sample readSample(const QSqlQuery& row, int first_column);

}  // namespace fieldtrue::acquisition
