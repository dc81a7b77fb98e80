#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/calibration/alignment.h"
#include "calib/calibration/evaluator.h"
#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/run_control.h"
#include "calib/core/settings.h"
#include "calib/core/setup.h"
#include "calib/correctors/base/fit_data.h"

namespace fieldtrue::calibration {

/// Which methods to fit, with their settings.
struct CorrectorChoice {
  std::string position_id = "none";
  Settings position_settings;
  std::string orientation_id = "none";
  Settings orientation_settings;
  /// Each sensor has a correction of its own, from its own rows, beyond the alignment that all share; shared all the
  /// same where all rows are of one sensor.
  bool separate_position = false;
  bool separate_orientation = false;
};

/// Parses `method[:key=value,...]` for both parts and checks the settings.
/// @error kBadInput
Result<CorrectorChoice> parseCorrectorChoice(const std::string& position_text, const std::string& orientation_text);

/// How a fit went on the nodes it saw. Errors after correction, in-sample: never a verdict.
struct FitReport {
  std::size_t n_nodes = 0;
  double rms_before_mm = 0.0;  ///< After the rigid alignment, if one is fitted.
  double rms_m = 0.0;
  double max_m = 0.0;
  std::optional<double> orientation_rms_rad;
  std::vector<std::string> notes;
};

/// A fitted calibration: what applies it, and where it came from. Immutable; copies share the models.
class Corrector : public Evaluator {
 public:
  /// Fits on the rows given (the caller leaves out skipped and held-out rows).
  /// @error as the methods' fits
  static Result<Corrector> fit(std::span<const Node> nodes, const TableMetadata& metadata,
                               const CorrectorChoice& choice, AlignMode align, const RunControl& control = {});

  /// The distinct orientations it was fitted on, tracker_from_sensor: none within 5 degrees of another.
  std::vector<Eigen::Quaterniond> orientationsSeen() const;
  /// What it is good for, as far as its table stated it.
  const Setup& setup() const { return setup_; }

  /// The calibration of one sensor, as if it alone had been fitted in the same alignment; of a correction that all
  /// share the same with the mounting of this one. @error kBadInput for a sensor that was not fitted
  Result<Corrector> ofSensor(int sensor) const;

  /// What another program made.
  /// @param parts without an orientation part: none is corrected
  /// @param table rows that stand for it, where it takes them being true
  static Corrector imported(Parts parts, CorrectorChoice choice, CalibrationTable table,
                            std::vector<std::string> notes);

  /// The same with a note more in its report.
  Corrector withNote(const std::string& note) const;

  /// The same calibration with its position part baked to a dense lattice: 64 coefficients a sample whatever the method
  /// was, and it needs nothing else. Covers what it covered, up to a cell more at holes and edges of a local method.
  /// The report holds the lattice's figures, and the largest deviation that was seen as a note.
  /// @param max_deviation_m bound of the distance between both corrected positions inside the region, positive [m]
  /// @error kBadInput for a bound that is not positive; kUnsupported when baked already, or when no lattice within the
  ///        memory allowed stays within the bound; kDegenerate without a region; kCancelled
  Result<Corrector> baked(double max_deviation_m, const RunControl& control = {}) const;

  const CorrectorChoice& choice() const { return choice_; }
  AlignMode align() const { return align_; }
  const FitReport& report() const { return report_; }
  const CalibrationTable& table() const { return table_; }  ///< The rows it was fitted on, with their metadata.

  /// Writes `*.ftcal.json`, atomically. @error kIo
  Result<void> save(const std::filesystem::path& path) const;
  std::string toText() const;  ///< The file's content.
  /// @error kIo; kBadInput for damaged content or a checksum that does not match; kNewerVersion
  static Result<Corrector> load(const std::filesystem::path& path);
  static Result<Corrector> fromText(const std::string& text, const std::string& name);

 private:
  using Evaluator::Evaluator;
  static Corrector fromJson(const JsonReader& content);

  CorrectorChoice choice_;
  AlignMode align_ = AlignMode::kNone;
  FitReport report_;
  CalibrationTable table_;
  Setup setup_;
};

}  // namespace fieldtrue::calibration
