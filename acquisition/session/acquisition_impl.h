#pragma once

#include <QElapsedTimer>
#include <QTimer>
#include <deque>
#include <map>

#include "acquisition/plan/place_state.h"
#include "acquisition/sampling/reference_guess.h"
#include "acquisition/sampling/rig_fit.h"
#include "acquisition/sampling/stand_watch.h"
#include "acquisition/sampling/stillness.h"
#include "acquisition/session/acquisition_controller.h"
#include "acquisition/session/loose_readings.h"

namespace fieldtrue::acquisition {

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
  void retryLater();
  void beginStream();
  void guide();
  void mergeMetadata();
  /// Sets other_tracker where the session was begun with another one; before the first take that one is forgotten.
  void compareTrackers(TableMetadata& known, const TableMetadata& said);
  void remarkOnTracker();
  /// Tells in the table, as soon as it is true, that another tracker has recorded too.
  Result<void> markOtherTracker();

  // Session.
  void open(const QString& path, const QString& create_plan_json);
  Result<SessionStore> createSession(const QString& path, const QString& plan_text) const;
  bool isOpenAlready(const QString& path) const;
  void tellOpened(const std::string& page);
  void close();
  /// What is read of a session when it is opened.
  struct Content {
    std::vector<PlaceState> states;
    std::vector<std::optional<Node>> nodes;
    bool can_undo = false, can_redo = false;
    std::string page;
    std::string newest_fit;  ///< Empty when there is none.
  };
  static Result<Content> readContent(const SessionStore& store);
  /// Reads again what is known of one place, and tells.
  Result<void> reloadPlace(std::size_t place);
  void setNode(std::size_t place, const std::optional<Node>& node);
  std::optional<std::size_t> nextPlace() const;
  bool told(const Result<void>& done);
  void keepLoose(const std::vector<LooseSample>& readings);
  void keepCancelledTake();
  void setCurrent(std::optional<std::size_t> place);
  void goOn();
  void note(const std::string& kind, const std::string& text);

  // Takes.
  void startTake();
  void stopTake();  ///< What was collected is kept as a cancelled take.
  void addSample(const Sample& sample);
  void considerAutomaticTake();
  void finishTake();
  void failTake(const std::string& reason);
  void checkNoSignal();
  std::vector<NeighbourTake> neighbours(std::size_t place) const;

  // How the takes fit each other.
  std::vector<std::size_t> takesNear(std::size_t place) const;
  /// Takes that count, nearest to a place first, its own among them.
  std::vector<std::size_t> nearestTakes(std::size_t place, std::size_t most) const;
  RigFit fitOf(const std::vector<std::size_t>& takes) const;
  /// @param is_judged when given, marks the places that were judged
  void judgeAround(std::size_t place, std::vector<bool>* is_judged = nullptr);
  void judgeAll();
  std::optional<double> tooFar_m() const;
  bool isRefused() const { return refused_at && refused_at == current; }
  void refuse(double off_m);

  // Words and numbers for the views.
  AcquisitionStatus status() const;
  std::shared_ptr<const PlannedSession> plannedSession() const;
  std::shared_ptr<const RecordedPlaces> recordedPlaces() const;
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
  void updateGuess();

  AcquisitionController* owner;
  SamplerOptions options;
  NodeSampler sampler;
  StillnessDetector stillness;
  StandWatch stand;
  std::optional<SessionStore> store;
  LooseReadings loose;
  bool loose_refused = false;  ///< The newest loose readings could not be written; said once.
  std::function<QDateTime()> now = [] { return QDateTime::currentDateTimeUtc(); };

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
  bool reconnects = true;
  bool lost = false;  ///< It ran and is gone; retry_timer starts it again.
  int retries = 0;
  QTimer retry_timer;

  std::vector<PlaceState> states;
  std::vector<std::optional<Node>> nodes;
  /// Where each place's take belongs [m], NaN without one that counts: small, for each new take looks through all.
  std::vector<Eigen::Vector3d> takes_m;
  std::vector<Node> done_nodes;  ///< Those not skipped, in any order: kept up, for gathering them costs each take more.
  std::optional<std::size_t> current;
  std::optional<std::string> other_tracker;  ///< The one that records now, where the session was begun with another.
  double spacing = 0.3;
  std::uint64_t revision = 0;
  ReferenceGuess guess;
  RigFit rig;                             ///< The takes around the current place.
  std::map<std::size_t, double> misfits;  ///< Places whose takes do not fit the others, and how far they are off [m].
  std::optional<std::size_t> refused_at;  ///< The place whose take was refused because the sensor stood elsewhere.
  bool taken_away = false;                ///< The running take was asked for although it had been refused.
  double near_m = 0.0;
  bool automatic = false;
  bool can_undo = false, can_redo = false;
  std::optional<double> looked_at_s;  ///< When stillness was last judged for automatic takes.
  bool stood_still = false;
  std::optional<double> waiting_since_s;  ///< Session time since which the current place waits for a usable signal.
  QString failure;                        ///< Why the last take failed; shown until the next action, or for a while.
  double failure_time_s = 0.0;

  /// As they were told last; null when what they tell has changed since.
  mutable std::shared_ptr<const PlannedSession> told_session;
  mutable std::shared_ptr<const RecordedPlaces> told_recorded;
  QTimer status_timer;
  QElapsedTimer since_status;
};

}  // namespace fieldtrue::acquisition
