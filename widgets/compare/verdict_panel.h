#pragma once

#include <QWidget>

#include "calib/evaluation/error_stats.h"
#include "widgets/workbench/compared_methods.h"

class QCheckBox;
class QGridLayout;
class QLabel;
class QVBoxLayout;

namespace fieldtrue::widgets {

class HistogramView;
struct SceneCell;

/// What the comparison comes to: the figures before and after, how they are spread over the places, and what limits
/// them.
class VerdictPanel : public QWidget {
  Q_OBJECT
 public:
  explicit VerdictPanel(QWidget* parent = nullptr);

  void setComparison(const std::optional<evaluation::Comparison>& comparison);
  /// The methods whose errors the histogram shows, those of the views.
  void showMethods(MethodRow left, MethodRow right);
  /// What the views shall draw; empty where a person hid it.
  std::vector<SceneCell> holes() const;
  std::vector<SceneCell> folds() const;

 signals:
  void marksChanged();  ///< Holes or folded cells were shown or hidden.

 private:
  QCheckBox* makeMark(const QString& label, const QString& name);
  void fillFigures();
  void fillNotes();
  void addFigures(int row, const QString& name, const evaluation::ErrorStats& stats, bool bold);
  void addNote(const QString& heading, const QString& text);

  std::optional<evaluation::Comparison> comparison_;
  QWidget* figures_;
  QGridLayout* figures_layout_;
  HistogramView* histogram_;
  QWidget* notes_;
  QVBoxLayout* notes_layout_;
  QCheckBox* show_holes_;
  QCheckBox* show_folds_;
};

}  // namespace fieldtrue::widgets
