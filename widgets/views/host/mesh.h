#pragma once

#include <vtkSmartPointer.h>

#include <Eigen/Core>
#include <QColor>
#include <array>
#include <optional>
#include <vector>

#include "calib/core/pose.h"

class vtkActor;
class vtkPolyData;
class vtkRenderer;

namespace fieldtrue::widgets {

/// Collects the coloured, smoothly shaded triangles of simple solids [m].
class Mesh {
 public:
  /// Colour of what is added from now on; a mesh without any colour takes the actor's.
  void setColor(const QColor& color) { color_ = color; }
  void addTriangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                   const Eigen::Vector3d& normal);
  void addBox(const Pose& at, const Eigen::Vector3d& half_size_m);
  void addCylinder(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius_m, int sides = 20);
  void addCone(const Eigen::Vector3d& base, const Eigen::Vector3d& tip, double radius_m, int sides = 20);
  /// A shaft with a head: the head is a fifth of the whole, at most 7 shaft radii.
  void addArrow(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double shaft_radius_m);
  void addBall(const Eigen::Vector3d& center, double radius_m, int sides = 24);
  /// Part of a flat ring in the plane of the unit vectors u and v.
  void addSector(const Eigen::Vector3d& center, const Eigen::Vector3d& u, const Eigen::Vector3d& v, double inner_m,
                 double outer_m, double from_rad, double to_rad, int steps);
  vtkSmartPointer<vtkPolyData> polyData() const;
  bool empty() const { return points_.empty(); }

 private:
  struct Corner {
    Eigen::Vector3d at, normal;
  };
  void add(const Corner& a, const Corner& b, const Corner& c);

  std::optional<QColor> color_;
  std::vector<Corner> points_;  ///< Three make a triangle.
  std::vector<QColor> colors_;  ///< One per point, or none.
};

/// Straight lines [m].
class Lines {
 public:
  void add(const Eigen::Vector3d& from, const Eigen::Vector3d& to);
  vtkSmartPointer<vtkPolyData> polyData() const;

 private:
  std::vector<std::array<Eigen::Vector3d, 2>> lines_;
};

std::array<double, 3> rgb(const QColor& color);

/// An actor whose colours are exactly those given, whatever the light.
vtkSmartPointer<vtkActor> addFlatActor(vtkRenderer* renderer);
/// An actor shaded by the light at the camera.
vtkSmartPointer<vtkActor> addSolidActor(vtkRenderer* renderer);
void setShape(vtkActor* actor, vtkPolyData* shape);

/// Two unit vectors that complete a direction to a right-handed frame (u, v, direction).
std::array<Eigen::Vector3d, 2> across(const Eigen::Vector3d& direction);

}  // namespace fieldtrue::widgets
