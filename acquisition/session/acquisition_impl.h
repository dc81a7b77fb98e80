#pragma once

#include "acquisition/session/acquisition_controller.h"
#include "acquisition/session/acquisition_places.h"
#include "acquisition/session/acquisition_status.h"
#include "acquisition/session/acquisition_take.h"
#include "acquisition/session/acquisition_tracker.h"
#include "acquisition/session/loose_readings.h"

namespace fieldtrue::acquisition {

/// Joins the parts of one running acquisition. Slots and timers of the controller call in here; nothing here blocks.
struct AcquisitionController::Impl {
  static constexpr const char* kDefaultRig = "wooden jig";

  Impl(AcquisitionController* owner, const SamplerOptions& options);
  ~Impl() { tracker.cut(); }

  // Device.
  void adopt(std::unique_ptr<TrackerDevice> next, const Pose& believed);
  void dropDevice();
  void onDeviceState(DeviceState state, const QString& text);
  void onSamples(const std::vector<Sample>& samples);
  void checkSilence();
  void beginStream();
  void guide();
  double sessionTime_s(double device_time_s);
  /// What the tracker says of itself, and a person of the set-up.
  TableMetadata said() const;
  void correctSetup(const Setup& stated);
  void mergeMetadata();
  /// Sets other_tracker where the session was begun with another one; before the first take that one is forgotten.
  void compareTrackers(TableMetadata& known, const TableMetadata& said);
  void remarkOnTracker();
  /// The sensor that took the places done goes on; before the first, the one asked for.
  void settleSensor();
  void remarkOnSensor(int other);
  /// Tells in the table, as soon as it is true, that another tracker has recorded too.
  Result<void> markOtherTracker();

  // Session.
  void open(const QString& path, const QString& create_plan_json);
  Result<SessionStore> createSession(const QString& path, const QString& plan_text) const;
  bool isOpenAlready(const QString& path) const;
  void tellOpened(const std::string& page);
  void close();
  /// Reads again what is known of one place, and tells.
  Result<void> reloadPlace(std::size_t place);
  /// Undoes or redoes. @return the place it concerned, none when nothing is left or it failed
  std::optional<std::size_t> step(Result<std::optional<std::size_t>> (SessionStore::*go)());
  void keepLoose(const std::vector<LooseSample>& readings);
  void setCurrent(std::optional<std::size_t> place);
  void advance();
  void note(const std::string& kind, const std::string& text);
  /// Whether something could be done; where not, tells why.
  template <class T>
  bool told(const Result<T>& done) {
    if (!done) emit owner->failed(QString::fromStdString(done.error().message));
    return done.has_value();
  }

  // Takes.
  void stopTake();  ///< What was collected is kept as a cancelled take.
  void addSample(const Sample& sample);
  void considerAutomaticTake();
  void finishTake();
  void failTake(const std::string& reason);
  void refuse(double off_m);

  // Words and numbers for the views.
  AcquisitionStatus status() const;
  QString reason(bool* attention) const;
  QString waitingReason() const;

  AcquisitionController* owner;
  std::function<QDateTime()> now = [] { return QDateTime::currentDateTimeUtc(); };
  std::optional<SessionStore> store;
  LooseReadings loose;
  bool loose_refused = false;  ///< The newest loose readings could not be written; said once.
  /// The tracker or set-up that records now, where the session was begun with another.
  std::optional<std::string> other_tracker;

  Setup stated_setup;  ///< By a person.

  TrackerLink tracker;
  SignalWindow heard;  ///< Of every sensor, by the device's clock.
  KnownPlaces places;
  RunningTake take;
  ViewUpdates views;
};

}  // namespace fieldtrue::acquisition
