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

/// The places that rows of fit data belong to.
/// @error kUnsupported when only some visits of a place are among the rows
Result<std::vector<std::size_t>> placesOfRows(const Places& places, std::span<const std::size_t> rows);

/// What is left of values by place. @param out ascending
template <class Value>
std::vector<Value> withoutPlaces(const std::vector<Value>& values, std::span<const std::size_t> out) {
  std::vector<Value> kept;
  kept.reserve(values.size() - out.size());
  std::size_t next = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (next < out.size() && out[next] == i)
      ++next;
    else
      kept.push_back(values[i]);
  }
  return kept;
}

}  // namespace fieldtrue::correctors
