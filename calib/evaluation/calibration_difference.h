#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/calibration/corrector.h"
#include "calib/core/error.h"
#include "calib/core/pose.h"
#include "calib/core/run_control.h"
#include "calib/evaluation/base/intervals.h"

namespace fieldtrue::evaluation {

/// How two calibrations differ at one reading.
struct ChangeAt {
  Eigen::Vector3d reference_m = Eigen::Vector3d::Zero();  ///< What the first makes of it, its reference frame.
  Eigen::Vector3d change_m = Eigen::Vector3d::Zero();     ///< The second's less the first's, rigid motion taken out.
  std::optional<Eigen::Quaterniond> held;  ///< tracker_from_sensor, where either correction takes orientation.
};

/// Errors of a calibration at places, with the 90 % interval of their RMS.
struct PlaceErrors {
  std::vector<double> mm;  ///< One a place.
  double rms_mm = 0.0;
  Interval rms_90_mm;
};

enum class DifferenceVerdict { kChanged, kNotShown, kCannotTell };

/// What changed between two calibrations of one set-up. Over the common region: points spread evenly over what both
/// cover, where either correction takes orientation with the sensor held in several at each. A rig or transmitter that
/// was put down elsewhere moves every corrected position alike; this rigid motion is told apart, and with it goes what
/// the field's own change has of one.
struct CalibrationDifference {
  std::size_t n_points = 0;
  std::size_t n_orientations = 0;     ///< At each of the points; 0 where neither correction takes orientation.
  bool is_held_seen_by_both = false;  ///< Both were fitted on these orientations; else either one was.
  double whole_rms_mm = 0.0;          ///< Rigid motion included.
  double whole_max_mm = 0.0;
  double moved_mm = 0.0;  ///< Rigid motion at the middle of the common region.
  double turned_deg = 0.0;
  double rms_mm = 0.0;  ///< Without the rigid motion, as everything below.
  double p95_mm = 0.0;
  double max_mm = 0.0;
  std::size_t worst = 0;                ///< Into points.
  std::optional<double> expected_mm;    ///< RMS from what both state of their uncertainty; none where one states none.
  std::optional<double> angle_rms_deg;  ///< Of corrected orientations; none where neither corrects any.
  std::optional<double> angle_max_deg;
  /// The turn that all orientations share, which is taken out of both: the mounting's and the rig's.
  std::optional<double> angle_shared_deg;
  /// Each as the sensor is held where the change there is largest; the last is the worst of the region.
  std::vector<ChangeAt> points;

  PlaceErrors first_own;  ///< Each at places of its own that its fits did not see.
  PlaceErrors second_own;
  PlaceErrors first_at_second;  ///< The first at the second's places, alignment fitted anew; empty below 6 in common.
  std::string worst_place;      ///< Of these: where the first errs most; empty where there are none.
  Eigen::Vector3d worst_place_m = Eigen::Vector3d::Zero();  ///< The second's reference frame.
  std::size_t n_beyond = 0;  ///< The second's places where the first is worse than at any of its own.
  std::size_t n_far = 0;     ///< More than three times as bad as there.
  /// Of the RMS of the first at the second's places, less that of the second held out there; paired.
  std::optional<PairedDifference> first_less_second_mm;

  Setup first_setup, second_setup;
  SetupMatch setup_matches = SetupMatch::kUnknown;
  DifferenceVerdict verdict = DifferenceVerdict::kCannotTell;
  std::optional<double> unseen_mm;  ///< RMS of an evenly spread change that would not show, where none is shown.
  std::string text;                 ///< The verdict in a sentence or two.
};

/// Where one of two calibrations holds a correction for each sensor: the sensors that both were fitted on. Else none.
/// @error kUnsupported when there should be one and is none
Result<std::vector<int>> sensorsToChooseFrom(const calibration::Corrector& first, const calibration::Corrector& second);

/// Compares two calibrations, the earlier one first. "Changed" if the first is worse at the second's places than the
/// second's own fits that did not see them (paired 90 % interval above zero), and worse than it was at places of its
/// own (intervals apart); or if so many of its largest errors are at the second's places that chance is below 1 %.
/// Where neither holds, but intervals are apart or single places are far off, nobody can tell; otherwise none is shown.
/// @error kUnsupported when they cover nothing in common, or one holds a correction for each sensor; kCancelled
Result<CalibrationDifference> compareCalibrations(const calibration::Corrector& first,
                                                  const calibration::Corrector& second, const RunControl& control = {});

/// `fieldtrue.difference/1`.
nlohmann::json toJson(const CalibrationDifference& difference);

}  // namespace fieldtrue::evaluation
