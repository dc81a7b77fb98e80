#include "calib/correctors/base/hold_out_rows.h"

#include <algorithm>
#include <numeric>

#include "calib/correctors/base/fit_names.h"

namespace fieldtrue::correctors {

std::vector<std::size_t> rowsWithout(std::size_t n_rows, std::span<const std::size_t> left_out) {
  FT_CHECK(std::is_sorted(left_out.begin(), left_out.end()) && (left_out.empty() || left_out.back() < n_rows));
  std::vector<std::size_t> all(n_rows);
  std::iota(all.begin(), all.end(), std::size_t{0});
  std::vector<std::size_t> rest;
  std::set_difference(all.begin(), all.end(), left_out.begin(), left_out.end(), std::back_inserter(rest));
  return rest;
}

std::size_t placesLeft(const Places& places, std::span<const std::size_t> left_out) {
  const auto is_left_out = [&](std::size_t row) { return std::binary_search(left_out.begin(), left_out.end(), row); };
  return static_cast<std::size_t>(std::count_if(
      places.rows.begin(), places.rows.end(),
      [&](const std::vector<std::size_t>& rows) { return !std::all_of(rows.begin(), rows.end(), is_left_out); }));
}

Result<std::vector<std::size_t>> placesOfRows(const Places& places, std::span<const std::size_t> rows) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto held = std::count_if(places.rows[i].begin(), places.rows[i].end(),
                                    [&](std::size_t row) { return std::binary_search(rows.begin(), rows.end(), row); });
    if (held == 0) continue;
    if (static_cast<std::size_t>(held) != places.rows[i].size())
      return fail(ErrorCode::kUnsupported,
                  namesOf(places).of(places.node[i]) + " can only be held out with all of its visits, and " +
                      std::to_string(held) + " of " + std::to_string(places.rows[i].size()) + " were asked for");
    out.push_back(i);
  }
  return out;
}

}  // namespace fieldtrue::correctors
