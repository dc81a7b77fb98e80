#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/core/calibration_table.h"

/// Text of commands that several trackers write alike.
namespace fieldtrue::acquisition {

/// Up to four decimals, no exponent, no trailing zeros.
std::string commandNumber(double value);
/// The coordinates of the vectors, one after the other.
std::vector<std::string> commandNumbers(std::initializer_list<Eigen::Vector3d> vectors);
std::string joinedByCommas(const std::vector<std::string>& fields);
std::vector<std::string> splitAtCommas(std::string_view text);
/// A field as a number, with an optional sign; none where it is something else.
std::optional<double> fieldNumber(const std::string& text);

}  // namespace fieldtrue::acquisition
