#include "calib/recording/unit_slip.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>
#include <set>
#include <tuple>
#include <vector>

#include "calib/core/file_io.h"
#include "calib/core/statistics.h"
#include "calib/recording/cleaning.h"
#include "calib/recording/hemisphere.h"
#include "calib/tables/table_sensors.h"
#include "calib/tables/true_box.h"

namespace fieldtrue::recording {

namespace {

constexpr double kNarrowest_m = 1e-3;
constexpr std::size_t kFewestPlaces = 4;
constexpr double kLargestRatio = 2.0;
/// Rows whose distances are taken; all their pairs are, so this bounds the work.
constexpr std::size_t kMostNodes = 300;
constexpr double kEnlargement = 3.0;
/// Fewer readings near the region may lie outside it by chance.
constexpr std::size_t kFewestReadings = 10;

bool isUsable(const Node& node) {
  return node.role != NodeRole::kSkipped && node.reference_from_sensor.position_m.allFinite() &&
         node.tracker_from_sensor.position_m.allFinite();
}

/// Rows that stand for all: drawn, so that no layer or column of a grid is favoured, and the same ones every time.
std::vector<Node> representatives(std::vector<Node> nodes) {
  if (nodes.size() <= kMostNodes) return nodes;
  std::mt19937_64 generator(1);
  for (std::size_t i = 0; i < kMostNodes; ++i) {
    std::swap(nodes[i], nodes[i + static_cast<std::size_t>(generator() % (nodes.size() - i))]);
  }
  nodes.resize(kMostNodes);
  return nodes;
}

/// Median distances between places, as the rig says and as the tracker does.
struct Distances {
  double true_m = 0.0;
  double tracked_m = 0.0;
  double ratio() const { return true_m / tracked_m; }
};

Distances medianDistances(const std::vector<Node>& nodes) {
  std::vector<double> true_m, tracked_m;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      // Sensors of one rig stand apart by what their mountings say; distances are between places of one of them.
      if (nodes[i].node == nodes[j].node || nodes[i].sensor != nodes[j].sensor) continue;
      true_m.push_back((nodes[i].reference_from_sensor.position_m - nodes[j].reference_from_sensor.position_m).norm());
      tracked_m.push_back((nodes[i].tracker_from_sensor.position_m - nodes[j].tracker_from_sensor.position_m).norm());
    }
  }
  if (true_m.empty()) return {1.0, 1.0};
  return {median(std::move(true_m)), median(std::move(tracked_m))};
}

/// The distances once readings in the other hemisphere are mirrored back, which only shows where true places and
/// readings have one scale.
/// @param slip what the true positions are multiples of
Distances repairedDistances(std::vector<Node> nodes, double slip) {
  std::vector<Node> scaled = nodes;
  for (Node& node : scaled) node.reference_from_sensor.position_m /= slip;
  const std::vector<bool> is_mirrored = mirroredRows(scaled);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (is_mirrored[i]) nodes[i].tracker_from_sensor.position_m *= -1.0;
  }
  return medianDistances(nodes);
}

bool isPlausible(double ratio) { return ratio >= 1.0 / kLargestRatio && ratio <= kLargestRatio; }

/// A slip that the distances tell of, and the distances under it.
struct NearestSlip {
  UnitSlip slip{1.0, ""};
  Distances distances;
  double off = std::numeric_limits<double>::infinity();  ///< Of the ratio from the slip, as a logarithm.
};

NearestSlip nearestSlip(const std::vector<Node>& nodes) {
  NearestSlip nearest;
  for (const UnitSlip& slip : kUnitSlips) {
    for (const double factor : {slip.factor, 1.0 / slip.factor}) {
      const Distances distances = repairedDistances(nodes, factor);
      const double off = std::abs(std::log(distances.ratio() / factor));
      if (nearest.distances.true_m == 0.0 || off < nearest.off) nearest = {slip, distances, off};
    }
  }
  return nearest;
}

std::string threeFigures(double value) {
  char text[32];
  std::snprintf(text, sizeof text, value >= 100.0 && value < 1e6 ? "%.0f" : "%.3g", value);
  return text;
}

