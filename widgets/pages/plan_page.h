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
class QLineEdit;
class QPushButton;
class QSpinBox;

namespace fieldtrue::widgets {

class LengthBox;
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
  LengthBox* makeLength(const QString& name, double metres);
  void makeSeed(std::uint64_t seed);
  void onUnit();
  void onUntil();
  void onTakeLength();  ///< The open session has it too.
  void showTakeLength(const acquisition::TakeLength& length);
  acquisition::TakeLength takeLength() const;
  double takeUnit() const;  ///< In what `amount_` is counted in.
  void makeAtTimeLimit();
  void onChanged();
  void loadPlanFile();
  /// Fills the form; a plan beyond the fields' usual ranges widens them rather than being changed.
  void showPlan(const acquisition::Plan& plan);
  QString problemOf(const acquisition::Plan& now) const;  ///< Empty where a session can be started with it.
  QString pitchProblem(const acquisition::Plan& now) const;
  void create();
  void enableFields(const acquisition::Plan& now);
  /// What is told and drawn of a plan.
  struct BuiltPlan {
    std::vector<PlannedPlace> places;
    std::size_t n_levels = 0;
    std::string orientations;
  };
  static BuiltPlan built(const acquisition::Plan& plan);
  /// At once; beside the window where that would hold it up. The last one asked for is shown.
  void build(const acquisition::Plan& now);
  void show(const acquisition::Plan& now, const BuiltPlan& built);
  QString summary(const acquisition::Plan& now, const BuiltPlan& built) const;

  Workbench& workbench_;
  RoomView* room_;
  std::array<QSpinBox*, 3> counts_{};
  std::array<LengthBox*, 3> pitch_{};
  std::array<LengthBox*, 3> origin_{};
  QCheckBox* default_origin_;
  QComboBox* unit_;
  QComboBox* order_;
  QLineEdit* seed_;
  QSpinBox* orientations_;
  QSpinBox* reseat_;
  QSpinBox* samples_;
  QDoubleSpinBox* amount_;  ///< In place of it where a take is not counted in samples.
  QComboBox* until_;
  QComboBox* at_time_limit_;
  QLabel* summary_ = nullptr;
  QLabel* problem_;
  LengthBox* pipe_foot_;
  QPushButton* create_;
  QPushButton* use_grid_;
  LengthUnit shown_unit_;
  std::vector<PlannedPlace> explicit_places_;
  bool filling_ = false;
  BackgroundJobs building_{this};
};

}  // namespace fieldtrue::widgets
