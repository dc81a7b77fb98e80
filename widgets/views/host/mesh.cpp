#include "widgets/views/host/mesh.h"

#include <vtkActor.h>
#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace fieldtrue::widgets {
namespace {

constexpr double kSolidHeadShare = 0.35;
constexpr double kSolidHeadLength = 7.0;  ///< Shaft radii.
constexpr double kSolidHeadRadius = 2.6;  ///< Shaft radii.

Eigen::Vector3d onCircle(const std::array<Eigen::Vector3d, 2>& uv, double angle_rad) {
  return std::cos(angle_rad) * uv[0] + std::sin(angle_rad) * uv[1];
}

double sideAngle_rad(int side, int sides) { return 2.0 * std::numbers::pi * side / sides; }

}  // namespace

std::array<Eigen::Vector3d, 2> across(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d helper =
      std::abs(direction.z()) < 0.9 * direction.norm() ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitX();
  const Eigen::Vector3d u = helper.cross(direction).normalized();
  return {u, direction.cross(u).normalized()};
}

void Mesh::add(const Corner& a, const Corner& b, const Corner& c) {
  for (const Corner& corner : {a, b, c}) {
    points_.push_back(corner);
    if (color_) colors_.push_back(*color_);
  }
}

void Mesh::addTriangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                       const Eigen::Vector3d& normal) {
  add({a, normal}, {b, normal}, {c, normal});
}

void Mesh::addBox(const Pose& at, const Eigen::Vector3d& half_size_m) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector3d normal = side * Eigen::Vector3d::Unit(axis);
      const Eigen::Vector3d u = Eigen::Vector3d::Unit((axis + 1) % 3), v = normal.cross(u);
      const auto corner = [&](double a, double b) {
        const Eigen::Vector3d unit = normal + a * u + b * v;
        return Eigen::Vector3d(at * Eigen::Vector3d(unit.cwiseProduct(half_size_m)));
      };
      const Eigen::Vector3d turned = at.orientation * normal;
      addTriangle(corner(-1, -1), corner(1, -1), corner(1, 1), turned);
      addTriangle(corner(-1, -1), corner(1, 1), corner(-1, 1), turned);
    }
  }
}

void Mesh::addCylinder(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius_m, int sides) {
  const Eigen::Vector3d axis = (to - from).normalized();
  const auto uv = across(axis);
  for (int side = 0; side < sides; ++side) {
    const Eigen::Vector3d n0 = onCircle(uv, sideAngle_rad(side, sides)),
                          n1 = onCircle(uv, sideAngle_rad(side + 1, sides));
    const Eigen::Vector3d r0 = radius_m * n0, r1 = radius_m * n1;
    add({from + r0, n0}, {from + r1, n1}, {to + r1, n1});
    add({from + r0, n0}, {to + r1, n1}, {to + r0, n0});
    addTriangle(to, to + r0, to + r1, axis);
    addTriangle(from, from + r1, from + r0, -axis);
  }
}

void Mesh::addCone(const Eigen::Vector3d& base, const Eigen::Vector3d& tip, double radius_m, int sides) {
  const double length = (tip - base).norm();
  const Eigen::Vector3d axis = (tip - base) / length;
  const auto uv = across(axis);
  for (int side = 0; side < sides; ++side) {
    const Eigen::Vector3d d0 = onCircle(uv, sideAngle_rad(side, sides)),
                          d1 = onCircle(uv, sideAngle_rad(side + 1, sides));
    const Eigen::Vector3d n0 = (length * d0 + radius_m * axis).normalized(),
                          n1 = (length * d1 + radius_m * axis).normalized();
    add({base + radius_m * d0, n0}, {base + radius_m * d1, n1}, {tip, (n0 + n1).normalized()});
    addTriangle(base, base + radius_m * d1, base + radius_m * d0, -axis);
  }
}

void Mesh::addArrow(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double shaft_radius_m) {
  const double length = (to - from).norm();
  if (length <= 0.0) return;
  const double head = std::min(kSolidHeadShare * length, kSolidHeadLength * shaft_radius_m);
  const Eigen::Vector3d neck = to - head * (to - from) / length;
  addCylinder(from, neck, shaft_radius_m);
  addCone(neck, to, kSolidHeadRadius * shaft_radius_m);
}

