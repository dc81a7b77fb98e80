#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "calib/calibration/corrector.h"
#include "calib/core/pose.h"

namespace fieldtrue::evaluation {

/// What a tracker may report: a place, and how the sensor is held there where that matters. Tracker frame.
struct Reading {
  Eigen::Vector3d p_m = Eigen::Vector3d::Zero();
  std::optional<Eigen::Quaterniond> held;  ///< tracker_from_sensor; none: whatever it is.
};

/// What a calibration makes of a reading; without an orientation the mean position over those it was fitted on, and the
/// turn of a sensor that lies as the tracker's axes do.
Pose correctedBy(const calibration::Corrector& corrector, const Reading& reading);
std::optional<double> uncertainty_m(const calibration::Corrector& corrector, const Reading& reading);

/// Readings that two calibrations both cover: places, at each of them every one of some orientations.
struct CommonReadings {
  std::vector<Eigen::Vector3d> points_m;  ///< Tracker frame.
  /// tracker_from_sensor, even among those that were fitted; empty where neither correction takes orientation.
  std::vector<Eigen::Quaterniond> held;
  bool is_held_seen_by_both = false;  ///< Both were fitted on these orientations; else either one was.

  double step_m = 0.0;  ///< Between neighbours of a lattice of places; 0 where they are of none.

  /// Place by place.
  std::vector<Reading> all() const;
  std::size_t readingsAPlace() const { return held.empty() ? 1 : held.size(); }
};

/// Places spread evenly over what both cover; places of the second where no lattice fits in. Where either correction
/// takes orientation, with those that both were fitted on, or that either was where they share none.
CommonReadings commonReadings(const calibration::Corrector& first, const calibration::Corrector& second);

/// The reading that both cover at which a figure is largest, to a small part of a lattice's step: climbed to from the
/// worst of the common readings and of the places that either was fitted on, since edges lie between those of a
/// lattice.
/// @param on_lattice the figure at each of common.all()
Reading worstReading(const calibration::Corrector& first, const calibration::Corrector& second,
                     const CommonReadings& common, const std::vector<double>& on_lattice,
                     const std::function<double(const Reading&)>& figure);

}  // namespace fieldtrue::evaluation
