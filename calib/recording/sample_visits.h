#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calib/core/calibration_table.h"

namespace fieldtrue::recording {

/// The good readings of one stop of the jig, in the order they were taken.
struct SampleVisit {
  int node = 0;
  int visit = 0;
  int sensor = 0;
  std::vector<double> times_s;
  Eigen::Vector3d mean_m = Eigen::Vector3d::Zero();
  /// One reading a row: position from the mean [m], rotation vector from the mean rotation [rad], tracker frame.
  Eigen::MatrixXd deviations;
};

/// Readings by stop. Those between places, marked by the tracker, not finite, or more than 8 robust SDs off the
/// stop's median position are left out; stops of fewer than `fewest` readings too.
std::vector<SampleVisit> sampleVisits(const SampleTable& samples, std::size_t fewest = 8);

/// Readings a second: the median step between readings, or what the table states where times do not tell.
std::optional<double> sampleRate_hz(const std::vector<SampleVisit>& visits, const TableMetadata& metadata);

}  // namespace fieldtrue::recording
