#include "widgets/pages/score_model.h"

#include <QFont>
#include <QStringList>
#include <algorithm>
#include <limits>

#include "calib/correctors/registry.h"
#include "widgets/pages/units.h"
#include "widgets/views/theme.h"

namespace fieldtrue {
namespace {

// Differences of the last bits are neither better nor worse: a millionth of a millimetre or of a degree.
constexpr double kTie = 1e-6;

QString labelOf(ScoreModel::Part part, const std::string& id) {
  if (part == ScoreModel::Part::kPosition) {
    const auto method = findPositionMethod(id);
    return QString::fromStdString(method ? (*method)->label : id);
  }
  const auto method = findOrientationMethod(id);
  return QString::fromStdString(method ? (*method)->label : id);
}

}  // namespace

ScoreModel::ScoreModel(Part part, QObject* parent) : QAbstractTableModel(parent), part_(part) {}

void ScoreModel::setComparison(const std::optional<Comparison>& comparison) {
  beginResetModel();
  rows_.clear();
  if (comparison) {
    const bool position = part_ == Part::kPosition;
    const std::optional<ErrorStats> before =
        position ? std::optional(comparison->before_position_mm) : comparison->before_orientation_deg;
    rows_.push_back({tr("Before"),
                     QString(),
                     before,
                     0,
                     before ? QString() : tr("the table has no orientation"),
                     {},
                     false,
                     false});
    const std::string& best = position ? comparison->best_position : comparison->best_orientation;
    for (const MethodScore& score : position ? comparison->position : comparison->orientation) {
      if (score.method == "none") continue;
      Row row;
      row.label = labelOf(part_, score.method);
      row.method = QString::fromStdString(score.method);
      row.best = score.method == best;
      row.n_uncovered = score.n_uncovered;
      for (const std::string& note : score.notes) row.notes += QString::fromStdString(note) + QLatin1Char('\n');
      if (score.skipped) {
        row.why_skipped = QString::fromStdString(*score.skipped);
      } else {
        row.stats = score.stats;
        row.worse = before && score.stats.rms > before->rms + kTie;
      }
      rows_.push_back(std::move(row));
    }
  }
  endResetModel();
}

QString ScoreModel::method(int row) const { return rows_.at(static_cast<std::size_t>(row)).method; }

int ScoreModel::rowOf(const QString& method) const {
  for (std::size_t row = 0; row < rows_.size(); ++row)
    if (rows_[row].method == method) return static_cast<int>(row);
  return -1;
}

bool ScoreModel::anyUncovered() const {
  return std::any_of(rows_.begin(), rows_.end(), [](const Row& row) { return row.n_uncovered > 0; });
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
    case kMean:
      return row.stats->mean;
    case kP95:
      return row.stats->p95;
    case kMax:
      return row.stats->max;
    case kUncovered:
      return row.n_uncovered;
    default:
      return std::nullopt;
  }
}

QVariant ScoreModel::text(const Row& row, int column) const {
  if (column == kMethod) return row.worse ? tr("%1  (worse)").arg(row.label) : row.label;
  const std::optional<double> number = value(row, column);
  if (!number) return column == kRms ? tr("cannot be used") : QString();
  return column == kUncovered ? QString::number(row.n_uncovered) : threeFigures(*number);
}

QVariant ScoreModel::data(const QModelIndex& index, int role) const {
  const Row& row = rows_[static_cast<std::size_t>(index.row())];
  switch (role) {
    case Qt::DisplayRole:
      return text(row, index.column());
    case kSortRole:
      if (index.column() == kMethod) return row.label;
      return value(row, index.column()).value_or(std::numeric_limits<double>::max());
    case Qt::TextAlignmentRole:
      return index.column() == kMethod ? QVariant(Qt::AlignLeft | Qt::AlignVCenter)
                                       : QVariant(Qt::AlignRight | Qt::AlignVCenter);
    case Qt::FontRole: {
      QFont font;
      font.setBold(row.best);
      return font;
    }
    case Qt::ForegroundRole:
      if (row.worse) return theme().attention;
      return row.why_skipped.isEmpty() ? QVariant() : QVariant(theme().text_muted);
    case Qt::ToolTipRole:
      return row.why_skipped.isEmpty() ? row.notes.trimmed() : row.why_skipped;
    default:
      return {};
  }
}

QVariant ScoreModel::headerData(int section, Qt::Orientation orientation, int role) const {
  if (orientation != Qt::Horizontal || role != Qt::DisplayRole)
    return QAbstractTableModel::headerData(section, orientation, role);
  const QString unit = part_ == Part::kPosition ? tr("mm") : tr("deg");
  switch (section) {
    case kMethod:
      return tr("Method");
    case kRms:
      return tr("RMS %1").arg(unit);
    case kMean:
      return tr("Mean");
    case kP95:
      return tr("95 %");
    case kMax:
      return tr("Max");
    default:
      return tr("Left out");
  }
}

}  // namespace fieldtrue
