#pragma once

#include <QWidget>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "calib/core/run_control.h"
#include "calib/gap/diagnosis.h"
#include "calib/gap/report.h"
#include "calib/simulation/scene.h"
#include "widgets/workbench/background.h"
#include "widgets/workbench/workbench.h"

class QCheckBox;
class QLabel;
class QProgressBar;
class QPushButton;
class QStackedWidget;

namespace fieldtrue::widgets {

class FieldView;
class GapInspector;

/// Simulation and reality: where they differ, which unmodelled effect causes it, how far the gap shrinks with it.
class GapPage : public QWidget {
  Q_OBJECT
 public:
  /// Runs on a pool thread. A null scene is an ideal tracker in free space.
  using Diagnose = std::function<Result<gap::GapReport>(
      const CalibrationTable& table, const SampleTable* samples, const simulation::Scene* scene,
      const gap::DiagnosisOptions& options, const RunControl& control)>;
  /// @param diagnose none = the diagnosis of calib/gap
  explicit GapPage(Workbench& workbench, Diagnose diagnose = {}, QWidget* parent = nullptr);
  ~GapPage() override;

  /// Takes other rows; what was found on the earlier ones is dropped.
  /// @param samples its raw samples, asked for when they are diagnosed; none when there are none
  void setRecording(const CalibrationTable& table, std::function<SampleTable()> samples);
  /// The scene the simulator believes; none = an ideal tracker in free space.
  void setScene(const std::optional<simulation::Scene>& scene);
  const std::optional<simulation::Scene>& scene() const { return scene_; }
  const std::optional<gap::GapReport>& report() const { return report_; }
  /// The report, or what some of the places say until there is one.
  const std::optional<gap::GapReport>& shown() const { return report_ ? report_ : provisional_; }
  bool isDiagnosing() const { return jobs_.busy(); }
  /// Diagnoses what changed since an earlier recording, a session or a node table.
  void diagnoseSince(const QString& path);
  /// Writes PATH and, beside it, the same as a page: PATH with `.html`. @error kIo
  Result<void> saveReport(const QString& path) const;
  /// @error kIo
  Result<void> saveScene(const QString& path) const;

 private:
  /// What undo goes back to.
  struct Earlier {
    std::optional<simulation::Scene> scene;
    std::optional<gap::GapReport> report;
  };

  QWidget* makeHeader();
  QWidget* makeButtons(QWidget* header);
  QWidget* makeFieldSide();
  QPushButton* addButton(QWidget* parent, const QString& words, const char* name, void (GapPage::*slot)());
  /// @param against_name of the earlier recording that the options hold
  void run(const gap::DiagnosisOptions& options = {}, const QString& against_name = {});
  void tryAgainAndAgain();
  void chooseEarlier();
  void diagnoseAll(const gap::DiagnosisOptions& options, const QString& against_name);
  void diagnoseIn(double to, const CalibrationTable& table, SampleTable samples, const gap::DiagnosisOptions& options,
                  std::function<void(Result<gap::GapReport>)> done);
  void onResult(Result<gap::GapReport> result, std::shared_ptr<const CalibrationTable> against,
                const QString& against_name);
  void keep();
  void restore();
  void runOrStop();
  bool canAdd() const;
  void addToSimulation();
  void undo();
  void chooseScene();
  void chooseReportFile();
  void chooseSceneFile();
  void tell(const Result<void>& written, const QString& path);
  void showReport();
  void showWords();
  void showField();
  void showButtons();

  Workbench& workbench_;
  Diagnose diagnose_;
  CalibrationTable table_;
  std::function<SampleTable()> samples_;
  std::optional<simulation::Scene> scene_;
  std::vector<Earlier> earlier_;
  std::optional<gap::GapReport> report_;
  std::optional<gap::GapReport> provisional_;        ///< Of some of the places, until there is a report of all.
  std::shared_ptr<const CalibrationTable> against_;  ///< What the report is held against.
  QString against_name_;
  bool is_restored_ = false;  ///< What the open session keeps was looked at.
  bool has_changed_ = false;  ///< The places, since the last diagnosis.
  BackgroundJobs jobs_{this};

  QStackedWidget* stack_;
  QWidget* header_ = nullptr;
  QLabel* headline_ = nullptr;
  QLabel* sentence_ = nullptr;
  QLabel* next_ = nullptr;
  QLabel* believed_ = nullptr;
  QProgressBar* progress_ = nullptr;
  QPushButton* run_ = nullptr;
  QPushButton* add_ = nullptr;
  QPushButton* undo_ = nullptr;
  QPushButton* trust_ = nullptr;
  QPushButton* since_ = nullptr;
  QPushButton* choose_ = nullptr;
  QPushButton* save_report_ = nullptr;
  QPushButton* save_scene_ = nullptr;
  QCheckBox* after_ = nullptr;
  FieldView* field_ = nullptr;
  GapInspector* inspector_ = nullptr;
};

}  // namespace fieldtrue::widgets
