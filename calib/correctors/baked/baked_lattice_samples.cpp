#include "calib/correctors/baked/baked_lattice_samples.h"

#include <algorithm>
#include <cmath>

namespace fieldtrue::correctors {
namespace {

/// Samples beside the outermost coefficient that the filter reads.
constexpr int kFilterReach = 2;
/// Layers of samples that are continued beyond what the correction covers: the reach of a cell and of the filter.
constexpr int kContinuedLayers = 6;

using Sample = Eigen::Vector4d;  // A displacement and an uncertainty [m].

/// Samples of a correction at the points of a lattice, the last index fastest.
struct Samples {
  std::array<int, 3> counts = {0, 0, 0};
  std::vector<Sample> values;
  std::vector<char> known;

  std::size_t at(int i, int j, int k) const {
    return (static_cast<std::size_t>(i) * static_cast<std::size_t>(counts[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(counts[2]) +
           static_cast<std::size_t>(k);
  }
  bool holds(int i, int j, int k) const {
    return i >= 0 && j >= 0 && k >= 0 && i < counts[0] && j < counts[1] && k < counts[2];
  }
};

Result<Samples> takeSamples(const PositionModel& model, const Eigen::Vector3d& first_m, double spacing_m,
                            const std::array<int, 3>& counts, bool with_uncertainty, const RunControl& control) {
  Samples samples;
  samples.counts = counts;
  const std::size_t size =
      static_cast<std::size_t>(counts[0]) * static_cast<std::size_t>(counts[1]) * static_cast<std::size_t>(counts[2]);
  samples.values.assign(size, Sample::Zero());
  samples.known.assign(size, 0);
  const auto plane = [&](std::size_t i) {
    if (control.stop.stop_requested()) return;
    for (int j = 0; j < counts[1]; ++j)
      for (int k = 0; k < counts[2]; ++k) {
        const Eigen::Vector3d p_m = first_m + spacing_m * Eigen::Vector3d(static_cast<double>(i), j, k);
        if (!model.covers(p_m)) continue;
        const std::size_t at = samples.at(static_cast<int>(i), j, k);
        samples.known[at] = 1;
        samples.values[at].head<3>() = model.displacement_m(p_m);
        if (with_uncertainty) samples.values[at][3] = model.uncertainty_m(p_m).value_or(0.0);
      }
  };
  control.parallel_for(static_cast<std::size_t>(counts[0]), plane);
  if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "Stopped on request");
  return samples;
}

/// Where a sample is not known, the mean of the straight lines through known neighbours in 26 directions (of the
/// neighbours themselves, where nothing is known behind them); none where no neighbour is known.
bool continueSample(const Samples& samples, int i, int j, int k, Sample* value) {
  Sample lines = Sample::Zero(), steps = Sample::Zero();
  int n_lines = 0, n_steps = 0;
  for (int direction = 0; direction < 27; ++direction) {
    const int di = direction % 3 - 1, dj = direction / 3 % 3 - 1, dk = direction / 9 - 1;
    if (!samples.holds(i + di, j + dj, k + dk)) continue;
    const std::size_t near = samples.at(i + di, j + dj, k + dk);
    if (!samples.known[near]) continue;
    steps += samples.values[near];
    ++n_steps;
    if (!samples.holds(i + 2 * di, j + 2 * dj, k + 2 * dk)) continue;
    const std::size_t far = samples.at(i + 2 * di, j + 2 * dj, k + 2 * dk);
    if (!samples.known[far]) continue;
    lines += 2.0 * samples.values[near] - samples.values[far];
    ++n_lines;
  }
  if (n_steps == 0) return false;
  *value = n_lines > 0 ? Sample(lines / n_lines) : Sample(steps / n_steps);
  return true;
}

void continueSamples(Samples& samples) {
  if (std::all_of(samples.known.begin(), samples.known.end(), [](char known) { return known != 0; })) return;
  for (int layer = 0; layer < kContinuedLayers; ++layer) {
    std::vector<std::pair<std::size_t, Sample>> added;
    for (int i = 0; i < samples.counts[0]; ++i)
      for (int j = 0; j < samples.counts[1]; ++j)
        for (int k = 0; k < samples.counts[2]; ++k) {
          Sample value;
          if (!samples.known[samples.at(i, j, k)] && continueSample(samples, i, j, k, &value))
            added.emplace_back(samples.at(i, j, k), value);
        }
    for (const auto& [at, value] : added) {
      samples.values[at] = value;
      samples.known[at] = 1;
    }
  }
}

/// The five-point filter along one axis; the result is shorter by the filter's reach at both ends.
Samples filtered(const Samples& samples, std::size_t axis) {
  Samples result;
  result.counts = samples.counts;
  result.counts[axis] -= 2 * kFilterReach;
  result.values.resize(static_cast<std::size_t>(result.counts[0]) * static_cast<std::size_t>(result.counts[1]) *
                       static_cast<std::size_t>(result.counts[2]));
  std::array<int, 3> first = {0, 0, 0};
  first[axis] = kFilterReach;
  std::array<int, 3> one = {0, 0, 0};
  one[axis] = 1;
  const std::size_t step = samples.at(one[0], one[1], one[2]);
  for (int i = 0; i < result.counts[0]; ++i)
    for (int j = 0; j < result.counts[1]; ++j)
      for (int k = 0; k < result.counts[2]; ++k) {
        const Sample* f = &samples.values[samples.at(i + first[0], j + first[1], k + first[2])];
        // c = f - d2/6 + d4/36, d2 and d4 the second and fourth differences: (1, -10, 54, -10, 1)/36.
        result.values[result.at(i, j, k)] =
            (54.0 * f[0] - 10.0 * (*(f - step) + f[step]) + *(f - 2 * step) + f[2 * step]) / 36.0;
      }
  return result;
}

/// Cells next to a covered sample: one more all around than those that have one as a corner, so that no corner of the
/// covered volume is lost.
std::vector<bool> coveredCells(const Samples& samples, const LatticeParts& parts) {
  std::vector<bool> covered;
  const std::array<int, 3> cells = {latticeCells(parts, 0), latticeCells(parts, 1), latticeCells(parts, 2)};
  for (int i = 0; i < cells[0]; ++i)
    for (int j = 0; j < cells[1]; ++j)
      for (int k = 0; k < cells[2]; ++k) {
        bool is_near = false;
        // Cell (i, j, k) lies between samples kFilterReach + 1 and kFilterReach + 2 further on.
        for (int a = kFilterReach; a < kFilterReach + 4; ++a)
          for (int b = kFilterReach; b < kFilterReach + 4; ++b)
            for (int c = kFilterReach; c < kFilterReach + 4; ++c)
              is_near = is_near || samples.known[samples.at(i + a, j + b, k + c)] != 0;
        covered.push_back(is_near);
      }
  return covered;
}

}  // namespace

std::array<int, 3> latticeCellsFor(const LatticeBox& box, double spacing_m) {
  std::array<int, 3> cells;
  for (int axis = 0; axis < 3; ++axis) {
    const double wanted = std::ceil((box.high_m[axis] - box.low_m[axis]) / spacing_m - 1e-9);
    cells[static_cast<std::size_t>(axis)] = static_cast<int>(std::clamp(wanted, 1.0, 1e6));
  }
  return cells;
}

double latticeCoefficientsFor(const LatticeBox& box, double spacing_m) {
  const std::array<int, 3> cells = latticeCellsFor(box, spacing_m);
  return (cells[0] + 3.0) * (cells[1] + 3.0) * (cells[2] + 3.0);
}

Result<LatticeParts> sampleLattice(const PositionModel& model, const LatticeBox& box, double spacing_m,
                                   bool with_uncertainty, const RunControl& control) {
  const std::array<int, 3> cells = latticeCellsFor(box, spacing_m);
  LatticeParts parts;
  parts.spacing_m = spacing_m;
  parts.has_uncertainty = with_uncertainty;
  const Eigen::Vector3d size_m = spacing_m * Eigen::Vector3d(cells[0], cells[1], cells[2]);
  parts.origin_m = 0.5 * (box.low_m + box.high_m - size_m) - Eigen::Vector3d::Constant(spacing_m);
  std::array<int, 3> sample_counts;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    parts.counts[axis] = cells[axis] + 3;
    sample_counts[axis] = parts.counts[axis] + 2 * kFilterReach;
  }
  const Eigen::Vector3d first_m = parts.origin_m - Eigen::Vector3d::Constant(kFilterReach * spacing_m);
  auto samples = takeSamples(model, first_m, spacing_m, sample_counts, with_uncertainty, control);
  if (!samples) return tl::unexpected(samples.error());
  if (!std::all_of(samples->known.begin(), samples->known.end(), [](char known) { return known != 0; }))
    parts.covered = coveredCells(*samples, parts);
  continueSamples(*samples);
  Samples filtered_samples = *std::move(samples);
  for (std::size_t axis = 0; axis < 3; ++axis) filtered_samples = filtered(filtered_samples, axis);
  for (const Sample& coefficient : filtered_samples.values)
    for (int i = 0; i < 4; ++i) parts.coefficients.push_back(static_cast<float>(coefficient[i]));
  return parts;
}

}  // namespace fieldtrue::correctors
