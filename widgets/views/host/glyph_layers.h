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

namespace fieldtrue::widgets {

/// Flat marks that always face the camera, so that each keeps its shape from every side.
/// A kDot is a small ball and needs no turning.
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
  Glyphs makeGlyphs(vtkRenderer* renderer, vtkPolyData* unit_shape);

  vtkSmartPointer<vtkPolyData> points_;
  Glyphs fill_, edge_;
  bool round_ = false;
  double radius_m_ = 0.01;
  Eigen::Matrix3d placed_ = Eigen::Matrix3d::Zero();
};

/// Arrows of even thickness, up to many thousands; up to two thousand have a thin edge.
class ArrowLayer {
 public:
  struct Arrow {
    Eigen::Vector3d from_m, to_m;
    QColor color;  ///< Its alpha makes the arrow translucent.
  };

  explicit ArrowLayer(vtkRenderer* renderer);
  /// Translucent arrows have no edge, which would show through them.
  /// @param shaft_radius_m of arrows long enough for it; short ones are thinner
  void setArrows(std::span<const Arrow> arrows, double shaft_radius_m);
  void setEdge(const QColor& color);

 private:
  static vtkSmartPointer<vtkActor> makeGlyphs(vtkRenderer* renderer, vtkPolyData* shape, bool edge);
  static void place(vtkActor* glyphs, std::span<const Arrow> arrows, double shaft_radius_m, bool head,
                    double edge_share);

  vtkSmartPointer<vtkActor> shaft_, head_, shaft_edge_, head_edge_;
};

}  // namespace fieldtrue::widgets
