#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "calib/effects/effect_fit.h"

namespace fieldtrue::effects {

/// Where a fit may look for a thing that stands in the room: around the places of the sensor and about the
/// transmitter, never on one of them. All of it is laid out along the tracker's axes: which way the rig's frame is
/// turned changes nothing of what is found.
class RoomSearch {
 public:
  explicit RoomSearch(const FitDesign& design);

  /// Least distance from any place at which a body is looked for [m].
  double keepAway_m() const { return keep_away_m_; }
  /// Largest side of the box of places, at least 0.4 m.
  double extent_m() const { return extent_m_; }
  const Eigen::AlignedBox3d& box_m() const { return box_m_; }
  const std::vector<Eigen::Vector3d>& places_m() const { return places_m_; }

  double nearestPlace_m(const Eigen::Vector3d& p_m) const;
  /// Farthest that any place, or the transmitter, lies in a direction [m].
  double farthestAlong_m(const Eigen::Vector3d& direction) const;

  /// Bounds of center_x_m, center_y_m and center_z_m.
  std::vector<FitParameter> centerParameters() const;
  /// Within these bounds, and not on a place or on the transmitter.
  bool allowsCenter(const Eigen::Vector3d& center_m) const;

  /// Places on the surfaces of boxes that stand this far out around the places, tracker frame, those on or next to a
  /// place or the transmitter left out.
  /// @param spacing of the points of the first surface, as a share of the extent; outer surfaces are coarser
  /// @param shells distances of the surfaces, as shares of the extent
  std::vector<Eigen::Vector3d> around_m(double spacing, const std::vector<double>& shells) const;
  /// Places about the transmitter, likewise.
  std::vector<Eigen::Vector3d> aboutTransmitter_m() const;

 private:
  bool isClear(const Eigen::Vector3d& p_m, double share) const;
  std::vector<Eigen::Vector3d> places_m_;
  Eigen::AlignedBox3d box_m_;
  Eigen::AlignedBox3d bounds_m_;
  double keep_away_m_ = 0.12;
  double extent_m_ = 0.4;
};

/// Directions as two angles, latitude and longitude about a pole that lies between two axes of the tracker, so that the
/// angles are smooth near every axis and every diagonal of its frame.
class DirectionChart {
 public:
  DirectionChart();
  /// Unit vector, tracker frame.
  Eigen::Vector3d direction(double latitude_rad, double longitude_rad) const;
  /// Latitude and longitude [rad] of a unit vector.
  Eigen::Vector2d angles_rad(const Eigen::Vector3d& direction) const;
  /// Bounds of the two angles.
  static std::vector<FitParameter> parameters();

 private:
  Eigen::Quaterniond tracker_from_chart_;
};

/// Unit normals from which a flat thing is looked for: the tracker's axes, and the diagonals between three of them.
std::span<const Eigen::Vector3d> firstNormals();

/// A searched vector from its parts.
Eigen::VectorXd joined(const Eigen::VectorXd& a, const Eigen::VectorXd& b);

}  // namespace fieldtrue::effects
