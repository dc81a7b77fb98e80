#pragma once

#include <QObject>
#include <QString>
#include <QThread>
#include <QTimer>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "acquisition/session/acquisition_controller.h"
#include "calib/calibration/alignment.h"
#include "calib/calibration/corrector.h"
#include "calib/evaluation/comparison.h"
#include "calib/gap/report.h"
#include "widgets/workbench/background.h"

namespace fieldtrue::widgets {

enum class Severity { kInfo, kAttention, kDanger };

/// One line for the operator: what happened, what to do, and a button that does it. It belongs to a condition and goes
/// with it; conditions nest: "session" holds "session/take/12". Without one it belongs to the page it was said on.
struct Message {
  QString text;
  Severity severity = Severity::kInfo;
  QString action_label;
  std::function<void()> action;
  QString condition = {};
};

/// What all pages share: the acquisition thread, the open session, its table, the comparison and the fitted
/// calibration. Lives in the window's thread; everything slow runs elsewhere and comes back by signal.
class Workbench : public QObject {
  Q_OBJECT
 public:
  explicit Workbench(QObject* parent = nullptr);
  ~Workbench() override;

  const acquisition::AcquisitionStatus& status() const { return status_; }
  /// The session's rows, or those of the chosen sensor.
  const CalibrationTable& table() const;
  /// Every row of the session.
  CalibrationTable recordedTable() const;
  /// With rows in the session.
  std::vector<int> sensors() const;
  /// None: the rows of all are used.
  std::optional<int> chosenSensor() const { return chosen_sensor_; }
  void chooseSensor(std::optional<int> sensor);
  /// Whether a table may be worked on: its units can be right. If not, says why in a message, whose action uses them
  /// anyway.
  /// @param then what goes on after that
  bool mayUse(const CalibrationTable& table, const std::function<void()>& then = {});
  /// Why not, as it was last said; empty when they may.
  const QString& refusal() const { return refusal_; }
  /// Every raw sample of the session; large, made on request.
  SampleTable samples() const;
  /// Those of one place.
  SampleTable samplesAt(int node) const;
  const acquisition::Plan& plan() const { return plan_; }
  bool sessionIsOpen() const { return !session_path_.isEmpty(); }
  /// Whether a session is open of which it is not known yet what was taken.
  bool isOpening() const { return is_opening_; }
  const QString& sessionPath() const { return session_path_; }
  const std::optional<evaluation::Comparison>& comparison() const { return comparison_; }
  const std::optional<calibration::Corrector>& corrector() const { return corrector_; }
  /// Whether the session keeps the calibration; none while that is not known yet.
  std::optional<bool> correctorIsKept() const { return corrector_is_kept_; }
  /// Whether the calibration was fitted on the rows the session has now of the sensors that it was fitted to.
  bool correctorIsCurrent() const;
  /// False for a calibration that leaves position and orientation as they are.
  bool correctorCorrects() const;
  /// Of the rows the session has now.
  const std::optional<gap::GapReport>& gapReport() const { return gap_report_; }
  void setGapReport(std::optional<gap::GapReport> report);
  /// What the session keeps of its diagnosis, as text of the Gap page's own; empty when nothing.
  const QString& keptGap() const { return kept_gap_; }
  void keepGap(const QString& text);
  bool isComparing() const { return comparison_jobs_.busy(); }
  /// How many of the methods asked for the comparison tells; fewer than wanted while slow ones run or after a stop.
  struct MethodCount {
    int done = 0;
    int wanted = 0;
  };
  MethodCount comparedMethods() const { return compared_; }
  /// Whether the comparison is of the rows the session has now.
  bool comparisonIsCurrent() const { return comparison_.has_value() && compared_rows_ == rows_version_; }
  /// Whether nothing is to come: every method asked for was tried on the rows the session has now.
  bool comparisonIsFinal() const {
    return comparisonIsCurrent() && !isComparing() && compared_.done >= compared_.wanted;
  }
  bool isFitting() const { return fit_jobs_.busy(); }

  // Each of these answers by signal.
  void startDemonstration();
  void connectDevice(const QString& device, const QString& scene_path);
  void disconnectDevice();
  void requestSignal();  ///< Answers with signalReady.
  /// Writes the last bytes of the tracker's line into a new file beside the session, or in the folder of sessions; a
  /// message says where, or why not.
  void saveTrace();
  void setSetup(const Setup& stated);           ///< AcquisitionController::setSetup.
  void setSetupOfTracker(const Setup& stated);  ///< AcquisitionController::setSetupOfTracker.
  void createSession(const QString& path, const acquisition::Plan& plan, const acquisition::TakeLength& length = {});
  void openSession(const QString& path);
  /// Of the open session, from its next take on; nothing where none is open.
  void setTakeLength(const acquisition::TakeLength& length);
  void take();
  void keepTake();
  void waitLonger();
  void takeAgain();
  void setAtTimeLimit(acquisition::AtTimeLimit at_time_limit);  ///< At first a person is asked.
  void cancelTake();
  void skip();
  void undo();
  void redo();
  void goTo(int place);
  void setAutomatic(bool automatic);
  void setSensors(const std::vector<int>& sensors);  ///< AcquisitionController::setSensors.

