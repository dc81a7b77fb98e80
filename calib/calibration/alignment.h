#pragma once

#include <map>
#include <optional>
#include <span>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/correctors/base/fit_data.h"

namespace fieldtrue::calibration {

/// How tracker and rig frames are related: the nuisance part that is refitted everywhere unless the alignment is known.
/// reference_from_sensor = reference_from_tracker * tracker_from_sensor * sensor_from_mount.
struct Alignment {
  Pose reference_from_tracker;
  /// Constant rotation of the sensor in its holder; of the first sensor where there are several.
  Eigen::Quaterniond sensor_from_mount = Eigen::Quaterniond::Identity();
  std::map<int, Eigen::Quaterniond> mounts;  ///< Of each sensor, where there are several; else empty.

  /// Of a sensor; the first one's for a sensor that was not fitted or is not told.
  const Eigen::Quaterniond& mountOf(std::optional<int> sensor) const;
};

enum class AlignMode { kNone, kRigid };

/// `rigid` unless the table says the alignment is known.
AlignMode defaultAlignMode(const TableMetadata& metadata);

/// Fits the rigid part from positions, by least squares or, where rows stand apart, as alignmentWeights says, and the
/// constant mounting rotation of each sensor from orientations when present. Sensors held in several orientations tell
/// the mounting from a mean rotation error of the tracker, which is left to be corrected.
/// @param jig_tolerance_m SD per axis of placing, where it is stated: tells how far off a row of few must lie
/// @error kTooFewNodes, kDegenerate as fitRigid
Result<Alignment> fitAlignment(std::span<const Node> nodes, std::optional<double> jig_tolerance_m);

/// Rows of a table as fit data in the tracker frame: truth brought there by the inverse alignment. The grid index is
/// the table's, or found from the true positions where they stand on a grid along the rig's axes.
correctors::FitData makeFitData(std::span<const Node> nodes, const TableMetadata& metadata, const Alignment& alignment);

}  // namespace fieldtrue::calibration
