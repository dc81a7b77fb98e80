#include "widgets/views/host/orbit_view.h"

#include <vtkCamera.h>
#include <vtkCommand.h>
#include <vtkRenderer.h>

#include <QKeyEvent>
#include <QMouseEvent>
#include <QVariantAnimation>
#include <QWheelEvent>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "widgets/views/host/projection.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kEase_ms = 240;
constexpr double kTurnPerPixel_rad = 0.0065;
constexpr double kTurnPerKey_rad = 0.13;
constexpr double kZoomPerKey = 1.15;
constexpr double kPickRadius_px = 14.0;
constexpr double kClickSlack_px = 4.0;
constexpr double kSteepest_rad = 0.5 * std::numbers::pi;

}  // namespace

OrbitView::OrbitView(QWidget* parent) : VtkHost(parent) {
  easing_ = new QVariantAnimation(this);
  easing_->setDuration(kEase_ms);
  easing_->setEasingCurve(QEasingCurve::InOutCubic);
  easing_->setStartValue(0.0);
  easing_->setEndValue(1.0);
  connect(easing_, &QVariantAnimation::valueChanged, this,
          [this](const QVariant& t) { apply(interpolate(ease_from_, ease_to_, t.toDouble()), camera_); });
  camera_ = vtkSmartPointer<vtkCamera>::New();
  observeCamera(camera_);
}

OrbitView::~OrbitView() { camera_->RemoveObserver(camera_observer_); }

void OrbitView::setCamera(Camera preset) {
  preset_ = preset;
  placed_by_user_ = false;
  ease_from_ = cameraPose();
  ease_to_ = presetPose(preset, space_, frame());
  easing_->stop();
  if (isVisible())
    easing_->start();
  else
    apply(ease_to_, camera_);
}

CameraPose OrbitView::cameraPose() const { return poseOf(camera_); }

void OrbitView::setCameraPose(const CameraPose& pose) {
  easing_->stop();
  placed_by_user_ = true;
  apply(pose, camera_);
}

void OrbitView::linkCamera(OrbitView* other) {
  if (other == nullptr) {
    const CameraPose pose = cameraPose();
    observeCamera(vtkSmartPointer<vtkCamera>::New());
    apply(pose, camera_);
    follows_ = false;
    return;
  }
  other->easing_->stop();
  other->observeCamera(camera_);
  other->follows_ = true;
  other->requestRender();
}

void OrbitView::observeCamera(const vtkSmartPointer<vtkCamera>& camera) {
  if (camera_observer_ != 0) camera_->RemoveObserver(camera_observer_);
  camera_ = camera;
  renderer()->SetActiveCamera(camera_);
  camera_observer_ = camera_->AddObserver(vtkCommand::ModifiedEvent, this, &OrbitView::cameraModified);
}

void OrbitView::cameraModified() {
  // Rendering sets the clipping range, which also counts as a change of the camera: only a new pose asks for a frame.
  if (cameraPose() != drawn_) requestRender();
}

ViewFrame OrbitView::frame() const {
  const QMargins margins = legendMargins();
  return {static_cast<double>(std::max(1, width())), static_cast<double>(std::max(1, height())),
          static_cast<double>(margins.left()),       static_cast<double>(margins.right()),
          static_cast<double>(margins.top()),        static_cast<double>(margins.bottom())};
}

void OrbitView::fitPreset() {
  if (placed_by_user_ || follows_) return;
  ease_to_ = presetPose(preset_, space_, frame());
  if (easing_->state() != QAbstractAnimation::Running) apply(ease_to_, camera_);
}

void OrbitView::setSpace(const SceneSpace& space) {
  space_ = space;
  fitPreset();
  requestRender();
}

void OrbitView::resizeGL(int width, int height) {
  VtkHost::resizeGL(width, height);
  fitPreset();
}

void OrbitView::prepareFrame() {
  drawn_ = cameraPose();
  renderer()->ResetCameraClippingRange();
}

void OrbitView::turn(double azimuth_rad, double elevation_rad) {
  CameraPose pose = cameraPose();
  pose.azimuth_rad += azimuth_rad;
  pose.elevation_rad = std::clamp(pose.elevation_rad + elevation_rad, -kSteepest_rad, kSteepest_rad);
  setCameraPose(pose);
}

