#include "calib/evaluation/orientation/orientation_neighbours.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "calib/evaluation/base/index_source.h"
#include "calib/evaluation/orientation/orientation_models.h"
#include "calib/evaluation/orientation/orientation_rows.h"
#include "calib/evaluation/region/region_lattice.h"
#include "calib/geometry/spacing.h"

namespace fieldtrue::evaluation {
namespace {

constexpr std::size_t kNeighbours = 6;
/// Turn that counts as far as one spacing between places [rad]; the first means that orientation does not count.
constexpr std::array<double, 5> kScales_rad = {HUGE_VAL, 1.6, 0.8, 0.4, 0.2};

/// What is left of the errors after a plane-wise trend over the places: neighbours then tell about the rest.
std::vector<Eigen::Vector3d> withoutTrend(const OrientationRows& rows) {
  const PointSpread spread = pointSpread(rows.p_tracked_m);
  const auto n = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd terms(n, 1 + rows.dimension);
  Eigen::Matrix<double, Eigen::Dynamic, 3> error(n, 3);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto row = static_cast<std::size_t>(i);
    const Eigen::Vector3d local_m = spread.axes.transpose() * (rows.p_tracked_m[row] - spread.center_m);
    terms(i, 0) = 1.0;
    terms.row(i).tail(rows.dimension) = local_m.head(rows.dimension).transpose() / std::max(spread.sd_m.x(), 1e-9);
    error.row(i) = rows.error[row].transpose();
  }
  error -= terms * terms.colPivHouseholderQr().solve(error);
  std::vector<Eigen::Vector3d> rest;
  for (Eigen::Index i = 0; i < n; ++i) rest.emplace_back(error.row(i).transpose());
  return rest;
}

/// Square of what the mean of the nearest rows of other places leaves of a row.
double leftSquare(const OrientationRows& rows, const std::vector<Eigen::Vector3d>& rest, std::size_t i,
                  double spacing_m, double scale_rad) {
  std::vector<std::pair<double, std::size_t>> nearest;
  for (std::size_t j = 0; j < rows.size(); ++j) {
    if (rows.place[j] == rows.place[i]) continue;
    const double apart = (rows.p_tracked_m[j] - rows.p_tracked_m[i]).squaredNorm() / (spacing_m * spacing_m);
    const double turned = angleBetween_rad(rows.q_true[j], rows.q_true[i]) / scale_rad;
    nearest.emplace_back(apart + turned * turned, j);
  }
  const std::size_t n = std::min(kNeighbours, nearest.size());
  std::partial_sort(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(n), nearest.end());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < n; ++k) mean += rest[nearest[k].second] / static_cast<double>(n);
  return (rest[i] - mean).squaredNorm();
}

}  // namespace

NestedErrors neighbourErrors(const OrientationRows& rows, std::uint64_t seed) {
  const std::vector<Eigen::Vector3d> rest = withoutTrend(rows);
  const double spacing_m = std::max(medianSpacing_m(rows.p_tracked_m), 1e-6);
  std::vector<std::array<double, kScales_rad.size()>> squares(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (std::size_t s = 0; s < kScales_rad.size(); ++s)
      squares[i][s] = leftSquare(rows, rest, i, spacing_m, kScales_rad[s]);

  IndexSource source(seed);
  std::vector<std::size_t> half_of_place(rows.n_places);
  for (std::size_t& half : half_of_place) half = source.below(2);
  std::array<std::array<double, kScales_rad.size()>, 2> total{};
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (std::size_t s = 0; s < kScales_rad.size(); ++s) total[half_of_place[rows.place[i]]][s] += squares[i][s];
  std::array<std::size_t, 2> chosen{};
  for (std::size_t half = 0; half < 2; ++half)
    chosen[half] = static_cast<std::size_t>(std::min_element(total[1 - half].begin(), total[1 - half].end()) -
                                            total[1 - half].begin());

  std::vector<double> small(rows.n_places, 0.0);
  std::vector<double> large(rows.n_places, 0.0);
  std::vector<double> n_rows(rows.n_places, 0.0);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    small[rows.place[i]] += squares[i][0];
    large[rows.place[i]] += squares[i][chosen[half_of_place[rows.place[i]]]];
    n_rows[rows.place[i]] += 1.0;
  }
  NestedErrors errors;
  for (std::size_t p = 0; p < rows.n_places; ++p) {
    errors.place_only.push_back(std::sqrt(small[p] / n_rows[p]));
    errors.with_orientation.push_back(std::sqrt(large[p] / n_rows[p]));
  }
  return errors;
}

}  // namespace fieldtrue::evaluation
