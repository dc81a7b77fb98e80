#pragma once

#include <QDateTime>
#include <QObject>
#include <QString>
#include <QVector>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "acquisition/devices/tracker_device.h"
#include "acquisition/plan/place_state.h"
#include "acquisition/sampling/node_sampler.h"
#include "acquisition/sampling/take_length.h"
#include "acquisition/sampling/time_limit.h"
#include "acquisition/session/session_store.h"
#include "acquisition/session/signal_snapshot.h"

namespace fieldtrue::acquisition {

/// A finished take that does not fit the others: how far the sensor stood from where it belongs.
struct PlaceMisfit {
  std::size_t place = 0;
  double off_m = 0.0;
  bool operator==(const PlaceMisfit&) const = default;
};

/// What is to be recorded, and where to; another value when a session is opened or closed.
struct PlannedSession {
  QString path;                      ///< Empty when none is open.
  bool read_only = false;            ///< Open as a private copy: nothing can be stored.
  std::vector<PlannedPlace> places;  ///< In visiting order.
};

/// What of it is recorded; another value when that changes: take, retake, undo, skip.
struct RecordedPlaces {
  std::uint64_t revision = 0;        ///< Grows with every change.
  std::vector<PlaceState> states;    ///< One a planned place; a take that does not fit the others is suspicious.
  std::vector<PlaceMisfit> misfits;  ///< By place.
  std::size_t n_done = 0, n_skipped = 0;
  bool can_undo = false, can_redo = false;
};

/// How one of the sensors that are recorded is doing.
struct SensorProgress {
  int sensor = 0;
  int collected = 0, wanted = 0;  ///< In the take that runs; 0 without one.
  bool silent = false;            ///< It sends nothing, though others do.
  bool operator==(const SensorProgress&) const = default;
};

/// What is wrong, and what to do. @param sensors that are silent, at least one
std::string silentText(const std::vector<int>& sensors);

/// Everything a view needs to know of a running acquisition. What changes seldom is shared: a copy, made 30 times a
/// second, costs the same however many places there are.
struct AcquisitionStatus {
  std::shared_ptr<const PlannedSession> session = std::make_shared<PlannedSession>();   ///< Never null.
  std::shared_ptr<const RecordedPlaces> recorded = std::make_shared<RecordedPlaces>();  ///< Never null.
  std::optional<std::size_t> current;  ///< Where the sensor is to be put now; none when all is done.
  bool current_is_retake = false;
  TakeState take = TakeState::kIdle;
  int collected = 0;  ///< By the sensor that is farthest behind.
  int wanted = 60;
  bool can_keep = false;   ///< The take is held, and what it has can be averaged.
  bool automatic = false;  ///< Takes by itself when the sensor stands still near the place.
  bool still = false;
  QString reason;          ///< One line: "hold still: moving 4 mm/s", "press space", "retaking: moved 3 mm".
  bool attention = false;  ///< The reason needs the operator's attention.
  DeviceState device = DeviceState::kClosed;
  QString device_text;
  bool reconnecting = false;   ///< It ran and was lost; it is started again and again by itself.
  bool just_returned = false;  ///< It was lost, and is back since a few seconds.
  std::optional<Sample> live;  ///< Newest reading of the leading sensor.
  double rate_hz = 0.0;
  double sd_m = 0.0;  ///< 3-D SD of the last half second.
  /// Best rigid guess so far: fitted from the places done, before that the scene's or identity.
  Pose reference_from_tracker;
  bool reference_known = false;      ///< At least 4 places not in one plane (or the alignment is known).
  std::optional<double> distance_m;  ///< From the live position to the current place, by the takes done.
  bool distance_known = false;       ///< The takes done tell it well enough to show.
  bool away = false;                 ///< The sensor stands too far from the current place to be taken without asking.
  bool refused = false;              ///< A take was refused for that; asked for once more, it is taken.
  bool not_stored = false;           ///< The last take could not be stored: none begins by itself until an action.
  bool has_trace = false;            ///< There are bytes of a line to be saved.
  std::vector<SensorProgress> sensors;  ///< Those recorded, the leading one first; empty until it is known.
  std::vector<int> reporting;           ///< Every sensor that the tracker sends.
  std::vector<int> missing;             ///< Recorded ones that it has not sent since its stream began.
  QString other_names;                  ///< Which recorded sensors are others than in the session; empty = none.
  bool takes_settle_sensors = false;    ///< Takes of the session say which are recorded: they go on.
  std::vector<int> of_session;          ///< Those that took its places, the leading one first.
};

enum class RemarkKind {
  kNote,
  kOtherSensors,  ///< Nothing is recorded: numbers of the session's sensors stand for other ones now.
};

/// Runs an acquisition: device, samplers and store.
///
/// A take is of every sensor that is recorded, at once. One of them leads: by it rest and motion, the place where the
/// jig stands and taking by itself are judged.
///
/// Automatic mode takes when the sensor stands still near the current place (frame relation known), or has stood still
/// for 0.7 s after having moved since the last take (not known yet; 3 s when it was found standing at the very start).
/// The same stand is never taken twice by itself: it must be moved or lifted, or the take asked for; nor is one whose
/// take was stopped. After a take that could not be stored none begins by itself before a person asks for something. A
/// tracker that ran and is lost is started again, at growing intervals, until it is back or another is connected
/// (setReconnects). Lives in one worker thread (or in the main thread of the command line); all calls are slots, all
/// answers are signals carrying whole values.
class AcquisitionController : public QObject {
  Q_OBJECT
 public:
  explicit AcquisitionController(SamplerOptions options = {}, QObject* parent = nullptr);
  ~AcquisitionController() override;

