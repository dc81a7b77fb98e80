#include "widgets/views/host/glyph_layers.h"

#include <vtkActor.h>
#include <vtkFloatArray.h>
#include <vtkGlyph3DMapper.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>

#include "calib/core/units.h"
#include "widgets/views/host/mesh.h"

namespace fieldtrue::widgets {
namespace {

constexpr double kEdgeSize = 1.28;        ///< Of the edge's shape, against the mark's.
constexpr double kEdgeBehind = 0.2;       ///< Radii.
constexpr double kFullLength = 9.0;       ///< Shaft radii from which an arrow has its full thickness.
constexpr double kHeadLength = 6.0;       ///< Shaft radii.
constexpr double kHeadRadius = 2.7;       ///< Shaft radii.
constexpr double kHeadShare = 0.62;       ///< Of a short arrow.
constexpr double kEdgeShare = 0.3;        ///< Of the shaft's radius.
constexpr std::size_t kMostEdged = 2000;  ///< With more the edges hide the colours and cost half of the time.
constexpr int kSides = 8;

void addPolygonRing(Mesh& mesh, double inner, double outer, int corners, double first_rad) {
  mesh.addSector(Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), inner, outer, first_rad,
                 first_rad + 2.0 * kPi, corners);
}

void addBar(Mesh& mesh, double angle_rad, double half_length, double half_width) {
  const Eigen::Vector3d u(std::cos(angle_rad), std::sin(angle_rad), 0.0), v(-u.y(), u.x(), 0.0);
  const auto at = [&](double a, double b) { return Eigen::Vector3d(a * half_length * u + b * half_width * v); };
  mesh.addTriangle(at(-1, -1), at(1, -1), at(1, 1), Eigen::Vector3d::UnitZ());
  mesh.addTriangle(at(-1, -1), at(1, 1), at(-1, 1), Eigen::Vector3d::UnitZ());
}

/// An octahedron's faces, each divided in four and blown up to the unit ball.
void addBall(Mesh& mesh) {
  for (int octant = 0; octant < 8; ++octant) {
    const Eigen::Vector3d x((octant & 1) ? 1 : -1, 0, 0), y(0, (octant & 2) ? 1 : -1, 0),
        z(0, 0, (octant & 4) ? 1 : -1);
    const Eigen::Vector3d xy = (x + y).normalized(), yz = (y + z).normalized(), zx = (z + x).normalized();
    const std::array<std::array<Eigen::Vector3d, 3>, 4> faces = {{{x, xy, zx}, {y, yz, xy}, {z, zx, yz}, {xy, yz, zx}}};
    for (const auto& [a, b, c] : faces) mesh.addTriangle(a, b, c, (a + b + c).normalized());
  }
}

vtkSmartPointer<vtkPolyData> shapeOf(Symbol symbol) {
  constexpr double kQuarter = kPi / 4.0;
  Mesh mesh;
  switch (symbol) {
    case Symbol::kDot:
      addBall(mesh);
      break;
    case Symbol::kFilledCircle:
      addPolygonRing(mesh, 0.0, 1.0, 32, 0.0);
      break;
    case Symbol::kCircle:
      addPolygonRing(mesh, 0.76, 1.0, 32, 0.0);
      break;
    case Symbol::kThickCircle:
      addPolygonRing(mesh, 0.7, 1.0, 48, 0.0);
      break;
    case Symbol::kSquare:
      addPolygonRing(mesh, 0.92, 1.25, 4, kQuarter);
      break;
    case Symbol::kFilledSquare:
      addPolygonRing(mesh, 0.0, 1.25, 4, kQuarter);
      break;
    case Symbol::kDiamond:
      addPolygonRing(mesh, 0.0, 1.4, 4, 0.0);
      break;
    case Symbol::kCross:
      addBar(mesh, kQuarter, 1.05, 0.17);
      addBar(mesh, -kQuarter, 1.05, 0.17);
      break;
  }
  return mesh.polyData();
}

vtkSmartPointer<vtkPolyData> pointData(std::span<const Eigen::Vector3d> points_m) {
  vtkNew<vtkPoints> points;
  for (const Eigen::Vector3d& point : points_m) points->InsertNextPoint(point.data());
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(points);
  return data;
}

bool isFilled(Symbol symbol) {
  return symbol == Symbol::kFilledCircle || symbol == Symbol::kFilledSquare || symbol == Symbol::kDiamond;
}

vtkSmartPointer<vtkPolyData> unitShaft() {
  Mesh mesh;
  mesh.addCylinder(Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX(), 1.0, kSides);
  return mesh.polyData();
}

vtkSmartPointer<vtkPolyData> unitHead() {
  Mesh mesh;
  mesh.addCone(Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX(), 1.0, kSides);
  return mesh.polyData();
}

}  // namespace

