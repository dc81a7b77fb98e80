#pragma once

#include <QWidget>
#include <functional>
#include <optional>

#include "calib/evaluation/comparison.h"

class QComboBox;
class QGridLayout;
class QLabel;
class QTableWidget;

namespace fieldtrue::widgets {

struct PlaceResidual;

/// Everything known of one place: what was measured there, and what each compared method leaves of its error.
class PlacePanel : public QWidget {
  Q_OBJECT
 public:
  explicit PlacePanel(QWidget* parent = nullptr);

  /// @param samples_at the raw samples of a place, asked for when the place is shown
  void setData(const CalibrationTable& table, std::function<SampleTable(int node)> samples_at,
               const std::optional<evaluation::Comparison>& comparison);
  /// @param node place; none, or one not in the table, shows what to do
  void setNode(std::optional<int> node);
  std::optional<int> node() const { return node_; }

 signals:
  void nodeChosen(int node);

 private:
  void fillPlaces();
  void fillVisits();
  void showRow();
  void showResiduals();
  void fill(QTableWidget* table, const std::vector<PlaceResidual>& residuals);
  QTableWidget* makeTable(const QString& name, const QString& title, const QString& unit);

  CalibrationTable table_;
  std::function<SampleTable(int)> samples_at_;
  std::optional<evaluation::Comparison> comparison_;
  std::optional<int> node_;
  QComboBox* places_;
  QComboBox* visits_;
  QWidget* facts_;
  QGridLayout* facts_layout_;
  QLabel* note_;
  QTableWidget* position_;
  QTableWidget* orientation_;
};

}  // namespace fieldtrue::widgets