void OrbitView::zoom(double factor) {
  CameraPose pose = cameraPose();
  pose.view_height_m = std::clamp(pose.view_height_m / factor, 1e-3 * space_.diagonal_m(), 20.0 * space_.diagonal_m());
  setCameraPose(pose);
}

void OrbitView::move(const QPointF& pixels) {
  CameraPose pose = cameraPose();
  const Eigen::Vector3d up(camera_->GetViewUp());
  const Eigen::Vector3d forward =
      (Eigen::Vector3d(camera_->GetFocalPoint()) - Eigen::Vector3d(camera_->GetPosition())).normalized();
  const double metresPerPixel = pose.view_height_m / std::max(1, height());
  pose.focus_m += metresPerPixel * (pixels.y() * up - pixels.x() * forward.cross(up));
  setCameraPose(pose);
}

std::optional<int> OrbitView::pointAt(const QPointF& position) const {
  const std::vector<Eigen::Vector3d> points = pickPoints_m();
  const Projection projection(renderer());
  const double ratio = pixelRatio();
  const Eigen::Vector2d mouse(position.x() * ratio, (height() - position.y()) * ratio);
  const double reach = kPickRadius_px * ratio;
  std::optional<int> best;
  double best_score = 0.0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto at = projection.toPixels(points[k]);
    if (!at) continue;
    const double distance = (at->head<2>() - mouse).norm();
    if (distance > reach) continue;
    // Of marks that overlap on screen the nearer one counts: a whole reach is worth as much as all of the depth.
    const double score = distance / reach + at->z();
    if (!best || score < best_score) {
      best = static_cast<int>(k);
      best_score = score;
    }
  }
  return best;
}

void OrbitView::mousePressEvent(QMouseEvent* event) {
  press_ = last_ = event->position();
  dragged_ = false;
}

void OrbitView::mouseMoveEvent(QMouseEvent* event) {
  const QPointF step = event->position() - last_;
  last_ = event->position();
  if (event->buttons() == Qt::NoButton) {
    setHovered(pointAt(event->position()));
    return;
  }
  if ((event->position() - press_).manhattanLength() > kClickSlack_px) dragged_ = true;
  if (!dragged_) return;
  if (event->buttons() & (Qt::MiddleButton | Qt::RightButton) || event->modifiers() & Qt::ShiftModifier)
    move(step);
  else
    turn(-step.x() * kTurnPerPixel_rad, step.y() * kTurnPerPixel_rad);
}

void OrbitView::mouseReleaseEvent(QMouseEvent* event) {
  if (dragged_ || event->button() != Qt::LeftButton) return;
  if (const auto index = pointAt(event->position())) pointClicked(*index);
}

void OrbitView::mouseDoubleClickEvent(QMouseEvent* event) {
  if (!pointAt(event->position())) setCamera(preset_);
}

void OrbitView::wheelEvent(QWheelEvent* event) {
  zoom(std::pow(kZoomPerKey, event->angleDelta().y() / 120.0));
  event->accept();
}

void OrbitView::leaveEvent(QEvent*) { setHovered(std::nullopt); }

void OrbitView::setHovered(std::optional<int> index) {
  if (index == hovered_) return;
  hovered_ = index;
  pointHovered(index);
}

void OrbitView::keyPressEvent(QKeyEvent* event) {
  switch (event->key()) {
    case Qt::Key_Left:
      return turn(-kTurnPerKey_rad, 0.0);
    case Qt::Key_Right:
      return turn(kTurnPerKey_rad, 0.0);
    case Qt::Key_Up:
      return turn(0.0, kTurnPerKey_rad);
    case Qt::Key_Down:
      return turn(0.0, -kTurnPerKey_rad);
    case Qt::Key_Plus:
    case Qt::Key_Equal:
      return zoom(kZoomPerKey);
    case Qt::Key_Minus:
      return zoom(1.0 / kZoomPerKey);
    case Qt::Key_Home:
      return setCamera(preset_);
    default:
      VtkHost::keyPressEvent(event);
  }
}

}  // namespace fieldtrue::widgets
