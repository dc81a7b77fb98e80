#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "acquisition/plan/place_state.h"
#include "calib/core/calibration_table.h"
#include "widgets/style/theme.h"
#include "widgets/views/host/orbit_view.h"

class QTimer;

namespace fieldtrue::widgets {

class RoomScene;

/// The room while recording: every place by its state, the next one pulsing, the jig as it should stand, the live
/// sensor.
class RoomView : public OrbitView {
  Q_OBJECT
 public:
  explicit RoomView(QWidget* parent = nullptr);
  ~RoomView() override;

  void setPlaces(const std::vector<PlannedPlace>& places);
  /// @param states one per place, same order
  /// @param current the place to go to, drawn as the next
  void setStates(const std::vector<acquisition::PlaceState>& states, std::optional<std::size_t> current);
  /// The first one after setPlaces belongs to the room that is shown; after that only the transmitter moves, never the
  /// room or the camera, for where it stands is guessed anew with every place recorded.
  void setTransmitter(const Pose& reference_from_tracker);
  /// @param reference_from_sensor newest reading; none hides the sensor and clears its trail
  void setLive(const std::optional<Pose>& reference_from_sensor);
  /// @param reference_from_sensor where the jig should hold the sensor; base and pipe are drawn below it
  void setJig(const std::optional<Pose>& reference_from_sensor);
  void setSelected(std::optional<int> place);
  /// @param floor_z_m height of the floor, reference frame [m]; none: one pitch below the lowest place
  void setFloor(std::optional<double> floor_z_m);

 signals:
  void placeClicked(int place);  ///< Index into setPlaces.
  void placeHovered(int place);  ///< -1 when the mouse left it.

 protected:
  void restyle(double pixel_ratio) override;
  void prepareFrame() override;
  void showEvent(QShowEvent* event) override;
  void hideEvent(QHideEvent* event) override;
  QMargins legendMargins() const override;
  std::vector<Eigen::Vector3d> pickPoints_m() const override;
  void pointHovered(std::optional<int> index) override;
  void pointClicked(int index) override;

 private:
  void updatePulse();

  std::unique_ptr<RoomScene> scene_;
  QTimer* pulse_ = nullptr;
  int pulse_ms_ = 0;
  bool room_is_set_ = false;
};

}  // namespace fieldtrue::widgets
