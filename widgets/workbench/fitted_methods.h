#pragma once

#include <QObject>
#include <map>
#include <memory>
#include <set>

#include "calib/calibration/alignment.h"
#include "calib/calibration/corrector.h"
#include "widgets/workbench/background.h"
#include "widgets/workbench/compared_methods.h"

namespace fieldtrue::widgets {

/// The compared position methods as calibrations, each fitted on all fit rows in the background when something first
/// asks for it.
class FittedMethods : public QObject {
  Q_OBJECT
 public:
  explicit FittedMethods(QObject* parent = nullptr);

  /// Forgets every fit and stops those under way.
  void reset(const CalibrationTable& table, const std::optional<evaluation::Comparison>& comparison);

  /// The fit of a row of the comparison; null until it is there. The first question starts it.
  std::shared_ptr<const calibration::Corrector> get(std::size_t row);
  /// Why there is none; empty while it may still come.
  QString why(std::size_t row) const;
  bool busy() const { return !running_.empty(); }
  /// Stops what is under way; rows not fitted say so.
  void stop();

 signals:
  void changed();  ///< A fit arrived, failed or was stopped.

 private:
  void start(std::size_t row);
  void arrived(std::size_t row, Result<calibration::Corrector> result);

  CalibrationTable table_;
  calibration::AlignMode align_ = calibration::AlignMode::kRigid;
  std::vector<calibration::CorrectorChoice> choices_;
  std::map<std::size_t, std::shared_ptr<const calibration::Corrector>> fitted_;
  std::map<std::size_t, QString> why_;
  std::set<std::size_t> running_;
  BackgroundJobs jobs_{this};
};

}  // namespace fieldtrue::widgets
