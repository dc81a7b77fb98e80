#include "calib/recording/reading_lattice.h"

#include <algorithm>
#include <cmath>

#include "calib/core/quantum.h"
#include "calib/core/statistics.h"

namespace fieldtrue::recording {

namespace {

constexpr std::size_t kMostRows = 2000;
constexpr double kFinestStep_m = 1e-6;
constexpr double kMostReadingsARow = 3.0;
constexpr std::size_t kFewestLatticeRows = 20;

std::optional<double> latticeOf_m(std::span<const double> values_m) {
  if (const auto quantum_m = findQuantum_m(values_m)) return quantum_m;
  const double printed_m = values_m.empty() ? 0.0 : printedStep_m(values_m);
  return printed_m >= kFinestStep_m ? std::optional(printed_m) : std::nullopt;
}

void append(std::vector<double>& values_m, const Eigen::Vector3d& p_m) {
  values_m.insert(values_m.end(), p_m.data(), p_m.data() + 3);
}

}  // namespace

std::optional<ReadingLattice> readingLattice(const SampleTable& samples, const std::vector<SampleVisit>& visits) {
  std::vector<const SampleRow*> good;
  for (const SampleRow& row : samples.rows) {
    const Eigen::Vector3d& p_m = row.sample.tracker_from_sensor.position_m;
    if (row.node >= 0 && row.sample.status.empty() && p_m.allFinite()) good.push_back(&row);
  }
  std::vector<double> values_m;
  const std::size_t count = std::min(good.size(), kMostRows);
  for (std::size_t i = 0; i < count; ++i) {
    append(values_m, good[i * good.size() / count]->sample.tracker_from_sensor.position_m);
  }
  const std::optional<double> quantum_m = latticeOf_m(values_m);
  if (!quantum_m || visits.empty()) return std::nullopt;
  ReadingLattice lattice;
  lattice.quantum_m = *quantum_m;
  lattice.stops = visits.size();
  const double quantum_m2 = *quantum_m * *quantum_m / 12.0;
  std::vector<double> shares;
  for (const SampleVisit& visit : visits) {
    const auto n = static_cast<double>(visit.deviations.rows());
    const double variance_m2 = visit.deviations.leftCols(3).squaredNorm() / (3.0 * (n - 1.0));
    shares.push_back(quantum_m2 / std::max(variance_m2, quantum_m2));
    // Noise and lattice together: below a quarter plus a twelfth of the square the noise is under half a step.
    if (variance_m2 < 4.0 * quantum_m2) lattice.biased.push_back(visit.node);
  }
  lattice.share = median(std::move(shares));
  return lattice;
}

std::optional<double> latticeOfRows_m(std::span<const Node> nodes) {
  std::vector<double> values_m, readings;
  for (const Node& node : nodes) {
    append(values_m, node.tracker_from_sensor.position_m);
    readings.push_back(node.n_used);
  }
  if (nodes.size() < kFewestLatticeRows || median(std::move(readings)) > kMostReadingsARow) return std::nullopt;
  return latticeOf_m(values_m);
}

}  // namespace fieldtrue::recording
