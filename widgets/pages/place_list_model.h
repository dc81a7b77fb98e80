#pragma once

#include <QAbstractTableModel>
#include <optional>
#include <vector>

#include "acquisition/plan/place_state.h"
#include "acquisition/session/acquisition_controller.h"

namespace fieldtrue::widgets {

/// Every planned place with its state and the numbers of its take: name, state, samples, SD, rejected.
class PlaceListModel : public QAbstractTableModel {
  Q_OBJECT
 public:
  using QAbstractTableModel::QAbstractTableModel;
  void setPlaces(const std::vector<PlannedPlace>& places);
  void setStates(const std::vector<acquisition::PlaceState>& states, std::optional<std::size_t> current);
  /// Takes that do not fit the others: the state says how far they are off.
  void setMisfits(const std::vector<acquisition::PlaceMisfit>& misfits);
  void setTable(const CalibrationTable& table);

  int rowCount(const QModelIndex& parent = {}) const override;
  int columnCount(const QModelIndex& parent = {}) const override;
  QVariant data(const QModelIndex& index, int role) const override;
  QVariant headerData(int section, Qt::Orientation orientation, int role) const override;

 private:
  /// Its numbers; of several sensors the worst.
  struct Take {
    int n_used = 0, n_rejected = 0;
    std::optional<double> variance_m2;  ///< 3-D, of a single sample.
  };
  static Take worstOf(const std::vector<const Node*>& sensors);
  QString text(std::size_t row, int column) const;
  QString stateText(std::size_t row) const;
  std::vector<PlannedPlace> places_;
  std::vector<acquisition::PlaceState> states_;
  std::vector<std::optional<Take>> takes_;
  std::optional<std::size_t> current_;
  std::vector<acquisition::PlaceMisfit> misfits_;
};

/// "planned", "done", "skipped", "look at it".
QString placeStateText(acquisition::PlaceState state);

}  // namespace fieldtrue::widgets