std::string slipText(const NearestSlip& nearest) {
  const double ratio = nearest.distances.ratio();
  const std::string medians = "median " + threeFigures(nearest.distances.true_m) + " m between true positions, " +
                              threeFigures(nearest.distances.tracked_m) + " m between readings";
  if (!(ratio > 0.0)) return "most places share one true position (" + medians + ")";
  if (!std::isfinite(ratio)) return "most places share one reading (" + medians + ")";
  const std::string wider = ratio > 1.0 ? "true positions" : "readings";
  const std::string other = ratio > 1.0 ? "readings" : "true positions";
  return "the " + wider + " lie " + threeFigures(std::max(ratio, 1.0 / ratio)) + " times as far apart as the " + other +
         " (" + medians + "); the nearest slip of units is " + formatNumber(nearest.slip.factor) + ", " +
         nearest.slip.words;
}

/// What is needed where true positions and readings are not of one scale.
std::string remedyText(double ratio) {
  if (!(ratio > 0.0)) return "a true position of each place is needed";
  if (!std::isfinite(ratio)) return "a reading of each place is needed, of a sensor that is moved with the jig";
  return "both must be in metres";
}

/// Whether true positions and readings of some rows are of one scale, or are too few to tell.
bool areOfOneScale(const std::vector<Node>& nodes) {
  std::set<int> places;
  for (const Node& node : nodes) places.insert(node.node);
  return places.size() < kFewestPlaces || isPlausible(repairedDistances(representatives(nodes), 1.0).ratio());
}

/// @param nodes that are not of one scale
std::string scaleText(const std::vector<Node>& nodes) {
  const NearestSlip nearest = nearestSlip(representatives(nodes));
  return slipText(nearest) + "; " + remedyText(nearest.distances.ratio());
}

/// What is wrong with rows that are not of one scale: with one sensor's, where the others' are as they should be.
std::string scaleTextBySensor(const std::vector<Node>& nodes) {
  const std::vector<int> sensors = sensorsOf(nodes);
  const auto is_at_fault = [&](int sensor) { return !areOfOneScale(nodesOfSensor(nodes, sensor)); };
  const auto at_fault = std::find_if(sensors.begin(), sensors.end(), is_at_fault);
  if (at_fault == sensors.end() || std::all_of(sensors.begin(), sensors.end(), is_at_fault)) return scaleText(nodes);
  return "sensor " + std::to_string(*at_fault) + ": " + scaleText(nodesOfSensor(nodes, *at_fault)) +
         "; the rows of a sensor that failed can be left out, role skipped";
}

/// "line 7, column x_m", or by the row's key where it is of no file.
std::string whereOf(const Node& node, std::optional<int> line, Eigen::Index axis) {
  const std::string column = std::string("column ") + "xyz"[axis] + "_m";
  if (line) return "line " + std::to_string(*line) + ", " + column;
  return "node " + std::to_string(node.node) + ", sensor " + std::to_string(node.sensor) + ", visit " +
         std::to_string(node.visit) + ", " + column;
}

Result<void> checkReadings(const CalibrationTable& table, std::span<const int> lines) {
  for (std::size_t i = 0; i < table.nodes.size(); ++i) {
    const Node& node = table.nodes[i];
    if (!isUsable(node)) continue;
    Eigen::Index axis = 0;
    if (node.tracker_from_sensor.position_m.cwiseAbs().maxCoeff(&axis) <= kTrackerReach_m) continue;
    const auto line = i < lines.size() ? std::optional(lines[i]) : std::nullopt;
    return fail(ErrorCode::kBadInput, whereOf(node, line, axis) + ": the reading lies at " +
                                          threeFigures(node.tracker_from_sensor.position_m[axis]) +
                                          " m, farther than the " + threeFigures(kTrackerReach_m) +
                                          " m that any tracker reaches; readings must be in metres");
  }
  return {};
}

}  // namespace

