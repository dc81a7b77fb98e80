#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "calib/core/json_reader.h"
#include "calib/correctors/base/orientation_model.h"
#include "calib/correctors/base/position_model.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::correctors {

/// The most points a lattice of another program may have: as many as a baked one.
inline constexpr std::size_t kMostImportedPoints = 2'000'000;

/// Three numbers at each point of a lattice whose axes may be turned, straight between the points. Point (i, j, k)
/// stands at origin + axes * pitch * (i, j, k); i runs fastest.
struct LatticeVectors {
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< Columns: orthonormal directions of i, j and k.
  Eigen::Vector3d pitch_m = Eigen::Vector3d::Ones();
  std::array<int, 3> counts = {2, 2, 2};  ///< At least 2 each.
  std::vector<float> values;              ///< Three a point.
  std::vector<std::uint8_t> inside;  ///< 1 of a point that the correction holds at, else 0; empty where it does at all.

  /// Whether every point that the value is made of is inside.
  bool covers(const Eigen::Vector3d& p_m) const;
  /// By trilinear interpolation; beside the lattice the value of its nearest edge.
  Eigen::Vector3d valueAt(const Eigen::Vector3d& p_m) const;
  nlohmann::json toJson() const;
  static LatticeVectors fromJson(const JsonReader& json);

 private:
  /// A corner of the cell that a place lies in, and what it counts for.
  struct Corner {
    std::size_t point = 0;
    double weight = 0.0;
  };
  Eigen::Vector3d stepsTo(const Eigen::Vector3d& p_m) const;
  /// @param steps finite; beside the lattice the cell of its nearest edge
  std::array<Corner, 8> cornersAt(const Eigen::Vector3d& steps) const;
};

/// A position correction that another program made, as its lattice of displacements [m].
std::unique_ptr<PositionModel> makeImportedPosition(LatticeVectors displacements, std::string note);
/// An orientation correction of a lattice of rotation vectors [rad]: each turns a reading on its left.
std::unique_ptr<OrientationModel> makeImportedOrientation(LatticeVectors turns);

}  // namespace fieldtrue::correctors
