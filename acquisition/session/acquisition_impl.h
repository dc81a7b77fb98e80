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
  static constexpr const char* kTakeLengthState = "take_length";
  static constexpr const char* kClockState = "clock_began";

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
  /// When the clock of the session was at 0: kept with it from its first reading on.
  QDateTime clockBegan();
  /// What the tracker says of itself, and a person of the set-up.
  TableMetadata said() const;
  void correctSetup(const Setup& stated);
  void setSetupOfTracker(const Setup& stated);
  void keepSetup(const Setup& setup);  ///< In the open session.
  void mergeMetadata();
  /// Sets other_tracker where the session was begun with another one; before the first take that one is forgotten.
  void compareTrackers(TableMetadata& known, const TableMetadata& said);
  void remarkOnTracker();
  void remark(const std::string& text, RemarkKind kind = RemarkKind::kNote);
  /// Sets other_names where a recorded sensor has another name now; before the first take the names are forgotten.
  void compareNames(TableMetadata& known, const TableMetadata& said);
  /// Those that took the places done go on; before the first take those that a person chose, else all that report.
  void settleSensors();
  void keepChoiceOfSensors();  ///< What was chosen before there was a session is of the one that begins.
  std::vector<int> sensorsOfState(const std::string& key);  ///< Chosen by a person; empty = none were.
  std::vector<int> sensorsOfSession();  ///< Those that took its places, but for such as are left out from then on.
  void leadPlaces(const std::vector<int>& going_on);
  void chooseSensors(const std::vector<int>& sensors);
  /// Of the sensors that took the places those that are left when others are dead.
  void goOnWith(const std::vector<int>& sensors);
  void remarkOnLeftOut();
  /// Tells, once it is sure, of a sensor that came too late to be recorded.
  void noticeLate(const Sample& sample);
  void remarkOnMissing();
  /// Tells in the table, as soon as it is true, that another tracker has recorded too.
  Result<void> markOtherTracker();

  // Session.
  void open(const QString& path, const QString& create_plan_json, const std::optional<TakeLength>& length);
  Result<SessionStore> createSession(const QString& path, const QString& plan_text) const;
  bool isOpenAlready(const QString& path) const;
  void tellOpened(const std::string& page);
  /// Where the session keeps none, or none that can be read, it is the usual one.
  TakeLength keptTakeLength();
  bool keepTakeLength(const TakeLength& length);  ///< @return whether it is one, and the session keeps it
  void useTakeLength(const TakeLength& length);   ///< From the next take on.
  void close();
  /// Reads again what is known of one place, and tells.
  Result<void> reloadPlace(std::size_t place);
  /// Undoes or redoes. @return the place it concerned, none when it failed
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
  /// The leading sensor's reading. @return whether stillness is to be judged anew
  bool follow(const Sample& sample);
  void collect(const Sample& sample, bool is_judged);  ///< A reading while a take runs.
  void endTake(TakeState state);                       ///< Where that is an end.
  void atTimeLimit();                                  ///< The take that runs is held: what was said for that is done.
  void ask();
  void watchHeldTake();  ///< The jig that is carried on says: keep it.
  void keepTake();
  void waitLonger();
  void takeAgain();
  void skip(const std::string& why);
  void considerAutomaticTake();
  std::string suspicionOfTake(std::size_t place) const;
  void finishTake();
  void failTake(const std::string& reason);
  void failToStore(const std::string& reason);
  void refuse(double off_m);

  // Words and numbers for the views.
  AcquisitionStatus status() const;
  std::vector<SensorProgress> progress() const;
  QString reason(bool* attention) const;
  QString waitingReason() const;

  AcquisitionController* owner;
  std::function<QDateTime()> now = [] { return QDateTime::currentDateTimeUtc(); };
  std::optional<SessionStore> store;
  std::optional<QDateTime> clock_began;  ///< None before it was asked for.
  LooseReadings loose;
  bool loose_refused = false;  ///< The newest loose readings could not be written; said once.
  /// The tracker or set-up that records now, where the session was begun with another.
  std::optional<std::string> other_tracker;
  std::string other_names;  ///< Which recorded sensors are others than in the session: nothing is recorded of them.

  Setup stated_setup;  ///< By a person.

  TrackerLink tracker;
  bool sensors_are_settled = false;     ///< One that begins to report does not join those that are recorded.
  bool takes_settle_sensors = false;    ///< The session's takes say which ones are recorded.
  std::vector<int> sensors_of_session;  ///< Those that took its places, the leading one first.
  std::vector<int> late_sensors;        ///< That are not recorded, and not told of yet.
  SignalWindow heard;                   ///< Of every sensor, by the device's clock.
  KnownPlaces places;
  TakeLength usual_length;
  RunningTake take;
  ViewUpdates views;
};

}  // namespace fieldtrue::acquisition
