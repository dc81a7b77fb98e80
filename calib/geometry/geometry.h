#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <vector>

#include "calib/core/error.h"
#include "calib/core/pose.h"

namespace fieldtrue {

class JsonReader;

/// Least-squares rigid transform to_from_from: minimises sum w_i |to_i - (R from_i + t)|^2, det R = +1.
/// @param weights w_i, positive, as many as points; empty = all alike
/// @source Horn 1987 / Umeyama 1991 (without scale)
/// @error kTooFewNodes below 3 points; kDegenerate when the points lie on one line
Result<Pose> fitRigid(std::span<const Eigen::Vector3d> from_m, std::span<const Eigen::Vector3d> to_m,
                      std::span<const double> weights = {});

/// RMS misfit of the mirror image over that of any turn, below which an axis has the wrong sign or two are exchanged.
inline constexpr double kMirrorShare = 0.3;

/// Whether points fit a mirror image of others far better than any turn of them; never where they lie in one plane.
/// @param to_m as many as from_m
/// @source Umeyama 1991, IEEE PAMI 13 376, the sign of the determinant
bool isMirrorImage(std::span<const Eigen::Vector3d> from_m, std::span<const Eigen::Vector3d> to_m,
                   double share = kMirrorShare);

/// How points spread in space: their centre, principal axes (columns, longest first) and SD along each.
struct PointSpread {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  Eigen::Vector3d sd_m = Eigen::Vector3d::Zero();
  /// 3 volume, 2 one plane, 1 one line, 0 one point; an axis counts when its SD exceeds `flat_ratio` of the longest.
  int dimension = 0;
};
PointSpread pointSpread(std::span<const Eigen::Vector3d> points_m, double flat_ratio = 0.01);

/// Of rotations, those that no earlier one is so near to. @return in the order of their first appearance
std::vector<Eigen::Quaterniond> distinctRotations(std::span<const Eigen::Quaterniond> rotations, double within_rad);

/// The region that measured points span: their convex hull (in a volume), or the hull in their plane with a slab of
/// stated half-thickness around it. Nothing is claimed outside.
class Region {
 public:
  Region() = default;
  /// @param margin_m points this far outside still count as inside (also the slab's half-thickness for planar points)
  /// @param dimension 3 or 2: spread of the points as decided by the caller; below 2 the region is empty
  static Region around(std::span<const Eigen::Vector3d> points_m, int dimension, double margin_m);
  bool contains(const Eigen::Vector3d& point_m) const;
  /// Largest signed distance to the bounding half-spaces [m]: negative inside, positive outside.
  double outside_m(const Eigen::Vector3d& point_m) const;
  bool empty() const { return half_spaces_.empty(); }
  double margin_m() const { return margin_m_; }
  nlohmann::json toJson() const;
  static Region fromJson(const JsonReader& json);

 private:
  std::vector<Eigen::Vector4d> half_spaces_;  ///< Outward unit normal n and offset d: n.x + d <= margin inside.
  double margin_m_ = 0.0;
};

}  // namespace fieldtrue
