#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <set>
#include <vector>

#include "calib/correctors/base/fit_data.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/registry.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::testing {

using Displacement = std::function<Eigen::Vector3d(const Eigen::Vector3d&)>;
using Rotation = std::function<Eigen::Quaterniond(const Eigen::Vector3d&)>;

/// Error fields [m] and an error rotation of tests.
inline Eigen::Vector3d nothing_m(const Eigen::Vector3d&) { return Eigen::Vector3d::Zero(); }

inline Eigen::Vector3d linear_m(const Eigen::Vector3d& p) {
  return {0.01 + 0.03 * p.x() - 0.02 * p.z(), -0.02 + 0.01 * p.x() + 0.05 * p.y(), 0.04 * p.z() - 0.03 * p.y()};
}

inline Eigen::Vector3d wave_m(const Eigen::Vector3d& p) {
  return 0.03 *
         Eigen::Vector3d(std::sin(3.0 * p.x()), std::cos(2.0 * p.y() + p.z()), std::sin(p.x() * p.y() + 2.0 * p.z()));
}

inline Eigen::Quaterniond smoothError(const Eigen::Vector3d& p) {
  return rotationFromVector(0.15 * Eigen::Vector3d(std::sin(p.x()), p.y() * p.z(), std::cos(p.y())));
}

/// Matern's correlation with nu = 5/2 at a distance in units of the length.
inline double matern52(double r) {
  const double t = std::sqrt(5.0) * r;
  return (1.0 + t + t * t / 3.0) * std::exp(-t);
}

/// Tracked positions on a grid that is shaken a little, so that no two coordinates repeat [m].
inline std::vector<Eigen::Vector3d> shakenGrid(const std::array<int, 3>& counts, double pitch_m, double shake_m,
                                               std::uint64_t seed = 5) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> uniform(-shake_m, shake_m);
  std::vector<Eigen::Vector3d> points_m;
  for (int i = 0; i < counts[0]; ++i)
    for (int j = 0; j < counts[1]; ++j)
      for (int k = 0; k < counts[2]; ++k)
        points_m.emplace_back(0.4 + pitch_m * i + uniform(generator), -0.3 + pitch_m * j + uniform(generator),
                              -0.2 + pitch_m * k + uniform(generator));
  return points_m;
}

/// Grid index of places that fill a whole grid, shaken or not: a level ends at a gap of more than half the largest.
/// Empty for other places.
inline std::vector<std::array<int, 3>> wholeGridIndex(const std::vector<Eigen::Vector3d>& points_m) {
  std::vector<std::array<int, 3>> index(points_m.size());
  std::size_t n_nodes = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<double> sorted_m;
    for (const Eigen::Vector3d& p_m : points_m) sorted_m.push_back(p_m[static_cast<Eigen::Index>(axis)]);
    std::sort(sorted_m.begin(), sorted_m.end());
    double largest_m = 0.0;
    for (std::size_t i = 1; i < sorted_m.size(); ++i) largest_m = std::max(largest_m, sorted_m[i] - sorted_m[i - 1]);
    std::vector<double> starts_m;
    for (std::size_t i = 1; i < sorted_m.size(); ++i)
      if (sorted_m[i] - sorted_m[i - 1] > 0.5 * largest_m) starts_m.push_back(sorted_m[i]);
    for (std::size_t i = 0; i < points_m.size(); ++i)
      index[i][axis] = static_cast<int>(
          std::upper_bound(starts_m.begin(), starts_m.end(), points_m[i][static_cast<Eigen::Index>(axis)]) -
          starts_m.begin());
    n_nodes *= starts_m.size() + 1;
  }
  const std::set<std::array<int, 3>> distinct(index.begin(), index.end());
  if (distinct.size() != points_m.size() || n_nodes != points_m.size()) index.clear();
  return index;
}

/// Fit data whose truth is tracked + displacement, and, with an error rotation, q_tracked = q_error q_true. Places that
/// fill a whole grid get their grid index.
inline correctors::FitData fitDataOf(const std::vector<Eigen::Vector3d>& p_tracked_m,
                                     const Displacement& displacement_m, const Rotation& q_error = {},
                                     const Eigen::Quaterniond& q_true = Eigen::Quaterniond::Identity()) {
  correctors::FitData data;
  data.index = wholeGridIndex(p_tracked_m);
  for (std::size_t i = 0; i < p_tracked_m.size(); ++i) {
    data.p_tracked_m.push_back(p_tracked_m[i]);
    data.p_true_m.push_back(p_tracked_m[i] + displacement_m(p_tracked_m[i]));
    data.node.push_back(static_cast<int>(i));
    if (!q_error) continue;
    data.q_true.push_back(q_true);
    data.q_tracked.push_back(q_error(p_tracked_m[i]) * q_true);
  }
  return data;
}

/// Defaults of a method, with some settings given as text.
template <class Model>
Settings settingsOf(const correctors::CorrectionMethod<Model>& method,
                    const std::map<std::string, std::string>& given = {}) {
  return resolveSettings(method.id, method.settings, given).value();
}

/// Fits a method of the registry by id.
inline Result<std::unique_ptr<correctors::PositionModel>> fitPosition(
    const std::string& id, const correctors::FitData& data, const std::map<std::string, std::string>& given = {}) {
  const correctors::PositionMethod& method = *correctors::findPositionMethod(id).value();
  return method.fit(data, settingsOf(method, given), {});
}

inline Result<std::unique_ptr<correctors::OrientationModel>> fitOrientation(
    const std::string& id, const correctors::FitData& data, const std::map<std::string, std::string>& given = {}) {
  const correctors::OrientationMethod& method = *correctors::findOrientationMethod(id).value();
  return method.fit(data, settingsOf(method, given), {});
}

/// Points in and a little around the shaken grid [m].
inline std::vector<Eigen::Vector3d> randomPoints(std::size_t count, std::uint64_t seed = 17) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> uniform(-0.2, 1.4);
  std::vector<Eigen::Vector3d> points_m(count);
  for (Eigen::Vector3d& p_m : points_m)
    p_m = Eigen::Vector3d(0.4 + uniform(generator), -0.3 + uniform(generator), -0.2 + uniform(generator));
  return points_m;
}

}  // namespace fieldtrue::testing
