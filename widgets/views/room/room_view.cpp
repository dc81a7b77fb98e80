#include "widgets/views/room/room_view.h"

#include <QTimer>

#include "acquisition/plan/place_state.h"
#include "widgets/style/unit_texts.h"
#include "widgets/views/room/room_scene.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kPulseFrame_ms = 50;
constexpr int kPulse_ms = 1400;

}  // namespace

RoomView::RoomView(QWidget* parent) : OrbitView(parent), scene_(std::make_unique<RoomScene>(renderer())) {
  setAccessibleName(tr("Room with the places to visit"));
  setSmooth(false);  // it moves all the time
  pulse_ = new QTimer(this);
  pulse_->setInterval(kPulseFrame_ms);
  connect(pulse_, &QTimer::timeout, this, [this] {
    pulse_ms_ = (pulse_ms_ + kPulseFrame_ms) % kPulse_ms;
    scene_->setPulse(static_cast<double>(pulse_ms_) / kPulse_ms);
    requestRender();
  });
}

RoomView::~RoomView() = default;

void RoomView::setPlaces(const std::vector<PlannedPlace>& places) {
  scene_->setPlaces(places);
  room_is_set_ = false;
  setSpace(scene_->space());
  updatePulse();
}

void RoomView::setStates(const std::vector<acquisition::PlaceState>& states, std::optional<std::size_t> current) {
  scene_->setStates(states, current);
  updatePulse();
  requestRender();
}

void RoomView::setTransmitter(const Pose& reference_from_tracker) {
  if (room_is_set_) {
    scene_->moveTransmitter(reference_from_tracker);
  } else {
    scene_->setTransmitter(reference_from_tracker);
    setSpace(scene_->space());
    room_is_set_ = true;
  }
  requestRender();
}

void RoomView::setLive(const std::optional<Pose>& reference_from_sensor) {
  scene_->setLive(reference_from_sensor);
  requestRender();
}

void RoomView::setJig(const std::optional<Pose>& reference_from_sensor) {
  scene_->setJig(reference_from_sensor);
  requestRender();
}

void RoomView::setSelected(std::optional<int> place) {
  scene_->setSelected(place);
  requestRender();
}

void RoomView::setFloor(std::optional<double> floor_z_m) {
  scene_->setFloor(floor_z_m);
  setSpace(scene_->space());
}

void RoomView::restyle(double pixel_ratio) {
  scene_->setStyle(theme(), pixel_ratio);
  scene_->setUnit(placingUnit());
}

void RoomView::prepareFrame() {
  scene_->update();
  scene_->faceCamera();
  OrbitView::prepareFrame();
}

void RoomView::showEvent(QShowEvent* event) {
  OrbitView::showEvent(event);
  updatePulse();
}

void RoomView::hideEvent(QHideEvent* event) {
  OrbitView::hideEvent(event);
  pulse_->stop();
}

void RoomView::updatePulse() {
  const bool wanted = scene_->hasCurrent() && isVisible();
  if (wanted == pulse_->isActive()) return;
  if (wanted)
    pulse_->start();
  else
    pulse_->stop();
}

QMargins RoomView::legendMargins() const { return RoomScene::legendMargins(); }

std::vector<Eigen::Vector3d> RoomView::pickPoints_m() const {
  std::vector<Eigen::Vector3d> points;
  for (const PlannedPlace& place : scene_->places()) points.push_back(place.reference_from_sensor.position_m);
  return points;
}

void RoomView::pointHovered(std::optional<int> index) {
  scene_->setHovered(index);
  requestRender();
  emit placeHovered(index.value_or(-1));
}

void RoomView::pointClicked(int index) { emit placeClicked(index); }

}  // namespace fieldtrue::widgets
