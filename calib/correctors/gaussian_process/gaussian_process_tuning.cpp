#include "calib/correctors/gaussian_process/gaussian_process_tuning.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "calib/core/statistics.h"
#include "calib/correctors/gaussian_process/gaussian_process_likelihood.h"
#include "calib/correctors/gaussian_process/gaussian_process_search.h"
#include "calib/geometry/spacing.h"

namespace fieldtrue::correctors {
namespace {

using Parameters = RestrictedLikelihood::Parameters;

constexpr std::size_t kPlacesOfStarts = 200;
constexpr int kIterationsOfStarts = 25;
constexpr int kIterations = 40;

std::optional<Optimum> mostLikely(const RestrictedLikelihood& likelihood, const WeakPrior& prior,
                                  std::span<const double> start, bool is_isotropic, const RunControl& control) {
  const auto n_places = static_cast<double>(likelihood.size());
  const LogLikelihood cost = [&](const double* parameters, double* gradient) -> std::optional<double> {
    Parameters point{};
    std::copy_n(parameters, point.size(), point.begin());
    // Then the first parameter is the length along every axis, and the next two count for nothing.
    if (is_isotropic) point[1] = point[2] = point[0];
    const auto value = likelihood.evaluate(point, gradient);
    if (!value) return std::nullopt;
    const double sum = (*value + prior.add(point.data(), n_places, gradient)) / n_places;
    if (gradient == nullptr) return sum;
    for (std::size_t k = 0; k < point.size(); ++k) gradient[k] /= n_places;
    if (is_isotropic) {
      gradient[0] += gradient[1] + gradient[2];
      gradient[1] = gradient[2] = 0.0;
    }
    return sum;
  };
  return minimise(cost, start, is_isotropic ? kIterationsOfStarts : kIterations, control);
}

/// The first start is the usual case, the next two have shorter and longer lengths, and the others are drawn.
Parameters startOf(const WeakPrior& prior, int start, std::mt19937_64& generator) {
  const auto uniform = [&generator] { return 2.0 * static_cast<double>(generator() >> 11U) * 0x1p-53 - 1.0; };
  constexpr std::array<double, 3> kFirst = {0.5, 0.15, 1.5};
  const double ratio =
      start < static_cast<int>(kFirst.size()) ? kFirst[static_cast<std::size_t>(start)] : std::exp(2.0 * uniform());
  Parameters point{};
  std::fill_n(point.begin(), 3, prior.length + std::log(ratio));
  point[3] = prior.signal + std::max(0.0, std::log(2.0 * ratio));
  point[4] = prior.nugget + (start < static_cast<int>(kFirst.size()) ? 0.0 : 2.0 * uniform());
  return point;
}

std::optional<RestrictedLikelihood> likelihoodOf(RadialKernel kernel, const FieldFrame& frame,
                                                 std::span<const Eigen::Vector3d> p_m, const Eigen::MatrixXd& y,
                                                 const Eigen::VectorXd& noise_m2, std::size_t most) {
  const std::vector<std::size_t> used = spreadPlaces(p_m, most);
  std::vector<Eigen::Vector3d> used_m;
  Eigen::MatrixXd used_y(static_cast<Eigen::Index>(used.size()), 3);
  Eigen::VectorXd used_m2(used_y.rows());
  for (std::size_t i = 0; i < used.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    used_m.push_back(p_m[used[i]]);
    used_y.row(row) = y.row(static_cast<Eigen::Index>(used[i]));
    used_m2[row] = noise_m2[static_cast<Eigen::Index>(used[i])];
  }
  return RestrictedLikelihood::of(kernel, frame, std::move(used_m), std::move(used_y), std::move(used_m2));
}

}  // namespace

std::optional<GaussianProcessScales> fitScales(RadialKernel kernel, const FieldFrame& frame,
                                               std::span<const Eigen::Vector3d> p_m, const Eigen::MatrixXd& y,
                                               const Eigen::VectorXd& noise_m2, int restarts,
                                               const RunControl& control) {
  const auto few = likelihoodOf(kernel, frame, p_m, y, noise_m2, kPlacesOfStarts);
  const auto full = likelihoodOf(kernel, frame, p_m, y, noise_m2, p_m.size());
  if (!few || !full) return std::nullopt;
  const double spread_m = rmsSpread_m(p_m);
  const WeakPrior prior(full->residualVariance_m2(), spread_m, std::max(medianSpacing_m(p_m), 1e-6));
  std::mt19937_64 generator(1);
  Optimum best{{}, HUGE_VAL};
  for (int start = 0; start < restarts; ++start) {
    const auto optimum = mostLikely(*few, prior, startOf(prior, start, generator), true, control);
    if (optimum && optimum->cost < best.cost) best = *optimum;
  }
  if (!std::isfinite(best.cost)) return std::nullopt;
  best.parameters[1] = best.parameters[2] = best.parameters[0];
  const auto optimum = mostLikely(*full, prior, best.parameters, false, control);
  if (control.stop.stop_requested()) return std::nullopt;
  return scalesOf(optimum ? optimum->parameters : best.parameters);
}

}  // namespace fieldtrue::correctors
