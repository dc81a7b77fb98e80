#pragma once

#include <Eigen/Core>

#include "calib/correctors/cells/hexahedral_cells.h"

namespace fieldtrue::correctors {

/// In which coordinates the monomials of the shape functions are taken.
enum class ShapeAxes {
  kCell,    ///< Along the mean edges of the cell: never singular for a parallelepiped, however it stands.
  kTracker  ///< Along the tracker's axes, as published: a cube turned by 45 degrees makes the equations singular.
};

/// The shape functions of one hexahedron, summed with its error vectors.
class ShapeCell {
 public:
  /// Solves the 8x8 systems A f_i = e_i.
  /// @param v_m error vectors of all corners of the cells, tracker frame [m]
  /// @source Zachmann 2000, in Kindratenko 2000, A survey of electromagnetic position tracker calibration techniques,
  ///         section 3.2, eq. 3-4
  ShapeCell(const HexahedralCells& cells, std::size_t cell, const std::vector<Eigen::Vector3d>& v_m, ShapeAxes axes);

  /// The corners do not determine the functions: A is singular, or so nearly that coefficients exceed a million, where
  /// those of a cube are 1/8.
  bool isSingular() const { return is_singular_; }

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const;
  /// d displacement / d position.
  Eigen::Matrix3d gradient(const Eigen::Vector3d& p_tracked_m) const;

 private:
  using Monomials = Eigen::Matrix<double, 8, 1>;

  static Monomials monomials(const Eigen::Vector3d& x);

  Eigen::Vector3d center_m_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d local_from_tracker_1_m_ = Eigen::Matrix3d::Identity();
  Eigen::Matrix<double, 8, 3> coefficients_m_ = Eigen::Matrix<double, 8, 3>::Zero();
  bool is_singular_ = false;
};

}  // namespace fieldtrue::correctors
