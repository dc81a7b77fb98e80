#pragma once

#include <string>
#include <string_view>

#include "calib/core/json_reader.h"

namespace fieldtrue::calibration {

/// What every file states of its numbers, and needs to state to be read.
inline constexpr std::string_view kCalibrationDirection =
    "tracker_from_sensor as tracked -> reference_from_sensor as corrected";
inline constexpr std::string_view kCalibrationUnits = "m, rad; quaternions w x y z";

/// The schema of a calibration file. Version 2 brought `baked` in place of the position part's `parameters` and
/// position parts that take the whole pose, version 3 a correction for each sensor; a file states the first that could
/// hold it.
std::string calibrationSchema(int version);

/// Of the content without the checksum itself: keys sorted, no white space, so that re-indenting a file does no harm.
std::string checksumOf(nlohmann::json content);

/// A JSON value on one line. What is not UTF-8 becomes replacement characters rather than an exception.
std::string compactText(const nlohmann::json& value);

/// Whether this is a whole calibration file that this version can read, in our units and direction and without keys
/// that nobody knows; throws as a JsonReader does.
void checkEnvelope(const JsonReader& content);

}  // namespace fieldtrue::calibration
