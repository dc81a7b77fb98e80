#include "calib/correctors/cells/shape_cell.h"

#include <Eigen/LU>

namespace fieldtrue::correctors {
namespace {

/// A nanometre in a corner then moves the middle by a millimetre; in a cube the coefficients are 1/8.
constexpr double kSingularCoefficient = 1e6;
/// Volume of a cell this flat, of the cube of its size.
constexpr double kFlat = 1e-6;

/// Half the edges of the box around the cell, along the tracker's axes.
Eigen::Matrix3d boxAxes_m(const std::array<Eigen::Vector3d, 8>& x) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& corner_m : x) box.extend(corner_m);
  return (0.5 * box.sizes()).asDiagonal();
}

/// Half the mean of the four edges along each natural coordinate.
Eigen::Matrix3d edgeAxes_m(const std::array<Eigen::Vector3d, 8>& x) {
  Eigen::Matrix3d axes_m = Eigen::Matrix3d::Zero();
  for (std::size_t c = 0; c < 8; ++c)
    for (unsigned axis = 0; axis < 3; ++axis)
      axes_m.col(static_cast<Eigen::Index>(axis)) += ((c >> axis) & 1U) != 0 ? x[c] : Eigen::Vector3d(-x[c]);
  return axes_m / 8.0;
}

}  // namespace

ShapeCell::ShapeCell(const HexahedralCells& cells, std::size_t cell, const std::vector<Eigen::Vector3d>& v_m,
                     ShapeAxes axes) {
  std::array<Eigen::Vector3d, 8> x;
  for (std::size_t c = 0; c < 8; ++c) {
    x[c] = cells.corner_m(cell, c);
    center_m_ += x[c] / 8.0;
  }
  // Shifting and stretching each axis by itself leaves the space of eq. (4) what it was, and A well scaled.
  const Eigen::Matrix3d tracker_from_local_m = axes == ShapeAxes::kCell ? edgeAxes_m(x) : boxAxes_m(x);
  const double volume = std::abs(tracker_from_local_m.determinant());
  const double size_m = tracker_from_local_m.norm();
  is_singular_ = !(volume > kFlat * size_m * size_m * size_m);
  if (is_singular_) return;
  local_from_tracker_1_m_ = tracker_from_local_m.inverse();
  Eigen::Matrix<double, 8, 8> a;
  Eigen::Matrix<double, 8, 3> corner_values_m;
  for (std::size_t c = 0; c < 8; ++c) {
    const auto row = static_cast<Eigen::Index>(c);
    a.row(row) = monomials(local_from_tracker_1_m_ * (x[c] - center_m_)).transpose();
    corner_values_m.row(row) = v_m[static_cast<std::size_t>(cells.corners(cell)[c])].transpose();
  }
  // Row k of the inverse holds the coefficients f_ik of all eight functions.
  const Eigen::Matrix<double, 8, 8> f = Eigen::PartialPivLU<Eigen::Matrix<double, 8, 8>>(a).inverse();
  is_singular_ = !(f.cwiseAbs().maxCoeff() < kSingularCoefficient);
  if (!is_singular_) coefficients_m_ = f * corner_values_m;
}

ShapeCell::Monomials ShapeCell::monomials(const Eigen::Vector3d& x) {
  Monomials m;
  m << 1.0, x.x(), x.y(), x.z(), x.x() * x.y(), x.x() * x.z(), x.y() * x.z(), x.x() * x.y() * x.z();
  return m;
}

Eigen::Vector3d ShapeCell::displacement_m(const Eigen::Vector3d& p_tracked_m) const {
  return coefficients_m_.transpose() * monomials(local_from_tracker_1_m_ * (p_tracked_m - center_m_));
}

Eigen::Matrix3d ShapeCell::gradient(const Eigen::Vector3d& p_tracked_m) const {
  const Eigen::Vector3d x = local_from_tracker_1_m_ * (p_tracked_m - center_m_);
  Eigen::Matrix<double, 8, 3> slopes;
  slopes.col(0) << 0.0, 1.0, 0.0, 0.0, x.y(), x.z(), 0.0, x.y() * x.z();
  slopes.col(1) << 0.0, 0.0, 1.0, 0.0, x.x(), 0.0, x.z(), x.x() * x.z();
  slopes.col(2) << 0.0, 0.0, 0.0, 1.0, 0.0, x.x(), x.y(), x.x() * x.y();
  return coefficients_m_.transpose() * slopes * local_from_tracker_1_m_;
}

}  // namespace fieldtrue::correctors
