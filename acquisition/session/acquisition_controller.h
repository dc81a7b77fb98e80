#pragma once

#include <QObject>
#include <QString>
#include <QVector>
#include <memory>
#include <optional>
#include <vector>

#include "acquisition/devices/tracker_device.h"
#include "acquisition/session/node_sampler.h"
#include "acquisition/session/session_store.h"

namespace fieldtrue {

/// Everything a view needs to know of a running acquisition, as one value.
struct AcquisitionStatus {
  QString session_path;
  std::vector<PlannedPlace> places;    ///< In visiting order.
  std::vector<PlaceState> states;      ///< Same length.
  std::optional<std::size_t> current;  ///< Where the sensor is to be put now; none when all is done.
  bool current_is_retake = false;
  TakeState take = TakeState::kIdle;
  int collected = 0;
  int wanted = 60;
  bool automatic = false;  ///< Takes by itself when the sensor stands still near the place.
  bool still = false;
  QString reason;          ///< One line: "hold still: moving 4 mm/s", "press space", "retaking: moved 3 mm".
  bool attention = false;  ///< The reason needs the operator's attention.
  DeviceState device = DeviceState::kClosed;
  QString device_text;
  std::optional<Sample> live;  ///< Newest reading.
  double rate_hz = 0.0;
  double sd_m = 0.0;             ///< 3-D SD of the last half second.
  Pose reference_from_tracker;   ///< Best rigid guess so far: fitted from the places done, before that the scene's or
                                 ///< identity.
  bool reference_known = false;  ///< At least 4 places not in one plane (or the alignment is known).
  std::optional<double> distance_m;  ///< From the live position to the current place, by that guess.
  std::size_t n_done = 0, n_skipped = 0;
  bool can_undo = false, can_redo = false;
};

/// Runs an acquisition: device, sampler and store.
///
/// Automatic mode takes when the sensor stands still near the current place (frame relation known), or has stood still
/// for 0.7 s after having moved since the last take (not known yet; 3 s when it was found standing at the very start).
/// The same stand is never taken twice by itself: it must be moved or lifted, or the take asked for. Lives in one
/// worker thread (or in the main thread of the command line); all calls are slots, all answers are signals carrying
/// whole values.
class AcquisitionController : public QObject {
  Q_OBJECT
 public:
  explicit AcquisitionController(SamplerOptions options = {}, QObject* parent = nullptr);
  ~AcquisitionController() override;

  /// Takes over a device made elsewhere and starts it, in place of the one before.
  /// @param reference_from_tracker what is believed of the transmitter's place before the first place is taken
  void adoptDevice(std::unique_ptr<TrackerDevice> device, const Pose& reference_from_tracker = {});
  /// The value of the last or next statusChanged, at once.
  AcquisitionStatus status() const;

 public slots:
  /// Connects a device by its text ("simulated", "fastrak:/dev/ttyUSB0@115200"); emits statusChanged, or failed.
  /// @param scene_path for the simulated tracker; empty = clean room
  void connectDevice(const QString& device, const QString& scene_path);
  void disconnectDevice();
  /// Takes over a session file. @param create_plan_json when not empty, the file is created with this plan (JSON, or
  /// the text readPlan knows). The session before stays open when this one cannot be opened.
  void openSession(const QString& path, const QString& create_plan_json);
  void closeSession();
  void take();  ///< Starts collecting at the current place (space bar, Page Down).
  void cancelTake();
  void skip();
  void undo();
  void redo();
  void goTo(int place);  ///< Makes any place current: retake it. -1 goes back to the first one not done.
  void setAutomatic(bool automatic);
  void setSamplesPerNode(int count);
  void setSessionState(const QString& key, const QString& value);  ///< SessionStore::setState.
  void storeFit(const QString& name, const QString& ftcal_text);
  /// Answers with tablesReady.
  void requestTables();

 signals:
  void statusChanged(const fieldtrue::AcquisitionStatus& status);                      ///< At most about 30 a second.
  void nodeStored(int place, const fieldtrue::Node& node, const QString& suspicious);  ///< It is on disk.
  void takeFailed(const QString& reason);
  void finished();  ///< No place is left.
  void tablesReady(const fieldtrue::CalibrationTable& table, const fieldtrue::SampleTable& samples);
  void sessionOpened(const QString& path, const QString& page, const QString& plan_json);
  void fitOpened(const QString& ftcal_text);  ///< The newest calibration of the session just opened, if it has one.
  void failed(const QString& message);        ///< One sentence for the message line.

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fieldtrue

Q_DECLARE_METATYPE(fieldtrue::AcquisitionStatus)
Q_DECLARE_METATYPE(fieldtrue::Node)
Q_DECLARE_METATYPE(fieldtrue::CalibrationTable)
Q_DECLARE_METATYPE(fieldtrue::SampleTable)
