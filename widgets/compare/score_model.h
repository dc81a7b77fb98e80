#pragma once

#include <QAbstractTableModel>
#include <QSortFilterProxyModel>
#include <optional>
#include <vector>

#include "calib/evaluation/error_stats.h"
#include "widgets/compare/method_list.h"

namespace fieldtrue::widgets {

/// Held-out figures of every method, the same numbers as `compare --json`: best in bold, those as good as it and those
/// worse than before marked. Methods that were not compared stand below; a tick says which ones the next comparison
/// takes.
class ScoreModel : public QAbstractTableModel {
  Q_OBJECT
 public:
  using Part = MethodPart;
  enum Column { kMethod, kRms, kToBest, kP95, kMax, kMean, kMedian, kUncovered, kFit, kColumnCount };
  /// The value to sort by, under this role.
  static constexpr int kSortRole = Qt::UserRole + 1;

  explicit ScoreModel(Part part, QObject* parent = nullptr);
  void setComparison(const std::optional<evaluation::Comparison>& comparison);
  /// What can be compared; a row of the comparison with the same settings carries the tick of its entry.
  void setEntries(const std::vector<MethodEntry>& entries);
  const std::vector<MethodEntry>& entries() const { return entries_; }
  void tick(std::size_t entry, bool on);

  QString method(int row) const;  ///< Id; empty for "before".
  Settings settings(int row) const;
  std::optional<std::size_t> entry(int row) const;
  int rowOf(const QString& method) const;  ///< The first row of a method; -1 when it is not there.
  int rowOfEntry(std::size_t entry) const;
  bool isScored(int row) const;
  bool isUsable(int row) const;  ///< Scored, and not left out for want of data.
  bool anyUncovered() const;
  /// What there is to say of a row in words: why it cannot be used, what its fit noted, how it was judged.
  QString about(int row) const;
  /// The table as tab-separated text, for the clipboard.
  QString toText() const;

  int rowCount(const QModelIndex& parent = {}) const override;
  int columnCount(const QModelIndex& parent = {}) const override;
  QVariant data(const QModelIndex& index, int role) const override;
  bool setData(const QModelIndex& index, const QVariant& value, int role) override;
  Qt::ItemFlags flags(const QModelIndex& index) const override;
  QVariant headerData(int section, Qt::Orientation orientation, int role) const override;

 signals:
  void ticksChanged();

 private:
  struct Row {
    QString label;
    std::string method;
    Settings settings;
    std::optional<evaluation::ErrorStats> stats;
    std::optional<evaluation::MethodScore> score;  ///< Without its places.
    std::optional<std::size_t> entry;
    bool best = false;
    bool worse = false;
  };
  void rebuild();
  Row rowOf(const evaluation::MethodScore& score, bool best, const std::optional<evaluation::ErrorStats>& before) const;
  QVariant text(const Row& row, int column) const;
  QString toBestText(const Row& row) const;
  std::optional<double> value(const Row& row, int column) const;
  QVariant color(const Row& row) const;

  Part part_;
  std::optional<evaluation::Comparison> comparison_;
  std::vector<MethodEntry> entries_;
  std::vector<Row> rows_;
};

}  // namespace fieldtrue::widgets
