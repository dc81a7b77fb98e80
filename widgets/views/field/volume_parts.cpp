#include "widgets/views/field/volume_parts.h"

#include <vtkActor.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include "widgets/style/color_scale.h"
#include "widgets/views/host/mesh.h"

namespace fieldtrue::widgets {
namespace {

constexpr double kIsoOpacity = 0.45;
constexpr double kHoleOpacity = 0.28;
constexpr double kEdgeWidth_px = 2.5;
constexpr std::size_t kMostNamed = 12;

void addBoxEdges(Lines& lines, const Eigen::Vector3d& center_m, double half_m) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 4; ++side) {
      Eigen::Vector3d from = center_m;
      from[axis] -= half_m;
      from[(axis + 1) % 3] += (side & 1) ? half_m : -half_m;
      from[(axis + 2) % 3] += (side & 2) ? half_m : -half_m;
      Eigen::Vector3d to = from;
      to[axis] += 2.0 * half_m;
      lines.add(from, to);
    }
  }
}

/// The rectangle a plane cuts out of the lattice.
Lines planeEdge(const VolumeField& field, const SlicePlane& plane) {
  const int u = (plane.axis + 1) % 3, v = (plane.axis + 2) % 3;
  const Eigen::Vector3d high_m = field.high_m();
  const auto corner = [&](bool far_u, bool far_v) {
    Eigen::Vector3d at_m;
    at_m[plane.axis] = plane.at_m;
    at_m[u] = (far_u ? high_m : field.low_m)[u];
    at_m[v] = (far_v ? high_m : field.low_m)[v];
    return at_m;
  };
  Lines lines;
  lines.add(corner(false, false), corner(true, false));
  lines.add(corner(true, false), corner(true, true));
  lines.add(corner(true, true), corner(false, true));
  lines.add(corner(false, true), corner(false, false));
  return lines;
}

}  // namespace

SlicePart::SlicePart(vtkRenderer* renderer) : surface_(addFlatActor(renderer)), edge_(addFlatActor(renderer)) {}

void SlicePart::build(const VolumeField& field, const std::optional<SlicePlane>& plane, double scale_max_mm,
                      const Theme& theme, double ratio) {
  const auto empty = vtkSmartPointer<vtkPolyData>::New();
  if (field.empty() || !plane) {
    setShape(surface_, empty);
    setShape(edge_, empty);
    return;
  }
  const auto color = [scale_max_mm](double value_mm) { return magnitudeColor(value_mm / scale_max_mm); };
  setShape(surface_, sliceSurface(field, *plane, color));
  setShape(edge_, planeEdge(field, *plane).polyData());
  edge_->GetProperty()->SetColor(rgb(theme.accent).data());
  edge_->GetProperty()->SetLineWidth(static_cast<float>(1.5 * ratio));
}

IsoPart::IsoPart(vtkRenderer* renderer) : surface_(addSolidActor(renderer)) {
  surface_->GetProperty()->SetOpacity(kIsoOpacity);
}

void IsoPart::build(const VolumeField& field, const std::optional<double>& value_mm, double scale_max_mm) {
  if (field.empty() || !value_mm) {
    setShape(surface_, vtkSmartPointer<vtkPolyData>::New());
    return;
  }
  surface_->GetProperty()->SetColor(rgb(magnitudeColor(*value_mm / scale_max_mm)).data());
  setShape(surface_, isoSurface(field, *value_mm));
}

HolePart::HolePart(vtkRenderer* renderer) : balls_(addSolidActor(renderer)) {
  balls_->GetProperty()->SetOpacity(kHoleOpacity);
}

void HolePart::build(std::span<const SceneCell> holes, const Theme& theme) {
  Mesh mesh;
  for (const SceneCell& hole : holes) mesh.addBall(hole.center_m, hole.size_m);
  balls_->GetProperty()->SetColor(rgb(theme.attention).data());
  setShape(balls_, mesh.polyData());
}

FoldPart::FoldPart(vtkRenderer* renderer) : edges_(addFlatActor(renderer)) {}

void FoldPart::build(std::span<const SceneCell> cells, const Theme& theme, double ratio) {
  Lines lines;
  labels_.clear();
  for (std::size_t k = 0; k < cells.size(); ++k) {
    addBoxEdges(lines, cells[k].center_m, 0.5 * cells[k].size_m);
    if (k < kMostNamed) labels_.push_back({cells[k].center_m, "fold " + std::to_string(k + 1), theme.attention, 0.0});
  }
  edges_->GetProperty()->SetColor(rgb(theme.attention).data());
  edges_->GetProperty()->SetLineWidth(static_cast<float>(kEdgeWidth_px * ratio));
  setShape(edges_, lines.polyData());
}

}  // namespace fieldtrue::widgets
