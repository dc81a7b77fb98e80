#pragma once

#include <QAbstractTableModel>
#include <QSortFilterProxyModel>
#include <optional>
#include <vector>

#include "calib/evaluation/comparison.h"

namespace fieldtrue {

/// Held-out figures of every method, the same numbers as `compare --json`: best in bold, worse than before marked.
class ScoreModel : public QAbstractTableModel {
  Q_OBJECT
 public:
  enum class Part { kPosition, kOrientation };
  enum Column { kMethod, kRms, kMean, kP95, kMax, kUncovered, kColumnCount };
  /// The value to sort by, under this role.
  static constexpr int kSortRole = Qt::UserRole + 1;

  explicit ScoreModel(Part part, QObject* parent = nullptr);
  void setComparison(const std::optional<Comparison>& comparison);
  /// The method of a row; row 0 is "before".
  QString method(int row) const;
  int rowOf(const QString& method) const;  ///< -1 when it is not there.
  bool anyUncovered() const;
  /// The table as tab-separated text, for the clipboard.
  QString toText() const;

  int rowCount(const QModelIndex& parent = {}) const override;
  int columnCount(const QModelIndex& parent = {}) const override;
  QVariant data(const QModelIndex& index, int role) const override;
  QVariant headerData(int section, Qt::Orientation orientation, int role) const override;

 private:
  struct Row {
    QString label;
    QString method;
    std::optional<ErrorStats> stats;
    int n_uncovered = 0;
    QString why_skipped;
    QString notes;
    bool best = false;
    bool worse = false;
  };
  QVariant text(const Row& row, int column) const;
  std::optional<double> value(const Row& row, int column) const;
  Part part_;
  std::vector<Row> rows_;
};

}  // namespace fieldtrue
