#pragma once

#include <memory>

#include "calib/core/calibration_table.h"
#include "calib/gap/judgement.h"
#include "calib/gap/report.h"
#include "calib/recording/cleaning.h"

namespace fieldtrue::testing {

/// One recording diagnosed under one set of thresholds after another, as gap::diagnose does but for what single
/// readings show: what other thresholds leave as it was is not done again.
class StagedDiagnosis {
 public:
  /// @error std::runtime_error with fewer than 8 usable places
  explicit StagedDiagnosis(const CalibrationTable& table);

  /// Verdict, candidates, findings and, without figures of their own, the selected effects.
  gap::GapReport under(const identify::Thresholds& thresholds);

 private:
  struct Stage {
    int most_effects = 0;
    identify::EffectSelection selection;
    gap::Judgement judgement;
    double floor_m = 0.0;
    double floor_rad = 0.0;
  };

  Stage staged(const identify::Thresholds& thresholds, bool belongs_together) const;
  bool selectsAsUsual(const identify::Thresholds& thresholds, int most_effects) const;
  bool judgesAsUsual(const identify::Thresholds& thresholds, const Stage& stage) const;

  TableMetadata metadata_;
  recording::Cleaned cleaned_;
  identify::GapRows rows_;
  std::unique_ptr<identify::GapSearch> search_;
  std::unique_ptr<Stage> usual_;  ///< Under the thresholds as they are by default.
};

}  // namespace fieldtrue::testing
