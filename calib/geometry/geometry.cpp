#include "calib/geometry/geometry.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>

#include "calib/core/json_reader.h"
#include "calib/geometry/convex_hull.h"

namespace fieldtrue {

namespace {

/// Points whose second spread is below this share of the first lie on one line as far as double precision can tell.
constexpr double kLineRatio = 1e-6;
/// Rounding of a distance to a half-space that passes through the point itself.
constexpr double kRounding_m = 1e-12;

Eigen::Vector3d mean(std::span<const Eigen::Vector3d> points_m) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point_m : points_m) sum += point_m;
  return sum / static_cast<double>(points_m.size());
}

Eigen::Vector3d weightedMean(std::span<const Eigen::Vector3d> points_m, std::span<const double> weights) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < points_m.size(); ++i) sum += weights[i] * points_m[i];
  return sum / std::accumulate(weights.begin(), weights.end(), 0.0);
}

bool allFinite(std::span<const Eigen::Vector3d> points_m) {
  return std::all_of(points_m.begin(), points_m.end(), [](const Eigen::Vector3d& p) { return p.allFinite(); });
}

/// The half-space of a normal that touches the points from outside.
Eigen::Vector4d supporting(const Eigen::Vector3d& outward, std::span<const Eigen::Vector3d> points_m) {
  double farthest_m = -std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& point_m : points_m) farthest_m = std::max(farthest_m, outward.dot(point_m));
  return {outward.x(), outward.y(), outward.z(), -farthest_m};
}

/// Outward normals of the hull of points in a plane, taken within that plane; empty when they lie on one line.
std::vector<Eigen::Vector3d> planarNormals(std::span<const Eigen::Vector3d> points_m, const PointSpread& spread) {
  std::vector<Eigen::Vector2d> flat_m;
  flat_m.reserve(points_m.size());
  for (const Eigen::Vector3d& point_m : points_m) {
    flat_m.emplace_back(spread.axes.leftCols<2>().transpose() * (point_m - spread.center_m));
  }
  const std::vector<Eigen::Vector2d> corners_m = convexPolygon(flat_m);
  std::vector<Eigen::Vector3d> normals;
  if (corners_m.size() < 3) return normals;
  for (std::size_t i = 0; i < corners_m.size(); ++i) {
    const Eigen::Vector2d edge_m = corners_m[(i + 1) % corners_m.size()] - corners_m[i];
    normals.emplace_back((spread.axes.leftCols<2>() * Eigen::Vector2d(edge_m.y(), -edge_m.x())).normalized());
  }
  return normals;
}

/// A polytope of 26 faces around the points: what stands in for the hull where Qhull gives up.
std::vector<Eigen::Vector3d> fallbackNormals(const PointSpread& spread) {
  std::vector<Eigen::Vector3d> normals;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        if (x == 0 && y == 0 && z == 0) continue;
        normals.push_back((spread.axes * Eigen::Vector3d(x, y, z)).normalized());
      }
    }
  }
  return normals;
}

Eigen::Vector4d halfSpaceFrom(const JsonReader& json) {
  const std::vector<double> numbers = json.numbers();
  const bool is_plane = numbers.size() == 4 && std::abs(Eigen::Vector3d(numbers.data()).norm() - 1.0) < 1e-6;
  if (!is_plane) json.refuse("a unit normal and a distance");
  return Eigen::Vector4d(numbers.data());
}

}  // namespace

Result<Pose> fitRigid(std::span<const Eigen::Vector3d> from_m, std::span<const Eigen::Vector3d> to_m,
                      std::span<const double> weights) {
  FT_CHECK(from_m.size() == to_m.size());
  FT_CHECK(weights.empty() || weights.size() == from_m.size());
  if (from_m.size() < 3) {
    return fail(ErrorCode::kTooFewNodes,
                "A rigid fit needs 3 points not on one line, got " + std::to_string(from_m.size()));
  }
  if (!allFinite(from_m) || !allFinite(to_m)) {
    return fail(ErrorCode::kBadInput, "A rigid fit needs finite points, got one that is not");
  }
  if (pointSpread(from_m, kLineRatio).dimension < 2 || pointSpread(to_m, kLineRatio).dimension < 2) {
    return fail(ErrorCode::kDegenerate, "A rigid fit needs 3 points not on one line, got " +
                                            std::to_string(from_m.size()) + " points on one line");
  }
  const Eigen::Vector3d from_center_m = weights.empty() ? mean(from_m) : weightedMean(from_m, weights);
  const Eigen::Vector3d to_center_m = weights.empty() ? mean(to_m) : weightedMean(to_m, weights);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < from_m.size(); ++i) {
    const double weight = weights.empty() ? 1.0 : weights[i];
    covariance += weight * (to_m[i] - to_center_m) * (from_m[i] - from_center_m).transpose();
  }
  // Umeyama 1991, eq. 40-43 without the scale; the last column's sign keeps a mirror image from being fitted.
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double handedness = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  const Eigen::Matrix3d R =
      svd.matrixU() * Eigen::Vector3d(1.0, 1.0, handedness).asDiagonal() * svd.matrixV().transpose();
  Pose to_from_from;
  to_from_from.orientation = canonical(Eigen::Quaterniond(R));
  to_from_from.position_m = to_center_m - to_from_from.orientation * from_center_m;
  return to_from_from;
}