  /// Takes over a device made elsewhere and starts it, in place of the one before.
  /// @param reference_from_tracker what is believed of the transmitter's place before the first place is taken
  void adoptDevice(std::unique_ptr<TrackerDevice> device, const Pose& reference_from_tracker = {});
  /// Where the date and the clock of a session come from, UTC; the machine's own where nothing is given.
  void setWallClock(std::function<QDateTime()> now);
  /// The value of the last or next statusChanged, at once.
  AcquisitionStatus status() const;
  /// The last bytes of the tracker's line, also of one that was disconnected, until another one is connected; none
  /// where it has no line.
  std::optional<Trace> trace() const;

 public slots:
  /// Connects a device by its text ("simulated", "fastrak:/dev/ttyUSB0@115200"); emits statusChanged, or deviceFailed.
  /// @param scene_path for the simulated tracker; empty = clean room
  void connectDevice(const QString& device, const QString& scene_path);
  void disconnectDevice();
  /// Takes over a session file; the one that is open already only tells sessionOpened. @param create_plan_json when not
  /// empty, the file is created with this plan (JSON or readPlan's text). The session before stays when this one fails.
  /// @param length of its takes from now on; none = as it keeps, the usual where it keeps none
  void openSession(const QString& path, const QString& create_plan_json,
                   const std::optional<fieldtrue::acquisition::TakeLength>& length = {});
  void closeSession();
  /// Starts collecting at the current place (space bar, Page Down). Where the takes done tell that the sensor stands
  /// elsewhere, it is refused once; asked for again within a few seconds it is taken, and marked.
  void take();
  /// None begins by itself before the jig has moved away. Where none runs, a place that was to be retaken is left as it
  /// is.
  void cancelTake();
  void keepTake();    ///< Of a take that is held: what it has is stored, and marked.
  void waitLonger();  ///< The same: it goes on, for as long again.
  void takeAgain();   ///< The same: it begins anew.
  void skip();
  void undo();  ///< Of a take that runs no more than that take: it is stopped.
  void redo();
  void goTo(int place);  ///< Makes any place current: retake it. -1 goes back to the first one not done.
  void setAutomatic(bool automatic);
  /// Which sensors of several are recorded, kept with the session; the first leads. Empty = every one that reports
  /// before the first take, led by the lowest. Those that took a session's places go on, or some of them, where others
  /// are dead: the leading one stays while it reports.
  void setSensors(const std::vector<int>& sensors);
  void setReconnects(bool reconnects);  ///< Whether a tracker that is lost is started again; so it is at first.
  /// Of the open session, from its next take on, and kept with it. Answers with failed and takeLengthKnown where it is
  /// none, or cannot be kept.
  void setTakeLength(const fieldtrue::acquisition::TakeLength& length);
  /// What becomes of a take whose time is over. Asked, a person answers by keepTake, waitLonger, takeAgain, skip or
  /// cancelTake; the jig that is carried on means keepTake.
  void setAtTimeLimit(fieldtrue::acquisition::AtTimeLimit at_time_limit);
  /// What a person knows of the set-up, kept with the session. Said while a session is open it corrects what was said
  /// before; a session that is opened later and was begun with another set-up tells so.
  void setSetup(const fieldtrue::Setup& stated);
  /// The same of the tracker that is connected next: what it does not state stays as the open session has it.
  void setSetupOfTracker(const fieldtrue::Setup& stated);
  void requestSignal();                                            ///< Answers with signalReady.
  void requestTrace();                                             ///< Answers with traceReady, or failed.
  void setSessionState(const QString& key, const QString& value);  ///< SessionStore::setState.
  void storeFit(const QString& name, const QString& ftcal_text);   ///< Answers with fitStored.
  /// Answers with tablesReady, or failed. Reads every sample: once for a session, then placeChanged and looseKept tell.
  void requestTables();