  /// Scores the methods on the session's table in the background; an earlier run is stopped.
  /// @param count how many of the methods a person asked for take part in this run
  void compare(const evaluation::ComparisonOptions& options, MethodCount count);
  void stopComparing();
  /// Fits the chosen methods on every row of role fit and makes the result the session's calibration; one at a time.
  void fit(const calibration::CorrectorChoice& choice, calibration::AlignMode align);

  /// @param page its id, "acquire"; kept in the session so that it opens where it was
  void goToPage(const QString& page);
  void importFile(const QString& path);          ///< Shows it on the page that imports.
  void compareWith(const QString& calibration);  ///< Shows it as the earlier one of two calibrations.
  void showMessage(const Message& message);
  /// What was said of a condition, or of one within it, is no longer so.
  void endCondition(const QString& condition) { emit conditionEnded(condition); }

  /// Folder for sessions made without a file dialog; created when missing.
  static QString sessionFolder();
  /// A path in a folder which does not exist yet: STEM-DATE-TIME.ENDING.
  static QString freshPath(const QString& folder, const QString& stem, const QString& ending);
  /// A session's, in that folder.
  static QString freshSessionPath(const QString& stem);
  /// Copies a built-in scene next to the sessions and returns its path.
  static QString builtInScene(const QString& name);

 signals:
  void statusChanged(const fieldtrue::acquisition::AcquisitionStatus& status);
  void signalReady(const fieldtrue::acquisition::SignalSnapshot& snapshot);
  void sessionChanged();  ///< Another session is open.
  /// AcquisitionController::takeLengthKnown.
  void takeLengthKnown(const fieldtrue::acquisition::TakeLength& length);
  void tableChanged();       ///< Nodes were stored or taken back.
  void comparisonChanged();  ///< A comparison started, ended or failed.
  void comparisonProgress(double fraction);
  void correctorChanged();  ///< There is another one, or it is known whether the session keeps it.
  void gapReportChanged();
  void fittingChanged();  ///< A fit of the session's calibration began or ended.
  void pageRequested(const QString& page);
  void importRequested(const QString& path);
  void earlierCalibrationChosen(const QString& path);
  void messageShown(const fieldtrue::widgets::Message& message);
  void conditionEnded(const QString& condition);
  void closing();  ///< The window goes: long work of the pages must stop.

 private:
  void wireController();
  void rememberSession(const QString& path);
  void onSessionOpened(const QString& path, const QString& page, const QString& plan_json);
  void onStatus(const acquisition::AcquisitionStatus& status);
  void endWhatIsOver(const acquisition::AcquisitionStatus& now);
  void tellMisfits(const acquisition::AcquisitionStatus& before, const acquisition::AcquisitionStatus& now);
  void onNodesStored(int place, const QString& suspicious);
  void onTakeFailed(const QString& reason, int place);
  void onTakeRefused(int place, double off_m);
  QString nameOf(int place) const;
  void onTrace(const std::shared_ptr<const acquisition::Trace>& trace);
  void onFitOpened(const QString& ftcal_text);
  void onFitStored(bool is_stored);
  void stopFitting();
  void onTables(const CalibrationTable& table, const SampleTable& samples);
  void onPlace(int place, const std::vector<Node>& nodes, const std::vector<Sample>& samples);
  void changeTable();
  template <class... Arguments, class... Given>
  void post(void (acquisition::AcquisitionController::*slot)(Arguments...), Given&&... given);
  /// The same, but nothing where another session is open by then.
  template <class... Arguments, class... Given>
  void postToSession(void (acquisition::AcquisitionController::*slot)(Arguments...), Given&&... given);

  QThread thread_;
  acquisition::AcquisitionController* controller_ = nullptr;
  acquisition::AcquisitionStatus status_;
  QString session_path_;
  acquisition::Plan plan_;
  /// One place of the plan as the session holds it.
  struct PlaceRows {
    int node = 0, visit = 0;
    std::vector<Node> rows;  ///< One a sensor, the leading one first.
    std::vector<Sample> samples;
  };
  std::vector<PlaceRows> places_;
  std::vector<SampleRow> loose_samples_;
  void refuse(const std::string& why, const QString& action_label, std::function<void()> action);
  std::optional<int> chosen_sensor_;
  bool is_opening_ = false;
  bool uses_any_units_ = false;
  QString refusal_;
  mutable CalibrationTable table_;  ///< Made from places_ when it is asked for.
  mutable bool table_is_stale_ = false;
  QTimer table_timer_;
  std::optional<evaluation::Comparison> comparison_;
  std::optional<calibration::Corrector> corrector_;
  std::optional<bool> corrector_is_kept_;
  std::optional<gap::GapReport> gap_report_;
  QString kept_gap_;
  BackgroundJobs comparison_jobs_{this};
  MethodCount compared_;
  int rows_version_ = 0;  ///< Counts the tables that arrived.
  int compared_rows_ = -1;
  BackgroundJobs fit_jobs_{this};
  BackgroundJobs trace_jobs_{this};
  std::set<int> spoken_of_;     ///< Places that a message may stand for.
  QString demonstration_path_;  ///< A demonstration about to begin: it takes by itself once its tracker runs.
};

}  // namespace fieldtrue::widgets

Q_DECLARE_METATYPE(fieldtrue::widgets::Message)
