#pragma once

#include <map>
#include <optional>

#include "calib/core/calibration_table.h"
#include "calib/core/error.h"
#include "calib/core/run_control.h"
#include "calib/gap/report.h"
#include "calib/identify/thresholds.h"
#include "calib/recording/cleaning.h"

namespace fieldtrue::gap {

/// Whether the field changed between two recordings of one room, which need not be of the same places.
struct RecordingChange {
  bool changed = false;
  double p_value = 1.0;  ///< At most so often two recordings of one field differ as much.
  double rms_mm = 0.0;   ///< Of the likeliest change of positions over the places where both recordings know something.
  double least_shown_mm = 0.0;               ///< RMS of a change that these two would show.
  std::optional<Eigen::Vector3d> hottest_m;  ///< Where positions changed most, tracker frame.
  double scatter_before_mm = 0.0;            ///< SD per axis about any smooth field.
  double scatter_now_mm = 0.0;
  /// At most so often placing alone takes the later readings so far off what the earlier one foretells; 1 unless they
  /// scatter clearly more than placing may and than the earlier ones do, or several places are far off: what bends one
  /// corner alone is no smooth field.
  double astray_p_value = 1.0;
  bool isAstray() const { return astray_p_value < 1e-3; }
  /// Whether it is the earlier readings that show another field, or are astray, of what the later recording tells: what
  /// stood there and is gone. The rows and their alignment are the earlier ones', the table diagnosed says what stood
  /// there; p_value is of both questions.
  bool is_gone = false;
  int places = 0;  ///< Of the later recording, where the earlier one knows the field.
  int places_left_out = 0;
  std::optional<double> rig_moved_mm;  ///< Where the places are the same: how far they stand from where they stood.
  std::optional<double> rig_turned_deg;
  Pose tracker_from_reference;              ///< Of the later recording.
  std::map<int, Pose> sensors_from_mounts;  ///< Of each of its sensors, by its number.
  /// The later rows, each taken to stand where the earlier recording would have reported it, with the uncertainty of
  /// that: a diagnosis of it names what changed.
  recording::Cleaned rows;
  TableMetadata metadata;
};

/// Tells a report that was made of the change's table what it is of: the part `against`, verdict and sentence.
void describeChange(const RecordingChange& change, const identify::Thresholds& thresholds, GapReport& report);

/// What both recordings share is a smooth field, each seen through its own alignment, its own noise and, at places that
/// both have, the same errors of the rig; whether the later one saw another field beside is told by the odds of the
/// two.
/// @error kTooFewNodes where fewer than Thresholds::fewest_places usable places are in either, or the earlier one knows
/// the field at fewer places of the later one; kCancelled
Result<RecordingChange> changeSince(const CalibrationTable& before, const CalibrationTable& now,
                                    const identify::Thresholds& thresholds, const RunControl& control = {});

}  // namespace fieldtrue::gap
