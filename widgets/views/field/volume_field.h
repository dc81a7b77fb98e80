#pragma once

#include <vtkSmartPointer.h>

#include <Eigen/Core>
#include <QColor>
#include <QString>
#include <array>
#include <functional>
#include <optional>
#include <vector>

class vtkPolyData;

namespace fieldtrue::widgets {

/// Values on a regular lattice along the axes of the reference frame.
struct VolumeField {
  QString title;                          ///< What exactly the values are.
  std::array<int, 3> count{};             ///< Points along x, y, z.
  Eigen::Vector3d low_m{0.0, 0.0, 0.0};   ///< Of the first point.
  Eigen::Vector3d step_m{1.0, 1.0, 1.0};  ///< From a point to its neighbours.
  std::vector<double> values_mm;          ///< x runs fastest; NaN where nothing is known.

  std::size_t size() const;
  bool empty() const { return values_mm.empty(); }
  Eigen::Vector3d point_m(std::size_t index) const;
  Eigen::Vector3d high_m() const;
  /// Trilinear between the eight points around; NaN outside or where one of them is not known.
  double valueAt(const Eigen::Vector3d& at_m) const;
  /// Of the known values; none when nothing is known.
  std::optional<double> largest_mm() const;
};

/// A plane across one axis of the reference frame.
struct SlicePlane {
  int axis = 2;       ///< 0 x, 1 y, 2 z.
  double at_m = 0.0;  ///< Where the plane cuts that axis [m].
  bool operator==(const SlicePlane&) const = default;
};

/// A ball or cube of the scene: a part of space no place is near, or a cell in which the field folds back.
struct SceneCell {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();  ///< Reference frame [m].
  double size_m = 0.0;                                 ///< Radius of a ball, edge of a cube.
};

/// The surface on which the field has one value; it ends where the field is not known.
/// @source Schroeder, Maynard, Geveci 2015, flying edges
vtkSmartPointer<vtkPolyData> isoSurface(const VolumeField& field, double value_mm);

/// The field on a plane as coloured squares; a plane beside the lattice, and squares that are not known, are left out.
/// @param color of a value [mm]
vtkSmartPointer<vtkPolyData> sliceSurface(const VolumeField& field, const SlicePlane& plane,
                                          const std::function<QColor(double value_mm)>& color);

}  // namespace fieldtrue::widgets
