#pragma once

#include <vtkSmartPointer.h>

#include <Eigen/Core>
#include <QColor>
#include <array>
#include <span>
#include <vector>

class vtkActor;
class vtkGlyph3DMapper;
class vtkPolyData;
class vtkRenderer;

namespace fieldtrue {

/// Flat marks that always face the camera, so that each keeps its shape from every side.
enum class Symbol { kDot, kCircle, kThickCircle, kFilledCircle, kSquare, kFilledSquare, kDiamond, kCross };

/// One symbol drawn at many points.
class MarkLayer {
 public:
  MarkLayer(vtkRenderer* renderer, Symbol symbol);
  void setPoints(std::span<const Eigen::Vector3d> points_m);
  void setRadius(double radius_m) { radius_m_ = radius_m; }
  void setColor(const QColor& color, double opacity = 1.0);
  /// An edge of this colour keeps filled marks apart where they overlap.
  void setEdge(const QColor& color);
  /// @param world_from_view rotation of the camera: columns right, up, toward the camera
  void face(const Eigen::Matrix3d& world_from_view);

 private:
  struct Glyphs {
    vtkSmartPointer<vtkPolyData> unit_shape, placed_shape;
    vtkSmartPointer<vtkGlyph3DMapper> mapper;
    vtkSmartPointer<vtkActor> actor;
  };
  Glyphs makeGlyphs(vtkRenderer* renderer, vtkSmartPointer<vtkPolyData> unit_shape);

  vtkSmartPointer<vtkPolyData> points_;
  Glyphs fill_, edge_;
  double radius_m_ = 0.01;
  Eigen::Matrix3d placed_ = Eigen::Matrix3d::Zero();
};

/// Arrows of even thickness with a thin dark edge, up to many thousands.
class ArrowLayer {
 public:
  struct Arrow {
    Eigen::Vector3d from_m, to_m;
    QColor color;
  };

  explicit ArrowLayer(vtkRenderer* renderer);
  /// @param shaft_radius_m of arrows long enough for it; short ones are thinner
  void setArrows(std::span<const Arrow> arrows, double shaft_radius_m);
  void setEdge(const QColor& color, double width_m);

 private:
  struct Glyphs {
    vtkSmartPointer<vtkPolyData> points;
    vtkSmartPointer<vtkActor> actor;
  };
  Glyphs makeGlyphs(vtkRenderer* renderer, vtkPolyData* shape, bool edge);
  void place(const Glyphs& glyphs, std::span<const Arrow> arrows, double shaft_radius_m, bool head, double grow_m);

  Glyphs shaft_, head_, shaft_edge_, head_edge_;
  double edge_m_ = 0.0;
};

}  // namespace fieldtrue
