#include "calib/recording/own_samples.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <map>
#include <set>
#include <tuple>
#include <vector>

#include "calib/core/place_name.h"
#include "calib/recording/sample_visits.h"

namespace fieldtrue::recording {
namespace {

constexpr double kLeastOff_m = 1e-3;
constexpr double kMostErrors = 10.0;
constexpr std::size_t kMostNamed = 10;

/// Rows by node, visit and sensor.
using RowsByStop = std::multimap<std::tuple<int, int, int>, const Node*>;

/// Places whose readings are not theirs.
struct Foreign {
  std::set<int> places;  ///< All that have readings.
  std::set<int> without_row;
  std::set<int> off;
  double farthest_m = 0.0;  ///< From the row's tracked position.
};

double standardError_m(const SampleVisit& stop, const Node& row) {
  const auto n = static_cast<double>(stop.times_s.size());
  const double variance_m2 = stop.deviations.leftCols<3>().squaredNorm() / std::max(1.0, n - 1.0);
  return std::sqrt(variance_m2 / std::clamp(row.n_effective, 1.0, n));
}

/// How far the readings lie off the row, 0 where noise can.
double off_m(const SampleVisit& stop, const Node& row) {
  if (row.role == NodeRole::kSkipped || !row.tracker_from_sensor.position_m.allFinite()) return 0.0;
  const double distance_m = (stop.mean_m - row.tracker_from_sensor.position_m).norm();
  return distance_m > std::max(kLeastOff_m, kMostErrors * standardError_m(stop, row)) ? distance_m : 0.0;
}

void hold(const SampleVisit& stop, const RowsByStop& rows, Foreign& foreign) {
  foreign.places.insert(stop.node);
  const auto [first, last] = rows.equal_range({stop.node, stop.visit, stop.sensor});
  if (first == last) {
    foreign.without_row.insert(stop.node);
    return;
  }
  double nearest_m = off_m(stop, *first->second);
  for (auto row = std::next(first); row != last; ++row) nearest_m = std::min(nearest_m, off_m(stop, *row->second));
  if (nearest_m > 0.0) foreign.off.insert(stop.node);
  foreign.farthest_m = std::max(foreign.farthest_m, nearest_m);
}

std::string textOf(const Foreign& foreign) {
  const std::string n_places = std::to_string(foreign.places.size());
  std::string text;
  if (const std::size_t n = foreign.without_row.size(); n > 0)
    text = std::to_string(n) + " of " + n_places + " places" + (n == 1 ? " has" : " have") + " samples but no row";
  if (foreign.off.empty()) return text;
  char farthest[32];
  std::snprintf(farthest, sizeof farthest, "%.3g mm", 1e3 * foreign.farthest_m);
  return text + (text.empty() ? "" : ", and ") + "at " + std::to_string(foreign.off.size()) + " of " + n_places +
         " places the mean of the samples lies off the tracked position, by up to " + farthest;
}

Foreign foreignOf(const SampleTable& samples, const CalibrationTable& table) {
  RowsByStop rows;
  std::set<int> sensors;
  for (const Node& row : table.nodes) {
    rows.emplace(std::tuple(row.node, row.visit, row.sensor), &row);
    sensors.insert(row.sensor);
  }
  const std::vector<SampleVisit> stops = sampleVisits(samples, 1);
  const auto isKnown = [&](const SampleVisit& stop) { return sensors.count(stop.sensor) > 0; };
  const bool is_any_known = std::any_of(stops.begin(), stops.end(), isKnown);
  Foreign foreign;
  for (const SampleVisit& stop : stops)
    if (isKnown(stop) || !is_any_known) hold(stop, rows, foreign);
  return foreign;
}

}  // namespace

Result<std::optional<GapFinding>> foreignSamples(const SampleTable& samples, const CalibrationTable& table) {
  const Foreign foreign = foreignOf(samples, table);
  std::set<int> all = foreign.without_row;
  all.insert(foreign.off.begin(), foreign.off.end());
  if (all.empty()) return std::optional<GapFinding>();
  // A part of a table may come with the samples of the whole.
  const std::size_t n_held = foreign.places.size() - foreign.without_row.size();
  if (n_held == 0 || 2 * foreign.off.size() > n_held)
    return fail(ErrorCode::kBadInput, "The samples are not those of this table: " + textOf(foreign));
  const std::vector<int> nodes(all.begin(), all.end());
  return std::optional(GapFinding{"",
                                  "Some samples are not those of this table (" +
                                      PlaceNames(table.nodes).list(nodes, kMostNamed) + "): " + textOf(foreign) + ".",
                                  nodes});
}

}  // namespace fieldtrue::recording
