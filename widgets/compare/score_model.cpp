#include "widgets/compare/score_model.h"

#include <QFont>
#include <QLocale>
#include <QStringList>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/evaluation/error_stats.h"
#include "calib/evaluation/verdict.h"
#include "widgets/style/theme.h"
#include "widgets/style/unit_texts.h"

namespace fieldtrue::widgets {
namespace {

constexpr double kNotCompared = std::numeric_limits<double>::max();
constexpr double kUnusable = 0.5 * std::numeric_limits<double>::max();

/// With a true minus sign before negative numbers, which tables align.
QString signedFigures(double value, int decimals) {
  const double scale = std::pow(10.0, decimals);
  const double rounded = std::round(value * scale) / scale;
  const QString figures = QLocale::c().toString(std::abs(rounded), 'f', decimals);
  return rounded < 0.0 ? QStringLiteral("\u2212") + figures : figures;
}

/// Decimals that show a value to three figures.
int decimalsOf(double value) {
  return value > 0.0 ? std::clamp(2 - static_cast<int>(std::floor(std::log10(value))), 0, 6) : 2;
}

bool asGoodAsBest(const evaluation::MethodScore& score) { return score.rms_to_best_low90 <= evaluation::kTie; }

}  // namespace

ScoreModel::ScoreModel(Part part, QObject* parent) : QAbstractTableModel(parent), part_(part) {}

void ScoreModel::setComparison(const std::optional<evaluation::Comparison>& comparison) {
  comparison_ = comparison;
  rebuild();
}

void ScoreModel::setEntries(const std::vector<MethodEntry>& entries) {
  entries_ = entries;
  rebuild();
}

void ScoreModel::tick(std::size_t entry, bool on) {
  entries_.at(entry).ticked = on;
  const int row = rowOfEntry(entry);
  if (row >= 0) emit dataChanged(index(row, kMethod), index(row, kMethod), {Qt::CheckStateRole});
  emit ticksChanged();
}

ScoreModel::Row ScoreModel::rowOf(const evaluation::MethodScore& score, bool best,
                                  const std::optional<evaluation::ErrorStats>& before) const {
  Row row;
  row.label = methodLabel(part_, score.method, score.settings);
  row.method = score.method;
  row.settings = score.settings;
  row.best = best;
  row.score = score;
  row.score->place_errors.clear();
  row.score->residual_m.clear();
  row.score->place_covered.clear();
  if (!score.skipped) {
    row.stats = score.stats;
    row.worse = before && score.stats.rms > before->rms + evaluation::kTie;
  }
  return row;
}

void ScoreModel::rebuild() {
  beginResetModel();
  rows_.clear();
  std::vector<bool> placed(entries_.size(), false);
  if (comparison_) {
    const bool position = part_ == Part::kPosition;
    const std::optional<evaluation::ErrorStats> before =
        position ? std::optional(comparison_->before_position_mm) : comparison_->before_orientation_deg;
    Row& first = rows_.emplace_back();
    first.label = tr("Before");
    first.stats = before;
    const std::vector<evaluation::MethodScore>& scores = position ? comparison_->position : comparison_->orientation;
    const auto best_row = position ? comparison_->best_position_row : comparison_->best_orientation_row;
    for (std::size_t k = 0; k < scores.size(); ++k) {
      if (scores[k].method == "none") continue;
      Row& row = rows_.emplace_back(rowOf(scores[k], best_row == k, before));
      for (std::size_t entry = 0; entry < entries_.size() && !row.entry; ++entry)
        if (!placed[entry] && entries_[entry].id == row.method && entries_[entry].settings == row.settings)
          row.entry = entry;
      if (row.entry) placed[*row.entry] = true;
    }
  }
  for (std::size_t entry = 0; entry < entries_.size(); ++entry) {
    if (placed[entry]) continue;
    Row& row = rows_.emplace_back();
    row.label = methodLabel(part_, entries_[entry].id, entries_[entry].settings);
    row.method = entries_[entry].id;
    row.settings = entries_[entry].settings;
    row.entry = entry;
  }
  endResetModel();
}

QString ScoreModel::method(int row) const {
  return QString::fromStdString(rows_.at(static_cast<std::size_t>(row)).method);
}
Settings ScoreModel::settings(int row) const { return rows_.at(static_cast<std::size_t>(row)).settings; }
std::optional<std::size_t> ScoreModel::entry(int row) const { return rows_.at(static_cast<std::size_t>(row)).entry; }

int ScoreModel::rowOf(const QString& method) const {
  for (std::size_t row = 0; row < rows_.size(); ++row)
    if (rows_[row].method == method.toStdString()) return static_cast<int>(row);
  return -1;
}

int ScoreModel::rowOfEntry(std::size_t entry) const {
  for (std::size_t row = 0; row < rows_.size(); ++row)
    if (rows_[row].entry == entry) return static_cast<int>(row);
  return -1;
}

bool ScoreModel::isScored(int row) const { return rows_.at(static_cast<std::size_t>(row)).score.has_value(); }

bool ScoreModel::isUsable(int row) const { return rows_.at(static_cast<std::size_t>(row)).stats.has_value(); }

bool ScoreModel::anyUncovered() const {
  return std::any_of(rows_.begin(), rows_.end(),
                     [](const Row& row) { return row.score && row.score->n_uncovered > 0; });
}

QString ScoreModel::about(int row_number) const {
  const Row& row = rows_.at(static_cast<std::size_t>(row_number));
  if (row.method.empty())
    return row.stats || !comparison_ ? tr("The error as tracked, after the rigid alignment where that is refitted.")
                                     : tr("The table has no orientation.");
  if (!row.score) return tr("Not compared yet: ticked, it takes part when the methods are compared again.");
  if (row.score->skipped) return tr("Cannot be used here: %1").arg(QString::fromStdString(*row.score->skipped));
  QStringList words;
  if (row.best) words << tr("The best here.");
  if (!row.best && asGoodAsBest(*row.score))
    words << tr("As good as the best: the 90 % interval of the difference holds zero.");
  if (row.score->n_uncovered > 0)
    words << tr("%1 places are not covered; they count with their reading unchanged.").arg(row.score->n_uncovered);
  for (const std::string& note : row.score->notes) words << QString::fromStdString(note);
  words << (row.score->closed_form ? tr("Held out in closed form, %1 parts.").arg(row.score->n_folds)
                                   : tr("Refitted %1 times.").arg(row.score->n_folds));
  return words.join(QLatin1Char(' '));
}

QString ScoreModel::toText() const {
  QStringList lines;
  QStringList cells;
  for (int column = 0; column < kColumnCount; ++column)
    cells << headerData(column, Qt::Horizontal, Qt::DisplayRole).toString();
  lines << cells.join(QLatin1Char('\t'));
  for (int row = 0; row < rowCount(); ++row) {
    cells.clear();
    for (int column = 0; column < kColumnCount; ++column) cells << data(index(row, column), Qt::DisplayRole).toString();
    lines << cells.join(QLatin1Char('\t'));
  }
  return lines.join(QLatin1Char('\n'));
}

int ScoreModel::rowCount(const QModelIndex& parent) const {
  return parent.isValid() ? 0 : static_cast<int>(rows_.size());
}
int ScoreModel::columnCount(const QModelIndex&) const { return kColumnCount; }

std::optional<double> ScoreModel::value(const Row& row, int column) const {
  if (!row.stats) return std::nullopt;
  switch (column) {
    case kRms:
      return row.stats->rms;
    case kToBest:
      return row.score ? std::optional(row.score->rms_to_best) : std::nullopt;
    case kMean:
      return row.stats->mean;
    case kMedian:
      return row.stats->median;
    case kP95:
      return row.stats->p95;
    case kMax:
      return row.stats->max;
    case kUncovered:
      return row.score ? row.score->n_uncovered : 0;
    case kFit:
      return row.score ? std::optional(row.score->fit_s) : std::nullopt;
    default:
      return std::nullopt;
  }
}

QString ScoreModel::toBestText(const Row& row) const {
  if (!row.score) return {};
  if (row.best) return tr("best");
  // A small difference of large errors is told no finer than the errors are.
  const int decimals = decimalsOf(row.score->stats.rms);
  if (!std::isfinite(row.score->rms_to_best_low90)) return signedFigures(row.score->rms_to_best, decimals);
  const QString figures =
      tr("%1 (%2 to %3)")
          .arg(signedFigures(row.score->rms_to_best, decimals), signedFigures(row.score->rms_to_best_low90, decimals),
               signedFigures(row.score->rms_to_best_high90, decimals));
  return asGoodAsBest(*row.score) ? QStringLiteral("\u2248 ") + figures : figures;
}

QVariant ScoreModel::text(const Row& row, int column) const {
  if (column == kMethod) return row.worse ? tr("%1  (worse)").arg(row.label) : row.label;
  if (column == kRms && row.score && row.score->skipped) return tr("cannot");
  const std::optional<double> number = value(row, column);
  if (!number) return QString();
  if (column == kToBest) return toBestText(row);
  return column == kUncovered ? QString::number(row.score ? row.score->n_uncovered : 0) : threeFigures(*number);
}

QVariant ScoreModel::color(const Row& row) const {
  if (row.worse) return theme().attention;
  return row.stats ? QVariant() : QVariant(theme().text_muted);
}

QVariant ScoreModel::data(const QModelIndex& index, int role) const {
  const Row& row = rows_[static_cast<std::size_t>(index.row())];
  switch (role) {
    case Qt::DisplayRole:
      return text(row, index.column());
    case Qt::CheckStateRole:
      if (index.column() != kMethod || !row.entry) return {};
      return entries_[*row.entry].ticked ? Qt::Checked : Qt::Unchecked;
    case kSortRole:
      if (index.column() == kMethod) return row.label;
      return value(row, index.column()).value_or(row.score ? kUnusable : kNotCompared);
    case Qt::TextAlignmentRole:
      return index.column() == kMethod ? QVariant(Qt::AlignLeft | Qt::AlignVCenter)
                                       : QVariant(Qt::AlignRight | Qt::AlignVCenter);
    case Qt::FontRole: {
      QFont font;
      font.setBold(row.best);
      return font;
    }
    case Qt::ForegroundRole:
      return color(row);
    case Qt::ToolTipRole:
      return QStringLiteral("%1\n%2").arg(row.label, about(index.row()));
    default:
      return {};
  }
}

bool ScoreModel::setData(const QModelIndex& index, const QVariant& value, int role) {
  const std::optional<std::size_t> entry = rows_[static_cast<std::size_t>(index.row())].entry;
  if (role != Qt::CheckStateRole || index.column() != kMethod || !entry) return false;
  tick(*entry, value.toInt() == Qt::Checked);
  return true;
}

Qt::ItemFlags ScoreModel::flags(const QModelIndex& index) const {
  Qt::ItemFlags flags = QAbstractTableModel::flags(index);
  if (index.column() == kMethod && rows_[static_cast<std::size_t>(index.row())].entry) flags |= Qt::ItemIsUserCheckable;
  return flags;
}

QVariant ScoreModel::headerData(int section, Qt::Orientation orientation, int role) const {
  if (orientation != Qt::Horizontal) return QAbstractTableModel::headerData(section, orientation, role);
  const QString unit = part_ == Part::kPosition ? tr("mm") : tr("deg");
  const struct {
    QString name, meaning;
  } columns[kColumnCount] = {
      {tr("Method"), tr("A tick takes the method into the next comparison")},
      {tr("RMS %1").arg(unit), tr("RMS of the error on places the fits did not see")},
      {tr("To best (90 %)"),
       tr("RMS less that of the best, with its paired 90 % interval; \u2248 means as good as the best")},
      {tr("95 %"), tr("95 % of the places are below this")},
      {tr("Max"), tr("The worst place")},
      {tr("Mean"), tr("Mean over the places")},
      {tr("Median"), tr("Median over the places")},
      {tr("Left out"), tr("Places the method does not cover: they count unchanged")},
      {tr("Fit s"), tr("One fit on all places [s]")}};
  if (role == Qt::DisplayRole) return columns[section].name;
  if (role == Qt::ToolTipRole) return columns[section].meaning;
  if (role == Qt::TextAlignmentRole && section == kMethod) return QVariant(Qt::AlignLeft | Qt::AlignVCenter);
  if (role == Qt::TextAlignmentRole) return QVariant(Qt::AlignRight | Qt::AlignVCenter);
  return {};
}

}  // namespace fieldtrue::widgets
