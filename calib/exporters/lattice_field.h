#pragma once

#include <array>
#include <optional>
#include <vector>

#include "calib/geometry/geometry.h"

namespace fieldtrue::exporters {

/// Points of a lattice, whose axes may be turned. Point (i, j, k) stands at origin + axes * pitch * (i, j, k); in lists
/// of points i runs fastest.
struct LatticePoints {
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< Columns: the directions of i, j and k.
  Eigen::Vector3d pitch_m = Eigen::Vector3d::Ones();
  std::array<int, 3> counts = {2, 2, 2};

  std::size_t size() const;
  std::size_t at(int i, int j, int k) const;
  Eigen::Vector3d point_m(int i, int j, int k) const;
  Eigen::Vector3d point_m(std::size_t index) const;
  /// In steps from the first point, along each axis.
  Eigen::Vector3d steps(const Eigen::Vector3d& p_m) const;
};

/// A map sampled at the points of a lattice: where each point goes, and what else a format has room for.
struct LatticeField {
  LatticePoints points;
  std::vector<Eigen::Vector3d> displacement_m;  ///< Of every point.
  std::vector<Eigen::Quaterniond> rotation;     ///< Before the orientation that is read; empty where none is known.
  std::vector<double> uncertainty_m;            ///< NaN where unknown; empty where the method knows none.
  std::vector<char> inside;                     ///< Whether a point lies where the calibration holds; may be empty.

  /// Where a position goes by trilinear interpolation; none outside the lattice.
  std::optional<Eigen::Vector3d> mapped_m(const Eigen::Vector3d& p_m) const;
};

}  // namespace fieldtrue::exporters
