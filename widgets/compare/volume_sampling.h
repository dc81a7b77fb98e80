#pragma once

#include "calib/calibration/corrector.h"
#include "calib/core/run_control.h"
#include "widgets/views/field/volume_field.h"
#include "widgets/workbench/compared_methods.h"

namespace fieldtrue::widgets {

/// What a slice and an iso-surface can show.
enum class VolumeQuantity {
  kNone,
  kCorrection,     ///< How far the method moves a reading.
  kExpectedError,  ///< Held-out errors, interpolated between the places.
  kUncertainty     ///< The SD the method states.
};

/// The different ways in which a sensor was held in a table, tracker_from_sensor: at most 24, none within 5 degrees of
/// another; empty where it was held one way only.
std::vector<Eigen::Quaterniond> waysHeld(const CalibrationTable& table);
inline constexpr int kMeanHeld = -1;  ///< None of them: the mean over all.

/// How the sensor is held where a correction takes orientation; none: the mean over the orientations that were fitted.
using Held = std::optional<Eigen::Quaterniond>;

/// A lattice along the room's axes around the true places, values unknown.
/// @param most_points along its longest side
VolumeField latticeAround(const CalibrationTable& table, int most_points = 25);

/// How far a method moves a reading beyond the rigid alignment [mm], at the aligned place of the reading. Not known
/// where the method does not cover the place.
VolumeField correctionVolume(const calibration::Corrector& corrector, const Held& held, VolumeField lattice,
                             const RunControl& control = {});

/// Distance between what two methods make of the same reading [mm], at the reading's place after the alignment of a.
/// Known where both cover it.
VolumeField differenceVolume(const calibration::Corrector& a, const calibration::Corrector& b, const Held& held,
                             VolumeField lattice, const RunControl& control = {});

/// SD of the corrected position as the method states it [mm]; not known where it does not.
VolumeField uncertaintyVolume(const calibration::Corrector& corrector, const Held& held, VolumeField lattice,
                              const RunControl& control = {});

/// Local RMS of held-out errors [mm] inside the hull of the places: Gaussian weights of SD half a pitch, cut off at
/// three pitches. Between places this is an interpolation, not a measurement.
/// @param errors_mm one per place of the comparison
VolumeField heldOutVolume(const evaluation::Comparison& comparison, const CalibrationTable& table,
                          const std::vector<double>& errors_mm, VolumeField lattice, const RunControl& control = {});

/// SD at each place of the comparison as the method states it [mm], mean over the poses there; NaN where it does not.
std::vector<double> uncertaintyAtPlaces_mm(const calibration::Corrector& corrector,
                                           const evaluation::Comparison& comparison, const CalibrationTable& table);

}  // namespace fieldtrue::widgets
