#pragma once

#include <QObject>
#include <QString>
#include <QThread>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>

#include "acquisition/session/acquisition_controller.h"
#include "calib/correctors/corrector.h"
#include "calib/evaluation/comparison.h"
#include "calib/gap/gap_report.h"

namespace fieldtrue {

/// The steps of the work, in the order of the rail.
enum class Step { kStart, kConnect, kPlan, kAcquire, kCompare, kGap, kExport };
QString stepId(Step step);  ///< "acquire"; kept in the session so that it opens where it was.
std::optional<Step> stepFromId(const QString& id);

enum class Severity { kInfo, kAttention, kDanger };

/// One line for the operator: what happened, what to do, and a button that does it.
struct Message {
  QString text;
  Severity severity = Severity::kInfo;
  QString action_label;
  std::function<void()> action;
};

/// What all pages share: the acquisition thread, the open session, its table, the comparison and the fitted
/// calibration. Lives in the window's thread; everything slow runs elsewhere and comes back by signal.
class Workbench : public QObject {
  Q_OBJECT
 public:
  explicit Workbench(QObject* parent = nullptr);
  ~Workbench() override;

  const AcquisitionStatus& status() const { return status_; }
  const CalibrationTable& table() const { return table_; }
  const SampleTable& samples() const { return samples_; }
  const Plan& plan() const { return plan_; }
  bool sessionIsOpen() const { return !session_path_.isEmpty(); }
  const QString& sessionPath() const { return session_path_; }
  const std::optional<Comparison>& comparison() const { return comparison_; }
  const std::optional<Corrector>& corrector() const { return corrector_; }
  /// Whether the calibration was fitted on the rows the session has now.
  bool correctorIsCurrent() const;
  /// Of the rows the session has now.
  const std::optional<GapReport>& gapReport() const { return gap_report_; }
  void setGapReport(std::optional<GapReport> report) { gap_report_ = std::move(report); }
  bool isComparing() const { return comparing_; }
  bool isFitting() const { return fitting_; }

  // Each of these answers by signal.
  void startDemonstration();
  void connectDevice(const QString& device, const QString& scene_path);
  void disconnectDevice();
  void createSession(const QString& path, const Plan& plan, int samples_per_node);
  void openSession(const QString& path);
  void take();
  void cancelTake();
  void skip();
  void undo();
  void redo();
  void goTo(int place);
  void setAutomatic(bool automatic);

  /// Scores the methods on the session's table in the background; an earlier run is stopped.
  void compare(const ComparisonOptions& options);
  void stopComparing();
  /// Fits the chosen methods on every row of role fit and makes the result the session's calibration; one at a time.
  void fit(const CorrectorChoice& choice, AlignMode align);

  void goToStep(Step step);
  void showMessage(Message message);

  /// Folder for sessions made without a file dialog; created when missing.
  static QString sessionFolder();
  /// A path in that folder which does not exist yet.
  static QString freshSessionPath(const QString& stem);
  /// Copies a built-in scene next to the sessions and returns its path.
  static QString builtInScene(const QString& name);

 signals:
  void statusChanged(const fieldtrue::AcquisitionStatus& status);
  void sessionChanged();     ///< Another session is open.
  void tableChanged();       ///< Nodes were stored or taken back.
  void comparisonChanged();  ///< A comparison started, ended or failed.
  void comparisonProgress(double fraction);
  void correctorChanged();
  void fittingChanged();  ///< A fit of the session's calibration began or ended.
  void stepRequested(fieldtrue::Step step);
  void messageShown(const fieldtrue::Message& message);
  void closing();  ///< The window goes: long work of the pages must stop.
  void nodeStored(int place, const fieldtrue::Node& node, const QString& suspicious);

 private:
  void wireController();
  void rememberSession(const QString& path);
  void onSessionOpened(const QString& path, const QString& page, const QString& plan_json);
  void onStatus(const AcquisitionStatus& status);
  void onFitOpened(const QString& ftcal_text);
  void onTables(const CalibrationTable& table, const SampleTable& samples);
  template <class... Arguments, class... Given>
  void post(void (AcquisitionController::*slot)(Arguments...), Given&&... given);

  QThread thread_;
  AcquisitionController* controller_ = nullptr;
  AcquisitionStatus status_;
  QString session_path_;
  Plan plan_;
  CalibrationTable table_;
  SampleTable samples_;
  std::optional<Comparison> comparison_;
  std::optional<Corrector> corrector_;
  std::optional<GapReport> gap_report_;
  std::stop_source comparison_stop_;
  int comparison_run_ = 0;
  bool comparing_ = false;
  std::stop_source fit_stop_;
  bool fitting_ = false;
  bool start_when_connected_ = false;
};

}  // namespace fieldtrue

Q_DECLARE_METATYPE(fieldtrue::Message)
