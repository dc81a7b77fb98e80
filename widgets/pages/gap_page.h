#pragma once

#include <QWidget>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "calib/core/run_control.h"
#include "calib/gap/gap_report.h"
#include "calib/simulation/scene.h"
#include "widgets/pages/workbench.h"

class QCheckBox;
class QLabel;
class QProgressBar;
class QPushButton;
class QStackedWidget;
class QVBoxLayout;

namespace fieldtrue {

class FieldView;

/// Simulation and reality: where they differ, which unmodelled effect causes it, how far the gap shrinks with it.
class GapPage : public QWidget {
  Q_OBJECT
 public:
  /// Runs on a pool thread. A null scene is an ideal tracker in free space.
  using Diagnose = std::function<Result<GapReport>(const CalibrationTable& table, const SampleTable* samples,
                                                   const Scene* scene, const RunControl& control)>;
  /// @param diagnose none = the diagnosis of calib/gap
  explicit GapPage(Workbench& workbench, Diagnose diagnose = {}, QWidget* parent = nullptr);
  ~GapPage() override;

  /// Takes other rows; what was found on the earlier ones is dropped.
  void setRecording(const CalibrationTable& table, const SampleTable& samples);
  /// The scene the simulator believes; none = an ideal tracker in free space.
  void setScene(const std::optional<Scene>& scene);
  const std::optional<Scene>& scene() const { return scene_; }
  const std::optional<GapReport>& report() const { return report_; }
  bool isDiagnosing() const { return diagnosing_; }
  /// Writes PATH and, beside it, the same as a page: PATH with `.html`. @error kIo
  Result<void> saveReport(const QString& path) const;
  /// @error kIo
  Result<void> saveScene(const QString& path) const;

 signals:
  void changed();  ///< A diagnosis began, ended or was dropped.

 private:
  /// What undo goes back to.
  struct Earlier {
    std::optional<Scene> scene;
    std::optional<GapReport> report;
  };
  /// Where a run that may outlive the page leaves its progress.
  struct ProgressBox;

  QWidget* makeHeader();
  QWidget* makeButtons(QWidget* header);
  QWidget* makeFieldSide();
  QWidget* makeInspector();
  QPushButton* addButton(QWidget* parent, const QString& words, const char* name, void (GapPage::*slot)());
  void run();
  void stop();
  RunControl controlOf(int run);
  void onResult(int run, Result<GapReport> result);
  void runOrStop();
  void addToSimulation();
  void undo();
  void chooseScene();
  void chooseReportFile();
  void chooseSceneFile();
  void tell(const Result<void>& written, const QString& path);
  void showReport();
  void showWords();
  void showField();
  void showCharts();
  void addText(const char* name, const QString& words);
  void showButtons();

  Workbench& workbench_;
  Diagnose diagnose_;
  CalibrationTable table_;
  SampleTable samples_;
  std::optional<Scene> scene_;
  std::vector<Earlier> earlier_;
  std::optional<GapReport> report_;
  std::stop_source stop_;
  std::shared_ptr<ProgressBox> progress_box_;
  int run_count_ = 0;
  bool diagnosing_ = false;

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
  QPushButton* choose_ = nullptr;
  QPushButton* save_report_ = nullptr;
  QPushButton* save_scene_ = nullptr;
  QCheckBox* after_ = nullptr;
  FieldView* field_ = nullptr;
  QWidget* charts_ = nullptr;
  QVBoxLayout* charts_layout_ = nullptr;
};

}  // namespace fieldtrue
