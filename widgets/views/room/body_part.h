#pragma once

#include <vtkSmartPointer.h>

#include <span>

#include "widgets/figures/believed_body.h"
#include "widgets/views/room/room_parts.h"

namespace fieldtrue::widgets {

/// The space enlarged so that bodies stand inside it; those far away only stretch it by its own size.
SceneSpace withBodies(SceneSpace space, std::span<const BelievedBody> bodies);

/// Bodies as translucent solids, and around each the outline of where else it may be.
class BodyPart {
 public:
  explicit BodyPart(vtkRenderer* renderer);
  void build(std::span<const BelievedBody> bodies, const SceneSpace& space, const Theme& theme, double ratio);
  std::vector<SceneLabel> labels() const { return labels_; }

 private:
  vtkSmartPointer<vtkActor> solids_, regions_, outlines_;
  std::vector<SceneLabel> labels_;
};

}  // namespace fieldtrue::widgets
