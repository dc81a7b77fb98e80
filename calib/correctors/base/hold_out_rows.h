#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "calib/correctors/base/fit_checks.h"

namespace fieldtrue::correctors {

/// The rows that stay when some are left out, ascending.
/// @param left_out ascending, each below n_rows
std::vector<std::size_t> rowsWithout(std::size_t n_rows, std::span<const std::size_t> left_out);

/// How many places still have a row.
/// @param left_out ascending
std::size_t placesLeft(const Places& places, std::span<const std::size_t> left_out);

}  // namespace fieldtrue::correctors