void Mesh::addBall(const Eigen::Vector3d& center, double radius_m, int sides) {
  const int rings = sides / 2;
  const auto corner = [&](int ring, int side) {
    const double polar_rad = std::numbers::pi * ring / rings, around_rad = sideAngle_rad(side, sides);
    const Eigen::Vector3d normal(std::sin(polar_rad) * std::cos(around_rad), std::sin(polar_rad) * std::sin(around_rad),
                                 std::cos(polar_rad));
    return Corner{center + radius_m * normal, normal};
  };
  for (int ring = 0; ring < rings; ++ring) {
    for (int side = 0; side < sides; ++side) {
      const Corner a = corner(ring, side), b = corner(ring, side + 1);
      const Corner c = corner(ring + 1, side + 1), d = corner(ring + 1, side);
      if (ring > 0) add(a, d, b);
      if (ring + 1 < rings) add(b, d, c);
    }
  }
}

void Mesh::addSector(const Eigen::Vector3d& center, const Eigen::Vector3d& u, const Eigen::Vector3d& v, double inner_m,
                     double outer_m, double from_rad, double to_rad, int steps) {
  const Eigen::Vector3d normal = u.cross(v);
  for (int step = 0; step < steps; ++step) {
    const Eigen::Vector3d d0 = onCircle({u, v}, from_rad + (to_rad - from_rad) * step / steps);
    const Eigen::Vector3d d1 = onCircle({u, v}, from_rad + (to_rad - from_rad) * (step + 1) / steps);
    addTriangle(center + inner_m * d0, center + outer_m * d0, center + outer_m * d1, normal);
    if (inner_m > 0.0) addTriangle(center + inner_m * d0, center + outer_m * d1, center + inner_m * d1, normal);
  }
}

vtkSmartPointer<vtkPolyData> Mesh::polyData() const {
  vtkNew<vtkPoints> points;
  vtkNew<vtkFloatArray> normals;
  vtkNew<vtkUnsignedCharArray> colors;
  vtkNew<vtkCellArray> triangles;
  normals->SetNumberOfComponents(3);
  colors->SetNumberOfComponents(3);
  points->Allocate(static_cast<vtkIdType>(points_.size()));
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const vtkIdType id = points->InsertNextPoint(points_[k].at.data());
    normals->InsertNextTuple(points_[k].normal.data());
    if (k % 3 == 2) triangles->InsertNextCell({id - 2, id - 1, id});
    if (!colors_.empty()) colors->InsertNextTuple3(colors_[k].red(), colors_[k].green(), colors_[k].blue());
  }
  auto shape = vtkSmartPointer<vtkPolyData>::New();
  shape->SetPoints(points);
  shape->SetPolys(triangles);
  shape->GetPointData()->SetNormals(normals);
  if (!colors_.empty()) shape->GetPointData()->SetScalars(colors);
  return shape;
}

void Lines::add(const Eigen::Vector3d& from, const Eigen::Vector3d& to) { lines_.push_back({from, to}); }

vtkSmartPointer<vtkPolyData> Lines::polyData() const {
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> cells;
  for (const auto& [from, to] : lines_) {
    const vtkIdType first = points->InsertNextPoint(from.data());
    cells->InsertNextCell({first, points->InsertNextPoint(to.data())});
  }
  auto shape = vtkSmartPointer<vtkPolyData>::New();
  shape->SetPoints(points);
  shape->SetLines(cells);
  return shape;
}

std::array<double, 3> rgb(const QColor& color) { return {color.redF(), color.greenF(), color.blueF()}; }

vtkSmartPointer<vtkActor> addFlatActor(vtkRenderer* renderer) {
  auto actor = addSolidActor(renderer);
  actor->GetProperty()->LightingOff();
  actor->GetProperty()->SetAmbient(0.0);
  actor->GetProperty()->SetDiffuse(1.0);
  return actor;
}

vtkSmartPointer<vtkActor> addSolidActor(vtkRenderer* renderer) {
  auto actor = vtkSmartPointer<vtkActor>::New();
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetColorModeToDirectScalars();
  actor->SetMapper(mapper);
  actor->GetProperty()->SetAmbient(0.35);
  actor->GetProperty()->SetDiffuse(0.7);
  setShape(actor, vtkNew<vtkPolyData>());
  renderer->AddActor(actor);
  return actor;
}

void setShape(vtkActor* actor, vtkPolyData* shape) {
  static_cast<vtkPolyDataMapper*>(actor->GetMapper())->SetInputData(shape);
  actor->SetVisibility(shape->GetNumberOfPoints() > 0);
}

}  // namespace fieldtrue::widgets
