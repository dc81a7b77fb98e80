#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace fieldtrue {

/// Letters to insert, remove or replace to make one word of the other.
/// @source Levenshtein 1966
std::size_t editDistance(std::string_view a, std::string_view b);

/// The known name that takes the fewest single-letter changes, or of which only the end is missing; empty when none is
/// known.
std::string nearestName(std::string_view name, const std::vector<std::string>& known);

/// "x is not known; did you mean y? Known: y, z."
std::string unknownName(std::string_view name, const std::vector<std::string>& known);

}  // namespace fieldtrue
