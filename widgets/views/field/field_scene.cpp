#include "widgets/views/field/field_scene.h"

#include <vtkActor.h>
#include <vtkPolyData.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/core/error.h"
#include "calib/core/number_text.h"
#include "calib/core/units.h"
#include "widgets/style/color_scale.h"
#include "widgets/style/units.h"
#include "widgets/views/host/mesh.h"
#include "widgets/views/host/projection.h"

namespace fieldtrue::widgets {
namespace {

constexpr double kShaftRadius = 0.022;  ///< Of the pitch, as all of these.
constexpr double kPlaceRadius = 0.035;
constexpr double kArcInner = 0.17;
constexpr double kArcOuter = 0.27;
constexpr double kNeedleRadius = 0.008;
constexpr double kLargestArc_rad = 1.9 * std::numbers::pi;
constexpr double kArcStep_rad = 10.0 * kRadPerDeg;

double length_mm(const FieldArrow& arrow) { return 1000.0 * arrow.error_m.norm(); }

}  // namespace

FieldScene::FieldScene(vtkRenderer* renderer)
    : renderer_(renderer),
      box_(renderer),
      transmitter_part_(renderer),
      places_(renderer, Symbol::kDot),
      validation_(renderer, Symbol::kSquare),
      flagged_(renderer, Symbol::kDiamond),
      halo_(renderer, Symbol::kThickCircle),
      arrows_(renderer),
      arcs_(addFlatActor(renderer)),
      holes_part_(renderer),
      slice_part_(renderer),
      iso_part_(renderer),
      folds_part_(renderer),
      bodies_part_(renderer),
      overlay_(addOverlay(renderer)) {}

void FieldScene::setField(const ErrorField& field) {
  field_ = field;
  hovered_.reset();
  std::vector<Eigen::Vector3d> points;
  points.reserve(field.arrows.size());
  for (const FieldArrow& arrow : field.arrows) points.push_back(arrow.from_m);
  space_ = withBodies(spaceAround(points, field.reference_from_tracker), field.bodies);
  changed_ = true;
}

void FieldScene::setScaleMax_mm(double scale_max_mm) {
  FT_CHECK(scale_max_mm > 0.0);
  scale_max_mm_ = scale_max_mm;
  changed_ = true;
}

void FieldScene::setMagnification(double magnification) {
  FT_CHECK(magnification > 0.0);
  magnification_ = magnification;
  changed_ = true;
}

void FieldScene::setShowOrientation(bool show) {
  show_orientation_ = show;
  arcs_changed_ = overlay_changed_ = true;
}

void FieldScene::setAngleScaleMax_deg(double scale_max_deg) {
  FT_CHECK(scale_max_deg > 0.0);
  angle_scale_max_deg_ = scale_max_deg;
  arcs_changed_ = overlay_changed_ = true;
}

void FieldScene::setSelected(std::optional<int> node) {
  selected_ = node;
  changed_ = true;
}

void FieldScene::setHovered(std::optional<int> index) {
  hovered_ = index;
  overlay_changed_ = true;
}

void FieldScene::setUnit(LengthUnit unit) {
  overlay_->content.unit = unit;
  overlay_changed_ = true;
}

void FieldScene::setVolume(const VolumeField& volume) {
  volume_ = volume;
  volume_changed_ = true;
}

void FieldScene::setSlice(const std::optional<SlicePlane>& plane) {
  slice_ = plane;
  volume_changed_ = true;
}

void FieldScene::setIso(const std::optional<double>& value_mm) {
  iso_mm_ = value_mm;
  volume_changed_ = true;
}

void FieldScene::setHoles(const std::vector<SceneCell>& holes) {
  holes_ = holes;
  volume_changed_ = true;
}

void FieldScene::setFolds(const std::vector<SceneCell>& cells) {
  folds_ = cells;
  volume_changed_ = overlay_changed_ = true;
}

void FieldScene::setOpacityRange(const std::optional<OpacityRange>& range) {
  opacity_ = range;
  changed_ = true;
}

void FieldScene::setLegendShown(bool shown) {
  legend_shown_ = shown;
  overlay_changed_ = true;
}

void FieldScene::setStyle(const Theme& theme, double ratio) {
  theme_ = &theme;
  ratio_ = ratio;
  changed_ = true;
}

bool FieldScene::arcsShown() const {
  return show_orientation_ && std::any_of(field_.arrows.begin(), field_.arrows.end(),
                                          [](const FieldArrow& arrow) { return arrow.angle_deg.has_value(); });
}

double FieldScene::angleScaleMax_deg() const {
  if (angle_scale_max_deg_) return *angle_scale_max_deg_;
  double largest = 0.0;
  for (const FieldArrow& arrow : field_.arrows) largest = std::max(largest, arrow.angle_deg.value_or(0.0));
  return largest > 0.0 ? largest : 1.0;
}

QMargins FieldScene::legendMargins(bool legend_shown) {
  return legend_shown ? QMargins{64, 44, 116, 52} : QMargins{58, 24, 24, 48};
}

void FieldScene::update() {
  if (changed_) {
    renderer_->SetBackground(rgb(theme_->background).data());
    box_.build(space_, *theme_, ratio_);
    transmitter_part_.build(field_.reference_from_tracker, space_, *theme_);
    updateMarks();
    updateArrows();
    bodies_part_.build(field_.bodies, space_, *theme_, ratio_);
    arcs_changed_ = true;
  }
  if (changed_ || volume_changed_) updateVolume();
  if (changed_ || overlay_changed_) updateOverlay();
  changed_ = volume_changed_ = overlay_changed_ = false;
}

void FieldScene::updateVolume() {
  slice_part_.build(volume_, slice_, scale_max_mm_, *theme_, ratio_);
  iso_part_.build(volume_, iso_mm_, scale_max_mm_);
  holes_part_.build(holes_, *theme_);
  folds_part_.build(folds_, *theme_, ratio_);
}

QColor FieldScene::colorOf(const FieldArrow& arrow) const {
  QColor color = arrow.better_mm ? differenceColor(*arrow.better_mm / scale_max_mm_)
                                 : magnitudeColor(length_mm(arrow) / scale_max_mm_);
  if (opacity_ && arrow.uncertainty_mm)
    color.setAlpha(static_cast<int>(std::lround(255.0 * opacityOf(*arrow.uncertainty_mm, *opacity_))));
  return color;
}

void FieldScene::updateArrows() {
  std::vector<ArrowLayer::Arrow> arrows;
  arrows.reserve(field_.arrows.size());
  for (const FieldArrow& arrow : field_.arrows)
    if (arrow.error_m.allFinite())
      arrows.push_back({arrow.from_m, arrow.from_m + magnification_ * arrow.error_m, colorOf(arrow)});
  const double pitch = space_.pitch_m.minCoeff();
  arrows_.setEdge(theme_->dark ? theme_->text_muted : theme_->text);
  arrows_.setArrows(arrows, kShaftRadius * pitch);
}

void FieldScene::updateMarks() {
  std::vector<Eigen::Vector3d> fitted, validation, flagged, selected;
  for (const FieldArrow& arrow : field_.arrows) {
    (arrow.flagged ? flagged : arrow.validation ? validation : fitted).push_back(arrow.from_m);
    if (selected_ == arrow.node) selected.push_back(arrow.from_m);
  }
  const double pitch = space_.pitch_m.minCoeff();
  places_.setColor(theme_->text_muted);
  places_.setRadius(kPlaceRadius * pitch);
  places_.setPoints(fitted);
  validation_.setColor(theme_->text);
  validation_.setRadius(1.9 * kPlaceRadius * pitch);
  validation_.setPoints(validation);
  flagged_.setColor(theme_->attention);
  flagged_.setRadius(2.4 * kPlaceRadius * pitch);
  flagged_.setPoints(flagged);
  halo_.setColor(theme_->accent);
  halo_.setRadius(0.16 * pitch);
  halo_.setPoints(selected);
}

void FieldScene::updateArcs(const Eigen::Matrix3d& world_from_view) {
  Mesh mesh;
  if (arcsShown()) {
    const double pitch = space_.pitch_m.minCoeff();
    const double maximum_deg = angleScaleMax_deg();
    for (const FieldArrow& arrow : field_.arrows) {
      if (!arrow.angle_deg || !std::isfinite(*arrow.angle_deg)) continue;
      const double angle_rad = std::min(kLargestArc_rad, magnification_ * *arrow.angle_deg * kRadPerDeg);
      const int steps = std::max(1, static_cast<int>(std::ceil(angle_rad / kArcStep_rad)));
      mesh.setColor(magnitudeColor(*arrow.angle_deg / maximum_deg));
      mesh.addSector(arrow.from_m, world_from_view.col(0), world_from_view.col(1), kArcInner * pitch, kArcOuter * pitch,
                     0.0, angle_rad, steps);
      if (!arrow.rotation_axis || !(arrow.rotation_axis->norm() > 0.0)) continue;
      const Eigen::Vector3d half = kArcOuter * pitch * arrow.rotation_axis->normalized();
      mesh.setColor(theme_->text_muted);
      mesh.addCylinder(arrow.from_m - half, arrow.from_m + half, kNeedleRadius * pitch, 6);
    }
  }
  setShape(arcs_, mesh.polyData());
}

void FieldScene::faceCamera() {
  const Eigen::Matrix3d world_from_view = worldFromView(renderer_);
  for (MarkLayer* layer : {&places_, &validation_, &flagged_, &halo_}) layer->face(world_from_view);
  if (!arcs_changed_ && (!show_orientation_ || world_from_view == arcs_view_)) return;
  updateArcs(world_from_view);
  arcs_view_ = world_from_view;
  arcs_changed_ = false;
}

void FieldScene::updateOverlay() {
  OverlayContent& content = overlay_->content;
  content.theme = theme_;
  content.ratio = ratio_;
  content.title = field_.title.toStdString();
  content.axes = space_;
  content.labels = transmitter_part_.labels();
  for (const SceneLabel& label : folds_part_.labels()) content.labels.push_back(label);
  for (const SceneLabel& label : bodies_part_.labels()) content.labels.push_back(label);
  const auto exceeds = [this](const FieldArrow& arrow) { return length_mm(arrow) > scale_max_mm_ * (1.0 + 1e-9); };
  const bool exceeded = std::any_of(field_.arrows.begin(), field_.arrows.end(), exceeds);
  const std::string times = "\xC3\x97" + shortNumber(magnification_);
  content.scales = {{"error (mm)", scale_max_mm_, exceeded, "arrows " + times}};
  if (arcsShown()) {
    const double maximum = angleScaleMax_deg();
    const bool wide = std::any_of(field_.arrows.begin(), field_.arrows.end(), [&](const FieldArrow& arrow) {
      return arrow.angle_deg.value_or(0.0) > maximum * (1.0 + 1e-9);
    });
    content.scales.push_back({"turn (\xC2\xB0)", maximum, wide, "arcs " + times});
  }
  if (!legend_shown_) content.scales.clear();
  content.symbols.clear();
  if (std::any_of(field_.arrows.begin(), field_.arrows.end(), [](const FieldArrow& arrow) { return arrow.validation; }))
    content.symbols = {{Symbol::kDot, theme_->text_muted, "fit"}, {Symbol::kSquare, theme_->text, "validation"}};
  if (std::any_of(field_.arrows.begin(), field_.arrows.end(), [](const FieldArrow& arrow) { return arrow.flagged; }))
    content.symbols = {{Symbol::kDot, theme_->text_muted, "within noise"},
                       {Symbol::kDiamond, theme_->attention, "beyond noise"}};
  content.bubble.clear();
  if (!hovered_) return;
  content.bubble = describe(static_cast<std::size_t>(*hovered_));
  content.bubble_at_m = field_.arrows[static_cast<std::size_t>(*hovered_)].from_m;
}

std::vector<std::string> FieldScene::describe(std::size_t index) const {
  const FieldArrow& arrow = field_.arrows.at(index);
  const QString name = arrow.name.isEmpty() ? QStringLiteral("P%1").arg(arrow.node) : arrow.name;
  const auto millimetres = [](double metres) { return formatLength(metres, LengthUnit::kMillimetre).toStdString(); };
  std::vector<std::string> lines = {name.toStdString() + (arrow.validation ? " (validation)"
                                                          : arrow.flagged  ? " (beyond noise)"
                                                                           : ""),
                                    (arrow.better_mm ? "difference " : "error ") + millimetres(arrow.error_m.norm())};
  if (arrow.error_m.allFinite())
    lines.push_back("x " + millimetres(arrow.error_m.x()) + "   y " + millimetres(arrow.error_m.y()) + "   z " +
                    millimetres(arrow.error_m.z()));
  if (arrow.better_mm)
    lines.push_back((*arrow.better_mm < 0.0 ? "A is better by " : "B is better by ") +
                    millimetres(std::abs(*arrow.better_mm) / 1000.0));
  if (arrow.uncertainty_mm) lines.push_back("SD " + millimetres(*arrow.uncertainty_mm / 1000.0));
  if (arrow.angle_deg) lines.push_back("turn " + shortNumber(*arrow.angle_deg) + "\xC2\xB0");
  return lines;
}

}  // namespace fieldtrue::widgets
