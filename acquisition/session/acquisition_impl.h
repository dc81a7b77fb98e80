#pragma once

#include <QElapsedTimer>
#include <QTimer>
#include <deque>

#include "acquisition/session/acquisition_controller.h"
#include "acquisition/session/reference_guess.h"
#include "acquisition/session/stand_watch.h"

namespace fieldtrue {

/// The parts of one running acquisition. Slots and timers of the controller call in here; nothing here blocks.
struct AcquisitionController::Impl {
  Impl(AcquisitionController* owner, SamplerOptions sampler_options);
  ~Impl();

  // Device.
  void adopt(std::unique_ptr<TrackerDevice> next, const Pose& believed);
  void dropDevice();
  void onDeviceState(DeviceState state, const QString& text);
  void onSamples(const std::vector<Sample>& samples);
  void checkSilence();
  void beginStream();
  void guide();
  void mergeMetadata();

  // Session.
  void open(const QString& path, const QString& create_plan_json);
  Result<SessionStore> createSession(const QString& path, const QString& plan_text) const;
  void close();
  void loadPlaces();
  void reloadPlace(std::size_t place);
  void setCurrent(std::optional<std::size_t> place);
  void goOn();
  void note(const std::string& kind, const std::string& text);

  // Takes.
  void startTake();
  void stopTake();
  void addSample(const Sample& sample);
  void considerAutomaticTake();
  void finishTake();
  void failTake(const std::string& reason);
  void checkNoSignal();
  std::vector<NeighbourTake> neighbours(std::size_t place) const;

  // Words and numbers for the views.
  AcquisitionStatus status() const;
  QString reason(bool* attention) const;
  QString waitingReason() const;
  QString automaticReason() const;
  std::optional<double> distanceToCurrent_m() const;
  double rate_hz() const;
  std::string currentName() const;
  bool near() const;
  bool collecting() const { return sampler.state() == TakeState::kCollecting; }
  double sessionTime_s(double device_time_s);
  void changed();
  void emitStatus();
  std::vector<Node> doneNodes() const;
  void updateGuess();

  AcquisitionController* owner;
  SamplerOptions options;
  NodeSampler sampler;
  StillnessDetector stillness;
  StandWatch stand;
  std::optional<SessionStore> store;

  std::unique_ptr<TrackerDevice> device;
  DeviceState device_state = DeviceState::kClosed;
  QString device_text;
  Pose believed_reference;
  std::optional<int> sensor;            ///< The one recorded: the first that reports.
  std::optional<double> time_offset_s;  ///< Session time minus the device's.
  std::optional<Sample> live;
  std::deque<double> recent_times_s;
  QElapsedTimer since_sample;
  QTimer silence_timer;

  std::vector<PlaceState> states;
  std::vector<std::optional<Node>> nodes;
  std::optional<std::size_t> current;
  double spacing = 0.3;
  ReferenceGuess guess;
  double near_m = 0.0;
  bool automatic = false;
  bool can_undo = false, can_redo = false;
  std::optional<double> looked_at_s;  ///< When stillness was last judged for automatic takes.
  bool stood_still = false;
  std::optional<double> waiting_since_s;  ///< Session time since which the current place waits for a usable signal.
  QString failure;                        ///< Why the last take failed; shown until the next action, or for a while.
  double failure_time_s = 0.0;

  QTimer status_timer;
  QElapsedTimer since_status;
};

}  // namespace fieldtrue
