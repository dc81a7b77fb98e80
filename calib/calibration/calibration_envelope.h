#pragma once

#include <string>

#include "calib/core/json_reader.h"

namespace fieldtrue::calibration {

/// The schema of a calibration file. Version 2 brought `baked` in place of the position part's `parameters` and
/// position parts that take the whole pose, version 3 a correction for each sensor; a file states the first that could
/// hold it.
std::string calibrationSchema(int version);

/// Of the content without the checksum itself: keys sorted, no white space, so that re-indenting a file does no harm.
std::string checksumOf(nlohmann::json content);

/// A JSON value on one line. What is not UTF-8 becomes replacement characters rather than an exception.
std::string compactText(const nlohmann::json& value);

/// Whether this is a whole calibration file that this version can read; throws as a JsonReader does.
void checkEnvelope(const JsonReader& content);

}  // namespace fieldtrue::calibration
