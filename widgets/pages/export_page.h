#pragma once

#include <QStringList>
#include <QWidget>
#include <stop_token>

#include "widgets/pages/export_targets.h"
#include "widgets/workbench/background.h"
#include "widgets/workbench/workbench.h"

class QCheckBox;
class QComboBox;
class QDoubleSpinBox;
class QLabel;
class QListWidget;
class QListWidgetItem;
class QLineEdit;
class QProgressBar;
class QPushButton;
class QStackedWidget;

namespace fieldtrue::widgets {

/// Writes the calibration, the tables and the report to files for other tools.
class ExportPage : public QWidget {
  Q_OBJECT
 public:
  explicit ExportPage(Workbench& workbench, QWidget* parent = nullptr);

 private:
  struct File {
    QString path;
    const ExportTarget* target = nullptr;
  };
  /// One file on its way to the disk.
  struct Writing {
    QString path;
    ExportWriting write;
    Result<std::string> result;
  };
  void fillList();
  QWidget* makeBake();
  void onTarget();
  void onData();
  void showCalibration();
  void showSensors();
  /// What the comparison says of the calibration; empty where there is none of the present places.
  QString verdictOnCalibration() const;
  QString setupOfCalibration() const;
  void browse();
  QString pathProblem() const;
  void write();
  void askToReplace(const QStringList& present);
  static std::vector<Writing> writeAll(std::vector<Writing> writings, const RunControl& control,
                                       const std::stop_source& stopping);
  void stop();
  void onWritten(const Result<std::vector<Writing>>& result);
  void suggest(const QString& path);
  void showBusy();
  std::vector<File> files() const;
  QString suggestedName(const ExportTarget& target) const;
  const ExportTarget* chosen() const;
  /// Those that are ticked; where none is, the chosen one is meant.
  std::vector<const ExportTarget*> wanted() const;

  Workbench& workbench_;
  std::vector<ExportTarget> targets_;
  std::vector<QListWidgetItem*> items_;  ///< Of each target.
  QStackedWidget* stack_;
  QListWidget* list_;
  QLabel* about_;
  QLabel* calibration_;
  QWidget* bake_row_;
  QCheckBox* bake_;
  QCheckBox* inverse_;
  QComboBox* sensor_;
  QLabel* pitch_;
  QDoubleSpinBox* deviation_;
  QLineEdit* path_;
  QString suggested_;        ///< Stands in path_ until it is typed over.
  QStringList replaceable_;  ///< Files that may be written over: the person was asked, or they were written from here.
  BackgroundJobs jobs_{this};
  std::stop_source stopping_;  ///< Of the files being written: what is stopped by it still tells what became of them.
  QPushButton* write_;
  QPushButton* stop_;
  QProgressBar* progress_;
};

}  // namespace fieldtrue::widgets
