#include "widgets/views/field/field_view.h"

#include "widgets/style/unit_texts.h"
#include "widgets/views/field/field_scene.h"

namespace fieldtrue::widgets {
namespace {

constexpr std::size_t kMostSmooth = 2000;  ///< Arrows drawn with smooth edges where no graphics processor helps.

}  // namespace

FieldView::FieldView(QWidget* parent) : OrbitView(parent), scene_(std::make_unique<FieldScene>(renderer())) {
  setAccessibleName(tr("Error at every place"));
}

FieldView::~FieldView() = default;

void FieldView::setField(const ErrorField& field) {
  scene_->setField(field);
  setSmooth(field.arrows.size() <= kMostSmooth);
  setAccessibleDescription(field.title);
  setSpace(scene_->space());
}

const ErrorField& FieldView::field() const { return scene_->field(); }

void FieldView::setScaleMax_mm(double scale_max_mm) {
  scene_->setScaleMax_mm(scale_max_mm);
  requestRender();
}

void FieldView::setMagnification(double magnification) {
  scene_->setMagnification(magnification);
  requestRender();
}

void FieldView::setShowOrientation(bool show) {
  scene_->setShowOrientation(show);
  requestRender();
}

void FieldView::setAngleScaleMax_deg(double scale_max_deg) {
  scene_->setAngleScaleMax_deg(scale_max_deg);
  requestRender();
}

void FieldView::setSelected(std::optional<int> node) {
  scene_->setSelected(node);
  requestRender();
}

void FieldView::setVolume(const VolumeField& volume) {
  scene_->setVolume(volume);
  requestRender();
}

void FieldView::setSlice(const std::optional<SlicePlane>& plane) {
  scene_->setSlice(plane);
  requestRender();
}

void FieldView::setIso(const std::optional<double>& value_mm) {
  scene_->setIso(value_mm);
  requestRender();
}

void FieldView::setHoles(const std::vector<SceneCell>& holes) {
  scene_->setHoles(holes);
  requestRender();
}

void FieldView::setFolds(const std::vector<SceneCell>& cells) {
  scene_->setFolds(cells);
  requestRender();
}

void FieldView::setOpacityRange(const std::optional<OpacityRange>& range) {
  scene_->setOpacityRange(range);
  requestRender();
}

void FieldView::setLegendShown(bool shown) {
  scene_->setLegendShown(shown);
  requestRender();
}

void FieldView::restyle(double pixel_ratio) {
  scene_->setStyle(theme(), pixel_ratio);
  scene_->setUnit(placingUnit());
}

void FieldView::prepareFrame() {
  scene_->update();
  scene_->faceCamera();
  OrbitView::prepareFrame();
}

QMargins FieldView::legendMargins() const { return FieldScene::legendMargins(scene_->legendShown()); }

std::vector<Eigen::Vector3d> FieldView::pickPoints_m() const {
  std::vector<Eigen::Vector3d> points;
  points.reserve(scene_->field().arrows.size());
  for (const FieldArrow& arrow : scene_->field().arrows) points.push_back(arrow.from_m);
  return points;
}

void FieldView::pointHovered(std::optional<int> index) {
  scene_->setHovered(index);
  requestRender();
  if (!index) {
    emit nodeHovered(-1, {});
    return;
  }
  QStringList lines;
  for (const std::string& line : scene_->describe(static_cast<std::size_t>(*index)))
    lines << QString::fromStdString(line);
  emit nodeHovered(scene_->field().arrows[static_cast<std::size_t>(*index)].node, lines.join(QStringLiteral(", ")));
}

void FieldView::pointClicked(int index) {
  emit nodeClicked(scene_->field().arrows[static_cast<std::size_t>(index)].node);
}

}  // namespace fieldtrue::widgets
