#pragma once

#include <QWidget>

#include "widgets/compare/score_model.h"

class QHBoxLayout;
class QLabel;
class QPushButton;
class QTableView;

namespace fieldtrue::widgets {

class SettingsForm;

/// Every method of one part (position or orientation): its held-out figures, whether the next comparison takes it, and
/// the settings of the one chosen. Changing a setting adds the method a second time, with that setting.
class MethodPanel : public QWidget {
  Q_OBJECT
 public:
  /// @param name begins the object names: "position" gives "positionTable", "positionAll" and so on
  MethodPanel(ScoreModel::Part part, const QString& name, QWidget* parent = nullptr);
  void setComparison(const std::optional<evaluation::Comparison>& comparison);
  QString method() const;  ///< Id of the chosen one, "none" for before.
  QString label() const;
  /// Why the chosen method cannot be fitted as it stands; empty when it can.
  QString whyUnusable() const;
  Settings settings() const;
  /// @param method id; empty or "none" = before
  void choose(const QString& method);
  /// The methods the next comparison takes.
  std::vector<MethodText> ticked() const { return tickedMethods(scores_->entries()); }
  std::vector<MethodText> tickedQuick() const { return quickMethods(part_, scores_->entries()); }
  int tickedCount() const;

 signals:
  void methodChanged();
  void ticksChanged();

 private:
  void makeTable(const QString& name);
  QWidget* makeTicks(const QString& name);
  void onRow();
  void onSettings();
  void removeVariant();
  void showTicks();
  int currentRow() const;
  void chooseRow(int row);

  ScoreModel::Part part_;
  ScoreModel* scores_;
  QSortFilterProxyModel* sorted_;
  QTableView* table_;
  QLabel* ticks_;
  QLabel* about_;
  QPushButton* remove_;
  SettingsForm* form_;
  QString method_ = QStringLiteral("none");
  Settings settings_;
  bool setting_up_ = false;
};

}  // namespace fieldtrue::widgets
