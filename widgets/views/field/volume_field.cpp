#include "widgets/views/field/volume_field.h"

#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/core/error.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kSquaresPerStep =
    4;  ///< A slice is drawn this much finer than the lattice, so that colours run smoothly.
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

vtkSmartPointer<vtkImageData> imageOf(const VolumeField& field) {
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(field.count.data());
  image->SetOrigin(field.low_m.data());
  image->SetSpacing(field.step_m.data());
  vtkNew<vtkFloatArray> values, known;
  values->SetName("value");
  known->SetName("known");
  for (const double value : field.values_mm) {
    values->InsertNextValue(std::isfinite(value) ? static_cast<float>(value) : 0.0F);
    known->InsertNextValue(std::isfinite(value) ? 1.0F : 0.0F);
  }
  image->GetPointData()->SetScalars(values);
  image->GetPointData()->AddArray(known);
  return image;
}

/// The triangles whose corners all lie between points that are known.
vtkSmartPointer<vtkPolyData> knownPart(vtkPolyData* surface) {
  constexpr double kKnown = 1.0 - 1e-4;
  vtkDataArray* known = surface->GetPointData()->GetArray("known");
  vtkNew<vtkCellArray> kept;
  vtkNew<vtkIdList> corners;
  vtkCellArray* triangles = surface->GetPolys();
  for (vtkIdType cell = 0; known != nullptr && cell < triangles->GetNumberOfCells(); ++cell) {
    triangles->GetCellAtId(cell, corners);
    bool all = true;
    for (vtkIdType k = 0; k < corners->GetNumberOfIds(); ++k)
      all = all && known->GetComponent(corners->GetId(k), 0) > kKnown;
    if (all) kept->InsertNextCell(corners);
  }
  auto part = vtkSmartPointer<vtkPolyData>::New();
  part->SetPoints(surface->GetPoints());
  part->GetPointData()->SetNormals(surface->GetPointData()->GetNormals());
  part->SetPolys(kept);
  return part;
}

/// Positions along one axis of the lattice, kSquaresPerStep a step.
std::vector<double> finePositions_m(const VolumeField& field, int axis) {
  const auto a = static_cast<std::size_t>(axis);
  std::vector<double> positions;
  const int n = (field.count[a] - 1) * kSquaresPerStep;
  for (int k = 0; k <= n; ++k)
    positions.push_back(field.low_m[axis] + field.step_m[axis] * k / static_cast<double>(kSquaresPerStep));
  return positions;
}

}  // namespace

std::size_t VolumeField::size() const {
  std::size_t product = 1;
  for (const int n : count) product *= static_cast<std::size_t>(std::max(0, n));
  return product;
}

Eigen::Vector3d VolumeField::point_m(std::size_t index) const {
  const auto nx = static_cast<std::size_t>(count[0]), ny = static_cast<std::size_t>(count[1]);
  const std::size_t layer = index / (nx * ny), row = index / nx % ny;
  const Eigen::Vector3d steps(static_cast<double>(index % nx), static_cast<double>(row), static_cast<double>(layer));
  return low_m + steps.cwiseProduct(step_m);
}

Eigen::Vector3d VolumeField::high_m() const {
  return low_m + Eigen::Vector3d(count[0] - 1, count[1] - 1, count[2] - 1).cwiseProduct(step_m);
}

double VolumeField::valueAt(const Eigen::Vector3d& at_m) const {
  if (empty()) return kNan;
  std::array<int, 3> cell{};
  std::array<double, 3> share{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const double along = (at_m[a] - low_m[a]) / step_m[a];
    constexpr double kSlack = 1e-9;
    if (!(along >= -kSlack && along <= count[axis] - 1 + kSlack)) return kNan;
    cell[axis] = std::clamp(static_cast<int>(std::floor(along)), 0, std::max(0, count[axis] - 2));
    share[axis] = std::clamp(along - cell[axis], 0.0, 1.0);
  }
  double value = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    std::array<std::size_t, 3> at{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const bool upper = (corner >> axis & 1) != 0;
      weight *= upper ? share[axis] : 1.0 - share[axis];
      at[axis] = static_cast<std::size_t>(cell[axis]) + (upper ? 1U : 0U);
    }
    if (weight <= 0.0) continue;
    const auto nx = static_cast<std::size_t>(count[0]), ny = static_cast<std::size_t>(count[1]);
    value += weight * values_mm[(at[2] * ny + at[1]) * nx + at[0]];
  }
  return value;
}

std::optional<double> VolumeField::largest_mm() const {
  std::optional<double> largest;
  for (const double value : values_mm)
    if (std::isfinite(value) && (!largest || value > *largest)) largest = value;
  return largest;
}

vtkSmartPointer<vtkPolyData> isoSurface(const VolumeField& field, double value_mm) {
  FT_CHECK(field.values_mm.size() == field.size());
  if (field.empty() || *std::min_element(field.count.begin(), field.count.end()) < 2)
    return vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkFlyingEdges3D> edges;
  edges->SetInputData(imageOf(field));
  edges->SetValue(0, value_mm);
  edges->ComputeNormalsOn();
  edges->InterpolateAttributesOn();
  edges->Update();
  return knownPart(edges->GetOutput());
}

vtkSmartPointer<vtkPolyData> sliceSurface(const VolumeField& field, const SlicePlane& plane,
                                          const std::function<QColor(double value_mm)>& color) {
  FT_CHECK(plane.axis >= 0 && plane.axis < 3 && field.values_mm.size() == field.size());
  auto surface = vtkSmartPointer<vtkPolyData>::New();
  if (field.empty()) return surface;
  const int u = (plane.axis + 1) % 3, v = (plane.axis + 2) % 3;
  const std::vector<double> us_m = finePositions_m(field, u), vs_m = finePositions_m(field, v);
  vtkNew<vtkPoints> points;
  vtkNew<vtkUnsignedCharArray> colors;
  colors->SetNumberOfComponents(3);
  std::vector<bool> known;
  for (const double v_m : vs_m) {
    for (const double u_m : us_m) {
      Eigen::Vector3d at_m;
      at_m[plane.axis] = plane.at_m;
      at_m[u] = u_m;
      at_m[v] = v_m;
      const double value = field.valueAt(at_m);
      points->InsertNextPoint(at_m.data());
      known.push_back(std::isfinite(value));
      const QColor shown = color(value);
      colors->InsertNextTuple3(shown.red(), shown.green(), shown.blue());
    }
  }
  vtkNew<vtkCellArray> squares;
  const auto row = static_cast<vtkIdType>(us_m.size());
  for (vtkIdType j = 0; j + 1 < static_cast<vtkIdType>(vs_m.size()); ++j)
    for (vtkIdType i = 0; i + 1 < row; ++i) {
      const std::array<vtkIdType, 4> corners = {j * row + i, j * row + i + 1, (j + 1) * row + i + 1, (j + 1) * row + i};
      if (std::all_of(corners.begin(), corners.end(), [&](vtkIdType k) { return known[static_cast<std::size_t>(k)]; }))
        squares->InsertNextCell(4, corners.data());
    }
  surface->SetPoints(points);
  surface->SetPolys(squares);
  surface->GetPointData()->SetScalars(colors);
  return surface;
}

}  // namespace fieldtrue::widgets
