#pragma once

#include <vtkSmartPointer.h>

#include <span>

#include "widgets/views/field/volume_field.h"
#include "widgets/views/room/room_parts.h"

namespace fieldtrue::widgets {

/// A plane through a volume, coloured by its values, with its edge drawn around it.
class SlicePart {
 public:
  explicit SlicePart(vtkRenderer* renderer);
  void build(const VolumeField& field, const std::optional<SlicePlane>& plane, double scale_max_mm, const Theme& theme,
             double ratio);

 private:
  vtkSmartPointer<vtkActor> surface_, edge_;
};

/// A translucent surface of one value in the colour of that value.
class IsoPart {
 public:
  explicit IsoPart(vtkRenderer* renderer);
  void build(const VolumeField& field, const std::optional<double>& value_mm, double scale_max_mm);

 private:
  vtkSmartPointer<vtkActor> surface_;
};

/// Where no place is near: translucent balls of that radius.
class HolePart {
 public:
  explicit HolePart(vtkRenderer* renderer);
  void build(std::span<const SceneCell> holes, const Theme& theme);

 private:
  vtkSmartPointer<vtkActor> balls_;
};

/// Where the map is not one-to-one: cubes drawn by their edges, each with its name.
class FoldPart {
 public:
  explicit FoldPart(vtkRenderer* renderer);
  void build(std::span<const SceneCell> cells, const Theme& theme, double ratio);
  std::vector<SceneLabel> labels() const { return labels_; }

 private:
  vtkSmartPointer<vtkActor> edges_;
  std::vector<SceneLabel> labels_;
};

}  // namespace fieldtrue::widgets