Result<void> checkUnits(const CalibrationTable& table, std::span<const int> lines) {
  std::vector<Node> nodes;
  std::set<int> places;
  for (const Node& node : table.nodes) {
    if (!isUsable(node)) continue;
    nodes.push_back(node);
    places.insert(node.node);
  }
  if (places.size() < 2) return checkReadings(table, lines);
  const double width_m = trueBox_m(nodes).sizes().maxCoeff();
  if (!areOfOneScale(nodes)) return fail(ErrorCode::kBadInput, scaleTextBySensor(nodes));
  const std::string the_places = "the " + std::to_string(places.size()) + " places ";
  if (width_m > kTrackerReach_m) {
    return fail(ErrorCode::kBadInput, the_places + "are spread over " + threeFigures(width_m) + " m, more than the " +
                                          threeFigures(kTrackerReach_m) +
                                          " m that any tracker reaches; true positions must be in metres");
  }
  if (width_m <= kNarrowest_m) {
    return fail(ErrorCode::kBadInput, the_places + "all lie within " + threeFigures(1e3 * width_m) +
                                          " mm of each other; true positions must be in metres");
  }
  return checkReadings(table, lines);
}

ReadingUnits::ReadingUnits(const Region& region, std::span<const Eigen::Vector3d> tracked_m) : region_(region) {
  is_settled_ = region.empty() || tracked_m.empty();
  if (is_settled_) return;
  Eigen::Vector3d low_m = tracked_m.front(), high_m = tracked_m.front();
  for (const Eigen::Vector3d& p_m : tracked_m) {
    low_m = low_m.cwiseMin(p_m);
    high_m = high_m.cwiseMax(p_m);
  }
  center_m_ = 0.5 * (low_m + high_m);
}

bool ReadingUnits::isNear(const Eigen::Vector3d& reading_m) const {
  return region_.contains(center_m_ + (reading_m - center_m_) / kEnlargement);
}

void ReadingUnits::add(const Eigen::Vector3d& reading_m) {
  if (is_settled_) return;
  is_settled_ = region_.contains(reading_m);
  n_near_ += isNear(reading_m) ? 1 : 0;
  ++n_readings_;
  for (std::size_t i = 0; i < kUnitSlips.size(); ++i) {
    for (std::size_t inverse = 0; inverse < 2; ++inverse) {
      const double factor = inverse == 0 ? kUnitSlips[i].factor : 1.0 / kUnitSlips[i].factor;
      const Eigen::Vector3d scaled_m = factor * reading_m;
      hits_[i][inverse].near += isNear(scaled_m) ? 1 : 0;
      hits_[i][inverse].inside += region_.contains(scaled_m) ? 1 : 0;
    }
  }
}

Result<void> ReadingUnits::check() const {
  if (is_settled_ || n_readings_ == 0) return {};
  const bool is_far = n_near_ == 0;
  Hits best;
  double best_factor = 0.0;
  std::string text;
  for (std::size_t i = 0; i < kUnitSlips.size(); ++i) {
    for (std::size_t inverse = 0; inverse < 2; ++inverse) {
      const Hits& hits = hits_[i][inverse];
      if (is_far ? 2 * hits.near <= n_readings_ : 10 * hits.inside < 9 * n_readings_) continue;
      // Around the transmitter the stronger slips gather everything; the mildest that explains as much is meant.
      const auto rank = [](const Hits& h, double factor) { return std::tuple(h.inside, h.near, -factor); };
      if (!text.empty() && rank(hits, kUnitSlips[i].factor) <= rank(best, best_factor)) continue;
      best = hits;
      best_factor = kUnitSlips[i].factor;
      text = std::string(inverse == 0 ? "multiplied" : "divided") + " by " + formatNumber(kUnitSlips[i].factor) + " (" +
             kUnitSlips[i].words + "), " + std::to_string(is_far ? hits.near : hits.inside);
    }
  }
  if (text.empty() || (!is_far && n_readings_ < kFewestReadings)) return {};
  return fail(ErrorCode::kBadInput, "no reading of " + std::to_string(n_readings_) + " lies in the calibrated region" +
                                        (is_far ? ", even enlarged threefold, but " : ", but ") + text +
                                        " would; positions must be in metres");
}

}  // namespace fieldtrue::recording