MarkLayer::MarkLayer(vtkRenderer* renderer, Symbol symbol)
    : points_(vtkSmartPointer<vtkPolyData>::New()),
      fill_(makeGlyphs(renderer, shapeOf(symbol))),
      round_(symbol == Symbol::kDot) {
  if (isFilled(symbol)) edge_ = makeGlyphs(renderer, shapeOf(symbol));
}

MarkLayer::Glyphs MarkLayer::makeGlyphs(vtkRenderer* renderer, vtkPolyData* unit_shape) {
  Glyphs glyphs;
  glyphs.unit_shape = unit_shape;
  glyphs.placed_shape = vtkSmartPointer<vtkPolyData>::New();
  glyphs.placed_shape->DeepCopy(unit_shape);
  glyphs.mapper = vtkSmartPointer<vtkGlyph3DMapper>::New();
  glyphs.mapper->SetInputData(points_);
  glyphs.mapper->SetSourceData(glyphs.placed_shape);
  glyphs.mapper->OrientOff();
  glyphs.mapper->ScalingOff();
  glyphs.mapper->ScalarVisibilityOff();
  glyphs.actor = vtkSmartPointer<vtkActor>::New();
  glyphs.actor->SetMapper(glyphs.mapper);
  glyphs.actor->GetProperty()->LightingOff();
  glyphs.actor->VisibilityOff();
  renderer->AddActor(glyphs.actor);
  return glyphs;
}

void MarkLayer::setPoints(std::span<const Eigen::Vector3d> points_m) {
  points_ = pointData(points_m);
  for (const Glyphs& glyphs : {fill_, edge_}) {
    if (!glyphs.mapper) continue;
    glyphs.mapper->SetInputData(points_);
    glyphs.actor->SetVisibility(!points_m.empty());
  }
}

void MarkLayer::setColor(const QColor& color, double opacity) {
  fill_.actor->GetProperty()->SetColor(rgb(color).data());
  fill_.actor->GetProperty()->SetOpacity(opacity);
}

void MarkLayer::setEdge(const QColor& color) {
  if (edge_.actor) edge_.actor->GetProperty()->SetColor(rgb(color).data());
}

void MarkLayer::face(const Eigen::Matrix3d& world_from_view) {
  const Eigen::Matrix3d placing = radius_m_ * (round_ ? Eigen::Matrix3d::Identity() : world_from_view);
  if (placing == placed_) return;
  placed_ = placing;
  for (const Glyphs& glyphs : {fill_, edge_}) {
    if (!glyphs.mapper) continue;
    const bool is_edge = glyphs.actor == edge_.actor;
    vtkNew<vtkPoints> moved;
    for (vtkIdType k = 0; k < glyphs.unit_shape->GetNumberOfPoints(); ++k) {
      Eigen::Vector3d corner(glyphs.unit_shape->GetPoint(k));
      if (is_edge) corner = kEdgeSize * corner - kEdgeBehind * Eigen::Vector3d::UnitZ();
      const Eigen::Vector3d at = placing * corner;
      moved->InsertNextPoint(at.data());
    }
    glyphs.placed_shape->SetPoints(moved);
    glyphs.mapper->Modified();
  }
}

ArrowLayer::ArrowLayer(vtkRenderer* renderer)
    : shaft_(makeGlyphs(renderer, unitShaft(), false)),
      head_(makeGlyphs(renderer, unitHead(), false)),
      shaft_edge_(makeGlyphs(renderer, unitShaft(), true)),
      head_edge_(makeGlyphs(renderer, unitHead(), true)) {}

