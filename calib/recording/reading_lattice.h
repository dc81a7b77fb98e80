#pragma once

#include <optional>
#include <span>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/recording/sample_visits.h"

namespace fieldtrue::recording {

/// The lattice that reported positions lie on, and what it does to them.
struct ReadingLattice {
  double quantum_m = 0.0;
  double share = 0.0;       ///< Of the variance of one reading, median over the stops.
  std::vector<int> biased;  ///< Nodes whose noise is below half a quantum: their means are off the lattice's way.
  std::size_t stops = 0;
};

/// @return nothing where the positions lie on no lattice of 1 um or more
std::optional<ReadingLattice> readingLattice(const SampleTable& samples, const std::vector<SampleVisit>& visits);

/// The lattice of rows of single readings, for means of many lie on none: nothing when a row holds more than 3 readings
/// in the median.
std::optional<double> latticeOfRows_m(std::span<const Node> nodes);

}  // namespace fieldtrue::recording
