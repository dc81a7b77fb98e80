#pragma once

#include <QAbstractTableModel>
#include <optional>
#include <vector>

#include "acquisition/session/session_store.h"

namespace fieldtrue {

/// Every planned place with its state and the numbers of its take: name, state, samples, SD, rejected.
class PlaceListModel : public QAbstractTableModel {
  Q_OBJECT
 public:
  using QAbstractTableModel::QAbstractTableModel;
  void setPlaces(const std::vector<PlannedPlace>& places);
  void setStates(const std::vector<PlaceState>& states, std::optional<std::size_t> current);
  void setTable(const CalibrationTable& table);

  int rowCount(const QModelIndex& parent = {}) const override;
  int columnCount(const QModelIndex& parent = {}) const override;
  QVariant data(const QModelIndex& index, int role) const override;
  QVariant headerData(int section, Qt::Orientation orientation, int role) const override;

 private:
  QString text(std::size_t row, int column) const;
  std::vector<PlannedPlace> places_;
  std::vector<PlaceState> states_;
  std::vector<std::optional<Node>> nodes_;
  std::optional<std::size_t> current_;
};

/// "planned", "done", "skipped", "look at it".
QString placeStateText(PlaceState state);

}  // namespace fieldtrue
