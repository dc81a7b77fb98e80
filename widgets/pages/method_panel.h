#pragma once

#include <QWidget>
#include <span>

#include "calib/core/settings.h"
#include "widgets/pages/score_model.h"

class QComboBox;
class QTableView;

namespace fieldtrue {

class SettingsForm;

/// Every method of one part (position or orientation): its held-out figures, the choice of one, and that one's
/// settings.
class MethodPanel : public QWidget {
  Q_OBJECT
 public:
  /// @param name begins the object names of the table and the choice: "position" gives "positionTable",
  /// "positionMethod"
  MethodPanel(ScoreModel::Part part, const QString& name, QWidget* parent = nullptr);
  void setComparison(const std::optional<Comparison>& comparison);
  QString method() const;  ///< Id of the chosen one.
  QString label() const;
  Settings settings() const;
  /// @param method id; empty = none
  void choose(const QString& method);

 signals:
  void methodChanged();

 private:
  struct Entry {
    std::string id;
    std::string label;
    std::span<const Setting> settings;
  };
  static std::vector<Entry> entriesOf(ScoreModel::Part part);
  void makeTable(const QString& name);

  std::vector<Entry> entries_;
  ScoreModel* scores_;
  QSortFilterProxyModel* sorted_;
  QTableView* table_;
  QComboBox* choice_;
  SettingsForm* form_;
};

}  // namespace fieldtrue
