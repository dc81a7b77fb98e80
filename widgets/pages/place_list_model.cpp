#include "widgets/pages/place_list_model.h"

#include <QColor>
#include <QFont>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "acquisition/plan/place_state.h"
#include "widgets/style/theme.h"
#include "widgets/style/unit_texts.h"

namespace fieldtrue::widgets {
namespace {

constexpr std::array kColumns{QT_TRANSLATE_NOOP("PlaceListModel", "Place"),
                              QT_TRANSLATE_NOOP("PlaceListModel", "State"), QT_TRANSLATE_NOOP("PlaceListModel", "n"),
                              QT_TRANSLATE_NOOP("PlaceListModel", "SD mm"), QT_TRANSLATE_NOOP("PlaceListModel", "Out")};

}  // namespace

QString placeStateText(acquisition::PlaceState state) {
  switch (state) {
    case acquisition::PlaceState::kPlanned:
      return QObject::tr("planned");
    case acquisition::PlaceState::kDone:
      return QObject::tr("done");
    case acquisition::PlaceState::kSkipped:
      return QObject::tr("skipped");
    case acquisition::PlaceState::kSuspicious:
      return QObject::tr("look at it");
  }
  return {};
}

void PlaceListModel::setPlaces(const std::vector<PlannedPlace>& places) {
  beginResetModel();
  places_ = places;
  states_.assign(places.size(), acquisition::PlaceState::kPlanned);
  takes_.assign(places.size(), std::nullopt);
  misfits_.clear();
  current_.reset();
  endResetModel();
}

void PlaceListModel::setStates(const std::vector<acquisition::PlaceState>& states, std::optional<std::size_t> current) {
  if (states.size() != places_.size()) return;
  states_ = states;
  current_ = current;
  if (!places_.empty()) emit dataChanged(index(0, 0), index(rowCount() - 1, columnCount() - 1));
}

void PlaceListModel::setMisfits(const std::vector<acquisition::PlaceMisfit>& misfits) {
  if (misfits == misfits_) return;
  misfits_ = misfits;
  if (!places_.empty()) emit dataChanged(index(0, 1), index(rowCount() - 1, 1));
}

QString PlaceListModel::stateText(std::size_t row) const {
  if (current_ == row) return tr("next");
  for (const acquisition::PlaceMisfit& misfit : misfits_)
    if (misfit.place == row) return tr("%1 off").arg(distanceText(misfit.off_m));
  return placeStateText(states_[row]);
}

void PlaceListModel::setTable(const CalibrationTable& table) {
  std::map<std::pair<int, int>, std::vector<const Node*>> rows;
  for (const Node& node : table.nodes) rows[{node.node, node.visit}].push_back(&node);
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const auto of_place = rows.find({places_[i].node, places_[i].visit});
    takes_[i] = of_place == rows.end() ? std::nullopt : std::optional(worstOf(of_place->second));
  }
  if (!places_.empty()) emit dataChanged(index(0, 0), index(rowCount() - 1, columnCount() - 1));
}

int PlaceListModel::rowCount(const QModelIndex& parent) const {
  return parent.isValid() ? 0 : static_cast<int>(places_.size());
}
int PlaceListModel::columnCount(const QModelIndex&) const { return static_cast<int>(kColumns.size()); }

PlaceListModel::Take PlaceListModel::worstOf(const std::vector<const Node*>& sensors) {
  Take worst{sensors.front()->n_used, sensors.front()->n_rejected, {}};
  for (const Node* node : sensors) {
    worst.n_used = std::min(worst.n_used, node->n_used);
    worst.n_rejected = std::max(worst.n_rejected, node->n_rejected);
    if (node->covariance_m2)
      worst.variance_m2 = std::max(worst.variance_m2.value_or(0.0), node->covariance_m2->trace());
  }
  return worst;
}

QString PlaceListModel::text(std::size_t row, int column) const {
  const std::optional<Take>& take = takes_[row];
  switch (column) {
    case 0:
      return QString::fromStdString(placeName(places_[row]));
    case 1:
      return stateText(row);
    case 2:
      return take ? QString::number(take->n_used) : QString();
    case 3:
      return take && take->variance_m2 ? threeFigures(1000.0 * std::sqrt(*take->variance_m2)) : QString();
    default:
      return take ? QString::number(take->n_rejected) : QString();
  }
}

QVariant PlaceListModel::data(const QModelIndex& index, int role) const {
  const auto row = static_cast<std::size_t>(index.row());
  if (role == Qt::DisplayRole) return text(row, index.column());
  if (role == Qt::TextAlignmentRole && index.column() >= 2) return QVariant(Qt::AlignRight | Qt::AlignVCenter);
  if (role == Qt::FontRole && current_ == row) {
    QFont bold;
    bold.setBold(true);
    return bold;
  }
  if (role == Qt::ForegroundRole && index.column() == 1) {
    if (states_[row] == acquisition::PlaceState::kDone) return theme().done;
    if (states_[row] == acquisition::PlaceState::kSuspicious) return theme().attention;
    if (states_[row] == acquisition::PlaceState::kSkipped) return theme().text_muted;
  }
  return {};
}

QVariant PlaceListModel::headerData(int section, Qt::Orientation orientation, int role) const {
  if (orientation != Qt::Horizontal || role != Qt::DisplayRole)
    return QAbstractTableModel::headerData(section, orientation, role);
  return tr(kColumns[static_cast<std::size_t>(section)]);
}

}  // namespace fieldtrue::widgets
