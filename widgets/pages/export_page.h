#pragma once

#include <QWidget>

#include "widgets/pages/workbench.h"
#include "widgets/report/report.h"

class QLabel;
class QListWidget;
class QLineEdit;
class QPushButton;
class QStackedWidget;

namespace fieldtrue {

/// Writes the calibration, the tables and the report to files for other tools.
class ExportPage : public QWidget {
  Q_OBJECT
 public:
  explicit ExportPage(Workbench& workbench, QWidget* parent = nullptr);

 private:
  /// One thing that can be written; every exporter of the registry is one, the tables and the report are the others.
  struct Target {
    QString id;
    QString label;
    QString extension;
    QString reads_it;
    /// Copies what is needed in the window's thread and returns the writing itself, which runs beside it.
    std::function<std::function<Result<void>(const std::string& path)>()> prepare;
  };
  void fillTargets();
  void onTarget();
  void onData();
  void browse();
  void write();
  void onWritten(const QString& path, const Result<void>& written);
  ReportInput reportInput() const;
  QString suggestedPath(const Target& target) const;
  const Target* chosen() const;

  Workbench& workbench_;
  std::vector<Target> targets_;
  QStackedWidget* stack_;
  QListWidget* list_;
  QLabel* about_;
  QLabel* calibration_;
  QLineEdit* path_;
  QPushButton* write_;
};

}  // namespace fieldtrue