 signals:
  void statusChanged(const fieldtrue::acquisition::AcquisitionStatus& status);  ///< At most about 30 a second.
  /// The take is on disk: a row a sensor, the leading one first.
  void nodesStored(int place, const std::vector<fieldtrue::Node>& nodes, const QString& suspicious);
  void takeFailed(const QString& reason, int place = -1);  ///< The place, where there is one.
  /// Its time is over before it has what was asked for, and a person is asked.
  void takeHeld(int place, const QString& reason, bool can_keep);
  void takeRefused(int place, double off_m);  ///< The sensor stands so far from it.
  void deviceFailed(const QString& text);     ///< The tracker was lost, or cannot be connected.
  void deviceBack();                          ///< The tracker that was lost runs again.
  void finished();                            ///< No place is left.
  void tablesReady(const fieldtrue::CalibrationTable& table, const fieldtrue::SampleTable& samples);
  /// A take, a skip, undo or redo changed what is stored of a place: the rows of its live take, if it has one, and the
  /// samples.
  void placeChanged(int place, const std::vector<fieldtrue::Node>& nodes,
                    const std::vector<fieldtrue::Sample>& samples);
  /// Readings of no stored take were kept: rows of node -1.
  void looseKept(const std::vector<fieldtrue::SampleRow>& rows);
  void signalReady(const fieldtrue::acquisition::SignalSnapshot& snapshot);  ///< Empty where nothing is connected.
  void traceReady(const std::shared_ptr<const fieldtrue::acquisition::Trace>& trace);  ///< Never null.
  void metadataChanged(const fieldtrue::TableMetadata& metadata);
  void sessionOpened(const QString& path, const QString& page, const QString& plan_json);
  void fitOpened(const QString& ftcal_text);  ///< The newest calibration of the session just opened, if it has one.
  void gapOpened(const QString& text);        ///< What was kept of its diagnosis as state "gap", likewise.
  void fitStored(bool is_stored);             ///< Where it is not, failed tells why.
  /// Of the session just opened; what still holds where another one was refused.
  void takeLengthKnown(const fieldtrue::acquisition::TakeLength& length);
  /// What the user should know of the session and of what records it; no failure.
  void remarked(const QString& message, fieldtrue::acquisition::RemarkKind kind);
  void failed(const QString& message);  ///< One sentence for the message line.

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fieldtrue::acquisition

Q_DECLARE_METATYPE(fieldtrue::acquisition::AcquisitionStatus)
Q_DECLARE_METATYPE(fieldtrue::Node)
Q_DECLARE_METATYPE(fieldtrue::CalibrationTable)
Q_DECLARE_METATYPE(fieldtrue::SampleTable)
