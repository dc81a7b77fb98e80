#pragma once

#include <QWidget>
#include <array>

#include "widgets/style/theme.h"
#include "widgets/style/units.h"
#include "widgets/workbench/workbench.h"

class QCheckBox;
class QComboBox;
class QDoubleSpinBox;
class QLabel;
class QPushButton;
class QSpinBox;

namespace fieldtrue::widgets {

class RoomView;

/// Where the jig is to stand: counts, pitch, origin, order, visits; the grid in 3-D, how long it takes, which pipes.
class PlanPage : public QWidget {
  Q_OBJECT
 public:
  explicit PlanPage(Workbench& workbench, QWidget* parent = nullptr);
  /// The plan as the form shows it.
  acquisition::Plan plan() const;

 private:
  QWidget* makeForm();
  QDoubleSpinBox* makeLength(const QString& name, double metres);
  void onUnit();
  void onUntil();
  acquisition::TakeLength takeLength() const;
  void makeAtTimeLimit();
  void onChanged();
  void loadPlanFile();
  /// Fills the form; a plan beyond the fields' usual ranges widens them rather than being changed.
  void showPlan(const acquisition::Plan& plan);
  QString pitchProblem(const acquisition::Plan& now) const;
  void create();
  void enableFields(const acquisition::Plan& now);
  QString summary(const acquisition::Plan& now, const std::vector<PlannedPlace>& planned) const;

  Workbench& workbench_;
  RoomView* room_;
  std::array<QSpinBox*, 3> counts_{};
  std::array<QDoubleSpinBox*, 3> pitch_{};
  std::array<QDoubleSpinBox*, 3> origin_{};
  QCheckBox* default_origin_;
  QComboBox* unit_;
  QComboBox* order_;
  QSpinBox* seed_;
  QSpinBox* orientations_;
  QSpinBox* reseat_;
  QSpinBox* samples_;
  QDoubleSpinBox* amount_;  ///< In place of it where a take is not counted in samples.
  QComboBox* until_;
  QComboBox* at_time_limit_;
  QLabel* summary_ = nullptr;
  QLabel* problem_;
  QDoubleSpinBox* pipe_foot_;
  QPushButton* create_;
  QPushButton* use_grid_;
  LengthUnit shown_unit_;
  std::vector<PlannedPlace> explicit_places_;
  bool filling_ = false;
};

}  // namespace fieldtrue::widgets
