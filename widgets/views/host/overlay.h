#pragma once

#include <vtkContextItem.h>

#include <Eigen/Core>
#include <QColor>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "widgets/figures/scene_space.h"
#include "widgets/style/theme.h"
#include "widgets/style/units.h"
#include "widgets/views/host/glyph_layers.h"

namespace fieldtrue::widgets {

/// A colour scale with its unit, drawn as a bar.
struct ScaleLegend {
  std::string title;  ///< "error (mm)"
  double maximum = 1.0;
  bool exceeded = false;  ///< Something shown is larger than the scale's end.
  std::string note;       ///< Below the bar: "arrows x10".
};

struct SymbolLegend {
  Symbol symbol = Symbol::kDot;
  QColor color;
  std::string text;
};

struct SceneLabel {
  Eigen::Vector3d at_m;
  std::string text;
  QColor color;
  double below_m = 0.0;  ///< The text stands this far below the point, as seen on screen.
};

/// All text and legends of a scene.
struct OverlayContent {
  const Theme* theme = &Theme::of(false);
  double ratio = 1.0;  ///< Device pixels per logical pixel.
  std::string title;
  std::optional<SceneSpace> axes;  ///< Tick labels along its edges, in `unit`.
  LengthUnit unit = LengthUnit::kMetre;
  std::vector<SceneLabel> labels;
  std::vector<ScaleLegend> scales;
  std::vector<SymbolLegend> symbols;
  std::vector<std::string> bubble;  ///< Lines of the note at `bubble_at_m`.
  Eigen::Vector3d bubble_at_m = Eigen::Vector3d::Zero();
};

/// Draws an OverlayContent above the scene of its renderer.
class Overlay : public vtkContextItem {
 public:
  static Overlay* New();
  bool Paint(vtkContext2D* painter) override;
  OverlayContent content;

 protected:
  Overlay() = default;
};

/// An overlay drawn on top of a renderer's scene.
vtkSmartPointer<Overlay> addOverlay(vtkRenderer* renderer);

/// Round values from 0 to `maximum`, and `maximum` itself last.
std::vector<double> scaleTicks(double maximum);

}  // namespace fieldtrue::widgets
