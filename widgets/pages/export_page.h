#pragma once

#include <QWidget>

#include "calib/exporters/exporter.h"
#include "widgets/report/report.h"
#include "widgets/workbench/workbench.h"

class QCheckBox;
class QDoubleSpinBox;
class QLabel;
class QListWidget;
class QListWidgetItem;
class QLineEdit;
class QPushButton;
class QStackedWidget;

namespace fieldtrue::widgets {

/// Writes the calibration, the tables and the report to files for other tools.
class ExportPage : public QWidget {
  Q_OBJECT
 public:
  explicit ExportPage(Workbench& workbench, QWidget* parent = nullptr);

 private:
  using Writing = std::function<Result<std::string>(const std::string& path)>;
  /// One thing that can be written; every exporter of the registry is one, the tables and the report are the others.
  struct Target {
    QString id;
    QString label;
    QString extension;
    QString reads_it;
    QString section;                                ///< The heading it stands under.
    const exporters::Exporter* exporter = nullptr;  ///< Of a calibration's format.
    /// Copies what is needed in the window's thread and returns the writing itself, which runs beside it and answers
    /// with what is to be said of it.
    std::function<Writing()> prepare;
  };
  void fillTargets();
  void fillList();
  QWidget* makeBake();
  Writing calibrationWriter(const exporters::Exporter& exporter) const;
  std::optional<exporters::HeldOutError> heldOutError() const;
  void onTarget();
  void onDirection();
  void onData();
  void showCalibration();
  /// What the comparison says of the calibration; empty where there is none of the present places.
  QString verdictOnCalibration() const;
  QString setupOfCalibration() const;
  void browse();
  void write();
  void onWritten(const QString& path, const Result<std::string>& written);
  ReportInput reportInput() const;
  QString suggestedPath(const Target& target) const;
  const Target* chosen() const;

  Workbench& workbench_;
  std::vector<Target> targets_;
  std::vector<QListWidgetItem*> items_;  ///< Of each target.
  QStackedWidget* stack_;
  QListWidget* list_;
  QLabel* about_;
  QLabel* calibration_;
  QWidget* bake_row_;
  QCheckBox* bake_;
  QCheckBox* inverse_;
  QLabel* pitch_;
  QDoubleSpinBox* deviation_;
  QLineEdit* path_;
  QString replaceable_;  ///< A file that may be written over: the person was asked, or it was written from here.
  QPushButton* write_;
};

}  // namespace fieldtrue::widgets
