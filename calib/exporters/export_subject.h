#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calib/calibration/corrector.h"

namespace fieldtrue::exporters {

/// Which way a file maps positions.
enum class Direction { kMeasuredToTrue, kTrueToMeasured };

/// "measured-to-true" or "true-to-measured".
std::string directionText(Direction direction);

/// How far a method errs on places that its fit did not see.
struct HeldOutError {
  double rms_m = 0.0;
  std::string validated;  ///< "kfold:10"
};

/// How a calibration is to be written.
struct ExportOptions {
  Direction direction = Direction::kMeasuredToTrue;
  std::optional<double> max_deviation_m;  ///< Unset: 50 um for a lattice of free pitch, any for a fixed form.
  double max_size_bytes = 256.0 * 1024 * 1024;
  /// At which orientation (tracker_from_sensor) a correction that depends on it is written; unset and
  /// `mean_orientation` false: refused where that matters.
  std::optional<Eigen::Quaterniond> orientation;
  bool mean_orientation = false;
  std::string name;                      ///< Of the calibration's file, for the text inside.
  std::optional<HeldOutError> held_out;  ///< If it is known.
};

/// What another program is to be told about a file, in order: unit, frames, handedness, direction, method, ...
using Facts = std::vector<std::pair<std::string, std::string>>;

struct Written;

/// A calibration as another program takes it: one map of positions, from the tracker's frame to the calibration's own
/// (that of the rig where an alignment was fitted), or back, at one orientation of the sensor.
///
/// Where the method does not reach, the correction goes on along the straight line that it has at the nearest point on
/// the way to the middle of the places, and levels off within a fifth of their extent.
class ExportSubject {
 public:
  ExportSubject(const calibration::Corrector& corrector, const ExportOptions& options);

  const calibration::Corrector& corrector() const { return corrector_; }
  /// Where a position goes, in the direction that was asked for.
  Eigen::Vector3d mapped_m(const Eigen::Vector3d& p_m) const { return is_inverse_ ? inverse_m(p_m) : forward_m(p_m); }
  /// Measured to true.
  Eigen::Vector3d forward_m(const Eigen::Vector3d& p_tracked_m) const;
  /// True to measured, by Newton's method; within 1 um wherever the map can be turned round.
  Eigen::Vector3d inverse_m(const Eigen::Vector3d& p_true_m) const;
  /// How a read orientation is turned, on its left: q_true = rotation * q_tracked, at the sensor's mounting. Where that
  /// changes with how the sensor is turned: at the orientation asked for, or the mean over those seen.
  Eigen::Quaterniond rotation(const Eigen::Vector3d& p_tracked_m) const;
  std::optional<double> uncertainty_m(const Eigen::Vector3d& p_tracked_m) const;
  /// Whether the calibration holds at a position of the map's domain.
  bool holds(const Eigen::Vector3d& p_m) const;
  /// That a turn which changes with the sensor's orientation is written for one of them, where it does.
  void tellOfTurns(Written& written) const;
  bool correctsOrientation() const { return corrector_.choice().orientation_id != "none"; }

  /// The places, where the tracker measured them or, in the inverse direction, where they truly are.
  std::vector<Eigen::Vector3d> places_m() const;
  /// Seeded points of the calibrated region that the method covers, in the map's domain, and where each goes.
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> probes(std::size_t n) const;
  /// Directions of the rig's axes in the map's domain, as columns.
  Eigen::Matrix3d rigAxes() const;
  /// Facts of every file; a format appends its own.
  /// @param unit "millimetres"
  Facts facts(const std::string& unit) const;
  bool isInverse() const { return is_inverse_; }
  /// How far the corrected places lie at most from those that are written, over the orientations seen.
  double changeWithOrientation_m() const { return change_m_; }

 private:
  Eigen::Vector3d covered_m(const Eigen::Vector3d& p_tracked_m) const;
  Eigen::Vector3d insidePoint_m(const Eigen::Vector3d& p_tracked_m) const;

  calibration::Corrector corrector_;
  bool is_inverse_ = false;
  std::optional<Eigen::Quaterniond> orientation_;
  std::vector<Eigen::Quaterniond> mean_over_;  ///< Orientations that a turn is averaged over.
  double change_m_ = 0.0;
  Eigen::Vector3d middle_m_ = Eigen::Vector3d::Zero();
  double extent_m_ = 1.0;
  ExportOptions options_;
};

/// "# key: value" lines.
std::string factLines(const Facts& facts, const std::string& prefix = "# ");

}  // namespace fieldtrue::exporters
