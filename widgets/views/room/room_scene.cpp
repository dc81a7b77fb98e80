#include "widgets/views/room/room_scene.h"

#include <vtkRenderer.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "acquisition/plan/place_state.h"
#include "acquisition/plan/plan.h"
#include "calib/core/error.h"
#include "widgets/style/units.h"
#include "widgets/views/host/mesh.h"
#include "widgets/views/host/projection.h"

namespace fieldtrue::widgets {
namespace {

constexpr double kNextSize = 2.3;  ///< Of a mark's radius; the pulse grows to twice that.

/// Of several visits to one place the one that says most is drawn; later in this list wins.
int importance(acquisition::PlaceState state) {
  switch (state) {
    case acquisition::PlaceState::kSkipped:
      return 0;
    case acquisition::PlaceState::kDone:
      return 1;
    case acquisition::PlaceState::kSuspicious:
      return 2;
    case acquisition::PlaceState::kPlanned:
      return 3;
  }
  return 0;
}

const char* stateWord(acquisition::PlaceState state) {
  switch (state) {
    case acquisition::PlaceState::kDone:
      return "done";
    case acquisition::PlaceState::kSkipped:
      return "skipped";
    case acquisition::PlaceState::kSuspicious:
      return "suspicious: look at it again";
    case acquisition::PlaceState::kPlanned:
      break;
  }
  return "planned";
}

}  // namespace

RoomScene::RoomScene(vtkRenderer* renderer)
    : renderer_(renderer),
      box_(renderer),
      transmitter_part_(renderer),
      jig_part_(renderer),
      path_(renderer),
      sensor_(renderer),
      overlay_(addOverlay(renderer)) {
  const std::map<Layer, Symbol> symbols = {
      {kPlanned, Symbol::kCircle},     {kPlannedValidation, Symbol::kSquare},    {kDone, Symbol::kFilledCircle},
      {kSuspicious, Symbol::kDiamond}, {kDoneValidation, Symbol::kFilledSquare}, {kSkipped, Symbol::kCross},
      {kNext, Symbol::kThickCircle},   {kNextCore, Symbol::kFilledCircle},       {kPulse, Symbol::kCircle},
      {kHalo, Symbol::kCircle},
  };
  for (const auto& [layer, symbol] : symbols) marks_.try_emplace(layer, renderer, symbol);
}

void RoomScene::setPlaces(const std::vector<PlannedPlace>& places) {
  places_ = places;
  states_.assign(places.size(), acquisition::PlaceState::kPlanned);
  current_.reset();
  selected_.reset();
  hovered_.reset();
  room_changed_ = marks_changed_ = true;
  updateSpace();
}

void RoomScene::setStates(const std::vector<acquisition::PlaceState>& states, std::optional<std::size_t> current) {
  FT_CHECK(states.size() == places_.size());
  FT_CHECK(!current || *current < places_.size());
  states_ = states;
  current_ = current;
  marks_changed_ = true;
}

void RoomScene::setTransmitter(const Pose& reference_from_tracker) {
  moveTransmitter(reference_from_tracker);
  updateSpace();
}

void RoomScene::moveTransmitter(const Pose& reference_from_tracker) {
  if (reference_from_tracker.position_m == reference_from_tracker_.position_m &&
      reference_from_tracker.orientation.coeffs() == reference_from_tracker_.orientation.coeffs())
    return;
  reference_from_tracker_ = reference_from_tracker;
  room_changed_ = true;
}

void RoomScene::setLive(const std::optional<Pose>& reference_from_sensor) {
  sensor_.add(reference_from_sensor);
  live_changed_ = true;
}

void RoomScene::setJig(const std::optional<Pose>& reference_from_sensor) {
  jig_ = reference_from_sensor;
  marks_changed_ = true;
}

void RoomScene::setSelected(std::optional<int> place) {
  FT_CHECK(!place || (*place >= 0 && *place < static_cast<int>(places_.size())));
  selected_ = place;
  marks_changed_ = true;
}

void RoomScene::setHovered(std::optional<int> place) {
  hovered_ = place;
  marks_changed_ = true;
}

void RoomScene::setUnit(LengthUnit unit) {
  overlay_->content.unit = unit;
  marks_changed_ = true;
}

void RoomScene::setFloor(std::optional<double> floor_z_m) {
  floor_z_m_ = floor_z_m;
  room_changed_ = true;
  updateSpace();
}

void RoomScene::setStyle(const Theme& theme, double ratio) {
  theme_ = &theme;
  ratio_ = ratio;
  room_changed_ = marks_changed_ = live_changed_ = true;
}

void RoomScene::setPulse(double phase) { pulse_ = phase; }

void RoomScene::updateSpace() {
  std::vector<Eigen::Vector3d> points;
  points.reserve(places_.size());
  for (const PlannedPlace& place : places_) points.push_back(place.reference_from_sensor.position_m);
  space_ = spaceAround(points, reference_from_tracker_, floor_z_m_);
}

QMargins RoomScene::legendMargins() { return {64, 24, 48, 52}; }

void RoomScene::update() {
  if (room_changed_) updateRoom();
  if (marks_changed_ || room_changed_) {
    updateMarks();
    updateOverlay();
  }
  if (live_changed_ || room_changed_) sensor_.build(space_, *theme_);
  room_changed_ = marks_changed_ = live_changed_ = false;
}

void RoomScene::updateRoom() {
  renderer_->SetBackground(rgb(theme_->background).data());
  box_.build(space_, *theme_, ratio_);
  transmitter_part_.build(reference_from_tracker_, space_, *theme_);
  const std::map<Layer, QColor> colors = {
      {kPlanned, theme_->text_muted},
      {kPlannedValidation, theme_->text_muted},
      {kDone, theme_->done},
      {kDoneValidation, theme_->done},
      {kSuspicious, theme_->attention},
      {kSkipped, theme_->text_muted},
      {kNext, theme_->accent},
      {kNextCore, theme_->accent},
      {kHalo, theme_->text},
  };
  const std::map<Layer, double> sizes = {{kNext, kNextSize}, {kNextCore, 0.9}, {kHalo, 2.0}};
  for (auto& [layer, mark] : marks_) {
    if (colors.contains(layer)) mark.setColor(colors.at(layer));
    mark.setEdge(theme_->background);
    mark.setRadius(space_.mark_radius_m * (sizes.contains(layer) ? sizes.at(layer) : 1.0));
  }
}

RoomScene::Layer RoomScene::layerOf(std::size_t place) const {
  const bool validation = places_[place].role == NodeRole::kValidation;
  switch (states_[place]) {
    case acquisition::PlaceState::kDone:
      return validation ? kDoneValidation : kDone;
    case acquisition::PlaceState::kSkipped:
      return kSkipped;
    case acquisition::PlaceState::kSuspicious:
      return kSuspicious;
    case acquisition::PlaceState::kPlanned:
      break;
  }
  return validation ? kPlannedValidation : kPlanned;
}

void RoomScene::updateMarks() {
  std::map<int, std::size_t> shown;  // by node: its most telling visit
  for (std::size_t k = 0; k < places_.size(); ++k) {
    const auto [entry, is_new] = shown.try_emplace(places_[k].node, k);
    if (!is_new && importance(states_[k]) > importance(states_[entry->second])) entry->second = k;
  }
  std::map<Layer, std::vector<Eigen::Vector3d>> points;
  for (const auto& [node, place] : shown)
    if (!current_ || places_[*current_].node != node)
      points[layerOf(place)].push_back(places_[place].reference_from_sensor.position_m);
  std::optional<Eigen::Vector3d> next_m;
  if (current_) next_m = places_[*current_].reference_from_sensor.position_m;
  if (next_m) points[kNext] = points[kNextCore] = points[kPulse] = {*next_m};
  if (selected_) points[kHalo] = {places_[static_cast<std::size_t>(*selected_)].reference_from_sensor.position_m};
  for (auto& [layer, mark] : marks_) mark.setPoints(points[layer]);
  path_.build(lastPlace_m(), next_m, space_, *theme_);
  jig_part_.build(jig_, space_, *theme_);
}

std::optional<Eigen::Vector3d> RoomScene::lastPlace_m() const {
  if (!current_) return std::nullopt;
  for (std::size_t k = *current_; k-- > 0;)
    if (states_[k] != acquisition::PlaceState::kPlanned) return places_[k].reference_from_sensor.position_m;
  return std::nullopt;
}

void RoomScene::updateOverlay() {
  OverlayContent& content = overlay_->content;
  content.theme = theme_;
  content.ratio = ratio_;
  content.axes = space_;
  content.labels = transmitter_part_.labels();
  const auto any = [this](acquisition::PlaceState state) {
    return std::find(states_.begin(), states_.end(), state) != states_.end();
  };
  const bool validation = std::any_of(places_.begin(), places_.end(),
                                      [](const PlannedPlace& place) { return place.role == NodeRole::kValidation; });
  content.symbols.clear();
  if (current_) content.symbols.push_back({Symbol::kThickCircle, theme_->accent, "next"});
  if (any(acquisition::PlaceState::kPlanned))
    content.symbols.push_back({Symbol::kCircle, theme_->text_muted, "planned"});
  if (any(acquisition::PlaceState::kDone)) content.symbols.push_back({Symbol::kFilledCircle, theme_->done, "done"});
  if (any(acquisition::PlaceState::kSuspicious))
    content.symbols.push_back({Symbol::kDiamond, theme_->attention, "suspicious"});
  if (any(acquisition::PlaceState::kSkipped))
    content.symbols.push_back({Symbol::kCross, theme_->text_muted, "skipped"});
  if (validation) content.symbols.push_back({Symbol::kSquare, theme_->text_muted, "validation"});
  content.bubble.clear();
  if (!hovered_) return;
  const auto place = static_cast<std::size_t>(*hovered_);
  const Eigen::Vector3d& at_m = places_[place].reference_from_sensor.position_m;
  const auto text = [&content](double metres) { return formatLength(metres, content.unit).toStdString(); };
  content.bubble_at_m = at_m;
  content.bubble = {placeName(places_[place]),
                    "x " + text(at_m.x()) + "   y " + text(at_m.y()) + "   z " + text(at_m.z()),
                    current_ == place ? "next" : stateWord(states_[place])};
}

void RoomScene::faceCamera() {
  const Eigen::Matrix3d world_from_view = worldFromView(renderer_);
  MarkLayer& pulse = marks_.at(kPulse);
  pulse.setRadius(space_.mark_radius_m * kNextSize * (1.0 + pulse_));
  pulse.setColor(theme_->accent, 1.0 - pulse_);
  for (auto& [layer, mark] : marks_) mark.face(world_from_view);
}

}  // namespace fieldtrue::widgets