vtkSmartPointer<vtkActor> ArrowLayer::makeGlyphs(vtkRenderer* renderer, vtkPolyData* shape, bool edge) {
  vtkNew<vtkGlyph3DMapper> mapper;
  mapper->SetInputData(vtkNew<vtkPolyData>());
  mapper->SetSourceData(shape);
  mapper->SetOrientationModeToDirection();
  mapper->SetOrientationArray("direction");
  mapper->SetScaleModeToScaleByVectorComponents();
  mapper->SetScaleArray("scale");
  if (edge) {
    mapper->ScalarVisibilityOff();
  } else {
    mapper->SetScalarModeToUsePointFieldData();
    mapper->SelectColorArray("color");
    mapper->SetColorModeToDirectScalars();
  }
  auto actor = vtkSmartPointer<vtkActor>::New();
  actor->SetMapper(mapper);
  actor->GetProperty()->LightingOff();
  // The edge is the far side of a slightly larger arrow: seen only where it looks out behind the arrow.
  if (edge) actor->GetProperty()->FrontfaceCullingOn();
  actor->VisibilityOff();
  renderer->AddActor(actor);
  return actor;
}

void ArrowLayer::place(vtkActor* glyphs, std::span<const Arrow> arrows, double shaft_radius_m, bool head,
                       double edge_share) {
  vtkNew<vtkPoints> points;
  vtkNew<vtkFloatArray> directions, scales;
  vtkNew<vtkUnsignedCharArray> colors;
  directions->SetName("direction");
  scales->SetName("scale");
  colors->SetName("color");
  directions->SetNumberOfComponents(3);
  scales->SetNumberOfComponents(3);
  colors->SetNumberOfComponents(4);
  for (const Arrow& arrow : arrows) {
    const double length = (arrow.to_m - arrow.from_m).norm();
    if (!(length > 0.0)) continue;
    const Eigen::Vector3d along = (arrow.to_m - arrow.from_m) / length;
    const double radius = shaft_radius_m * std::min(1.0, length / (kFullLength * shaft_radius_m));
    const double grow_m = edge_share * radius;
    const double head_length = std::min(kHeadShare * length, kHeadLength * radius);
    // A cone grown evenly reaches further at its tip than a cylinder does at its end.
    const double start = (head ? length - head_length : 0.0) - grow_m;
    const double reach = head ? head_length + 3.0 * grow_m : length - head_length + grow_m;
    const double width = (head ? kHeadRadius * radius : radius) + (head ? 1.6 : 1.0) * grow_m;
    const Eigen::Vector3d at = arrow.from_m + start * along;
    points->InsertNextPoint(at.data());
    directions->InsertNextTuple(along.data());
    scales->InsertNextTuple3(reach, width, width);
    colors->InsertNextTuple4(arrow.color.red(), arrow.color.green(), arrow.color.blue(), arrow.color.alpha());
  }
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  for (vtkDataArray* array :
       {static_cast<vtkDataArray*>(directions), static_cast<vtkDataArray*>(scales), static_cast<vtkDataArray*>(colors)})
    data->GetPointData()->AddArray(array);
  static_cast<vtkGlyph3DMapper*>(glyphs->GetMapper())->SetInputData(data);
  glyphs->SetVisibility(points->GetNumberOfPoints() > 0);
}

void ArrowLayer::setArrows(std::span<const Arrow> arrows, double shaft_radius_m) {
  place(shaft_, arrows, shaft_radius_m, false, 0.0);
  place(head_, arrows, shaft_radius_m, true, 0.0);
  const bool translucent =
      std::any_of(arrows.begin(), arrows.end(), [](const Arrow& arrow) { return arrow.color.alpha() < 255; });
  for (vtkActor* glyphs : {shaft_.Get(), head_.Get()}) {
    // Glyphs do not look at the alpha of their colours to tell whether they are translucent.
    glyphs->SetForceTranslucent(translucent);
    glyphs->SetForceOpaque(!translucent);
    glyphs->GetProperty()->SetBackfaceCulling(translucent);
  }
  const bool with_edge = arrows.size() <= kMostEdged && !translucent;
  const std::span<const Arrow> edged = with_edge ? arrows : std::span<const Arrow>();
  place(shaft_edge_, edged, shaft_radius_m, false, kEdgeShare);
  place(head_edge_, edged, shaft_radius_m, true, kEdgeShare);
}

void ArrowLayer::setEdge(const QColor& color) {
  for (vtkActor* glyphs : {shaft_edge_.Get(), head_edge_.Get()}) glyphs->GetProperty()->SetColor(rgb(color).data());
}

}  // namespace fieldtrue::widgets
