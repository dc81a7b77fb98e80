#pragma once

#include <QScrollArea>
#include <optional>

#include "calib/gap/report.h"

class QVBoxLayout;

namespace fieldtrue::widgets {

/// Beside the field of a gap: the charts of its diagnosis, then what else was found.
class GapInspector : public QScrollArea {
  Q_OBJECT
 public:
  explicit GapInspector(QWidget* parent = nullptr);

  /// @param report none = nothing to show
  void setReport(const std::optional<gap::GapReport>& report);

 private:
  void addText(const char* name, const QString& words);

  QWidget* charts_;
  QVBoxLayout* layout_;
};

}  // namespace fieldtrue::widgets