bool isMirrorImage(std::span<const Eigen::Vector3d> from_m, std::span<const Eigen::Vector3d> to_m, double share) {
  FT_CHECK(from_m.size() == to_m.size());
  constexpr double kFlat = 1e-9;
  if (from_m.empty()) return false;
  const Eigen::Vector3d from_center_m = mean(from_m);
  const Eigen::Vector3d to_center_m = mean(to_m);
  Eigen::Matrix3d cross_m2 = Eigen::Matrix3d::Zero();
  double squares_m2 = 0.0;
  for (std::size_t i = 0; i < from_m.size(); ++i) {
    const Eigen::Vector3d from = from_m[i] - from_center_m, to = to_m[i] - to_center_m;
    cross_m2 += from * to.transpose();
    squares_m2 += from.squaredNorm() + to.squaredNorm();
  }
  const Eigen::Vector3d singular_m2 = Eigen::JacobiSVD<Eigen::Matrix3d>(cross_m2).singularValues();
  if (cross_m2.determinant() >= 0.0 || singular_m2[2] < kFlat * singular_m2[0]) return false;
  const double mirrored_m2 = squares_m2 - 2.0 * singular_m2.sum();
  const double turned_m2 = mirrored_m2 + 4.0 * singular_m2[2];
  return mirrored_m2 < share * share * turned_m2;
}

PointSpread pointSpread(std::span<const Eigen::Vector3d> points_m, double flat_ratio) {
  PointSpread spread;
  if (points_m.empty()) return spread;
  spread.center_m = mean(points_m);
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& point_m : points_m) {
    scatter += (point_m - spread.center_m) * (point_m - spread.center_m).transpose();
  }
  scatter /= static_cast<double>(points_m.size());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(scatter);
  for (int column = 0; column < 2; ++column) {
    Eigen::Vector3d axis = eigen.eigenvectors().col(2 - column);
    Eigen::Index largest = 0;
    axis.cwiseAbs().maxCoeff(&largest);
    spread.axes.col(column) = axis[largest] < 0.0 ? Eigen::Vector3d(-axis) : axis;
  }
  spread.axes.col(2) = spread.axes.col(0).cross(spread.axes.col(1));
  spread.sd_m = eigen.eigenvalues().reverse().cwiseMax(0.0).cwiseSqrt();
  const double rounding_m = 1e-14 * spread.center_m.norm();
  for (int axis = 0; axis < 3; ++axis) {
    if (spread.sd_m[axis] > std::max(flat_ratio * spread.sd_m[0], rounding_m)) ++spread.dimension;
  }
  return spread;
}

std::vector<Eigen::Quaterniond> distinctRotations(std::span<const Eigen::Quaterniond> rotations, double within_rad) {
  std::vector<Eigen::Quaterniond> distinct;
  for (const Eigen::Quaterniond& q : rotations) {
    const bool is_new = std::none_of(distinct.begin(), distinct.end(), [&](const Eigen::Quaterniond& other) {
      return angleBetween_rad(q, other) < within_rad;
    });
    if (is_new) distinct.push_back(q);
  }
  return distinct;
}

Region Region::around(std::span<const Eigen::Vector3d> points_m, int dimension, double margin_m) {
  FT_CHECK(margin_m >= 0.0 && allFinite(points_m));
  Region region;
  region.margin_m_ = margin_m;
  if (dimension < 2 || points_m.size() < 3) return region;
  const PointSpread spread = pointSpread(points_m);
  std::vector<Eigen::Vector3d> normals;
  if (dimension == 2) {
    normals = planarNormals(points_m, spread);
    if (normals.empty()) return region;
    normals.emplace_back(spread.axes.col(2));
    normals.emplace_back(-spread.axes.col(2));
  } else {
    normals = convexHullNormals(points_m).value_or(std::vector<Eigen::Vector3d>());
    if (normals.size() < 4) normals = fallbackNormals(spread);
  }
  for (const Eigen::Vector3d& normal : normals) region.half_spaces_.push_back(supporting(normal, points_m));
  return region;
}

bool Region::contains(const Eigen::Vector3d& point_m) const {
  return !empty() && outside_m(point_m) <= margin_m_ + kRounding_m;
}

double Region::outside_m(const Eigen::Vector3d& point_m) const {
  if (empty() || !point_m.allFinite()) return std::numeric_limits<double>::infinity();
  double farthest_m = -std::numeric_limits<double>::infinity();
  for (const Eigen::Vector4d& half_space : half_spaces_) {
    farthest_m = std::max(farthest_m, half_space.head<3>().dot(point_m) + half_space[3]);
  }
  return farthest_m;
}

nlohmann::json Region::toJson() const {
  nlohmann::json rows = nlohmann::json::array();
  for (const Eigen::Vector4d& h : half_spaces_) rows.push_back({h[0], h[1], h[2], h[3]});
  return {{"half_spaces_nx_ny_nz_d_m", rows}, {"margin_m", margin_m_}};
}

Region Region::fromJson(const JsonReader& json) {
  Region region;
  region.half_spaces_ = json["half_spaces_nx_ny_nz_d_m"].list(halfSpaceFrom);
  region.margin_m_ = json["margin_m"].number();
  if (region.margin_m_ < 0.0) json["margin_m"].refuse("0 or more");
  return region;
}

}  // namespace fieldtrue
