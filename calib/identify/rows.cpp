#include "calib/identify/rows.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "calib/core/statistics.h"
#include "calib/geometry/geometry.h"
#include "calib/identify/model.h"

namespace fieldtrue::identify {
namespace {

/// How many clearly different orientations the rig states.
int countOrientations(std::span<const GapRow> rows) {
  constexpr double kDifferent_rad = 0.17;
  std::vector<Eigen::Quaterniond> seen;
  for (const GapRow& row : rows) {
    const Eigen::Quaterniond& q = row.reference_from_sensor.orientation;
    const bool known = std::any_of(seen.begin(), seen.end(),
                                   [&](const auto& other) { return angleBetween_rad(q, other) < kDifferent_rad; });
    if (!known) seen.push_back(q);
    if (seen.size() > 50) break;
  }
  return static_cast<int>(seen.size());
}

GapRow rowOf(const Node& node) {
  GapRow row;
  row.node = node.node;
  row.visit = node.visit;
  row.reference_from_sensor = node.reference_from_sensor;
  row.tracker_from_sensor = node.tracker_from_sensor;
  row.index = node.index;
  const double n = std::max(1.0, node.n_effective);
  if (node.covariance_m2) row.mean_covariance_m2 = *node.covariance_m2 / n;
  if (node.sd_rot_rad) row.mean_rotation_variance_rad2 = *node.sd_rot_rad * *node.sd_rot_rad / (3.0 * n);
  if (node.t_start_s) row.time_s = node.t_end_s ? 0.5 * (*node.t_start_s + *node.t_end_s) : *node.t_start_s;
  return row;
}

}  // namespace

Result<GapRows> makeGapRows(std::span<const Node> nodes, const TableMetadata& metadata, const Thresholds& thresholds) {
  GapRows table;
  table.has_orientation = std::all_of(nodes.begin(), nodes.end(), [](const Node& n) { return n.has_orientation; });
  table.has_times = std::all_of(nodes.begin(), nodes.end(), [](const Node& n) { return n.t_start_s.has_value(); });
  std::map<int, std::size_t> place_of;
  std::set<int> sensors;
  for (const Node& node : nodes) sensors.insert(node.sensor);
  table.sensors.assign(sensors.begin(), sensors.end());
  for (const Node& node : nodes) {
    GapRow row = rowOf(node);
    const auto [found, is_new] = place_of.emplace(node.node, table.place_nodes.size());
    if (is_new) table.place_nodes.push_back(node.node);
    row.place = found->second;
    row.sensor = static_cast<std::size_t>(std::distance(sensors.begin(), sensors.find(node.sensor)));
    table.rows.push_back(row);
  }
  if (table.place_nodes.size() < thresholds.fewest_places) {
    return fail(ErrorCode::kTooFewNodes, "The gap is looked for with at least " +
                                             std::to_string(thresholds.fewest_places) + " places; the table has " +
                                             std::to_string(table.place_nodes.size()) + ".");
  }
  table.n_orientations = countOrientations(table.rows);
  table.several_orientations = table.n_orientations > 1;
  table.alignment_known = metadata.alignment_known;
  table.alignment_tolerance_m = metadata.alignment_tolerance_m.value_or(0.0);
  table.alignment_tolerance_rad = metadata.alignment_tolerance_rad.value_or(0.0);
  const double quantum_m = metadata.quantum_m.value_or(0.0);
  if (metadata.jig_tolerance_m) table.placing_sd_m = std::hypot(*metadata.jig_tolerance_m, quantum_m / std::sqrt(12.0));
  if (metadata.jig_tolerance_rad) table.placing_sd_rad = *metadata.jig_tolerance_rad;
  table.has_dipoles = metadata.transmitter_model.value_or("dipole") == "dipole";
  table.excitation.is_pulsed_dc = metadata.excitation == "pulsed_dc";
  if (metadata.carrier_hz) table.excitation.carrier_hz = *metadata.carrier_hz;
  return table;
}

double worstPlacing_m(const GapRows& rows, const Thresholds& thresholds) {
  if (!rows.placing_sd_m) return thresholds.worst_placing_m;
  return std::max(thresholds.best_placing_m, thresholds.stated_too_small * *rows.placing_sd_m);
}

double worstPlacing_rad(const GapRows& rows, const Thresholds& thresholds) {
  if (!rows.placing_sd_rad) return thresholds.worst_placing_rad;
  return std::max(thresholds.best_placing_rad, thresholds.stated_too_small * *rows.placing_sd_rad);
}

Matrix6d noiseOf(const GapRow& row, double placing_sd_m, double placing_sd_rad) {
  constexpr double kLeast_m = 1e-6;
  constexpr double kLeast_rad = 1e-6;
  Matrix6d noise = Matrix6d::Zero();
  noise.topLeftCorner<3, 3>() =
      row.mean_covariance_m2 + (placing_sd_m * placing_sd_m + kLeast_m * kLeast_m) * Eigen::Matrix3d::Identity();
  noise.bottomRightCorner<3, 3>() =
      (row.mean_rotation_variance_rad2 + placing_sd_rad * placing_sd_rad + kLeast_rad * kLeast_rad) *
      Eigen::Matrix3d::Identity();
  return noise;
}

std::vector<int> mirroredSensors(const GapRows& table, const Thresholds& thresholds) {
  std::vector<int> mirrored;
  for (std::size_t sensor = 0; sensor < table.sensors.size(); ++sensor) {
    std::vector<Eigen::Vector3d> p_true_m, p_tracked_m;
    for (const GapRow& row : table.rows) {
      if (row.sensor != sensor) continue;
      p_true_m.push_back(row.reference_from_sensor.position_m);
      p_tracked_m.push_back(row.tracker_from_sensor.position_m);
    }
    if (isMirrorImage(p_true_m, p_tracked_m, thresholds.mirrored)) mirrored.push_back(table.sensors[sensor]);
  }
  return mirrored;
}

namespace {

/// Blocks numbered from 0 without gaps; those with too few places join the smallest other one.
std::vector<int> joinedBlocks(std::vector<int> block_of_place, std::size_t fewest) {
  for (;;) {
    std::map<int, std::size_t> count;
    for (const int block : block_of_place) ++count[block];
    const auto by_count = [](const auto& a, const auto& b) { return a.second < b.second; };
    const auto smallest = std::min_element(count.begin(), count.end(), by_count);
    if (smallest->second >= fewest || count.size() <= 2) break;
    const int from = smallest->first;
    count.erase(smallest);
    const int to = std::min_element(count.begin(), count.end(), by_count)->first;
    std::replace(block_of_place.begin(), block_of_place.end(), from, to);
  }
  std::map<int, int> number;
  for (int& block : block_of_place) block = number.emplace(block, static_cast<int>(number.size())).first->second;
  return block_of_place;
}

std::vector<int> byRow(const GapRows& table, const std::vector<int>& block_of_place) {
  std::vector<int> block;
  for (const GapRow& row : table.rows) block.push_back(block_of_place[row.place]);
  return block;
}

}  // namespace

std::vector<int> octantBlocks(const GapRows& table, std::size_t fewest) {
  const Pose tracker_from_reference = initialAlignment(table).tracker_from_reference;
  std::vector<Eigen::Vector3d> p_m(table.place_nodes.size());
  for (const GapRow& row : table.rows) p_m[row.place] = tracker_from_reference * row.reference_from_sensor.position_m;
  std::vector<int> block(p_m.size(), 0);
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector3d& p : p_m) values.push_back(p[axis]);
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    const double middle = 0.5 * (*low + *high) + 1e-9;
    for (std::size_t i = 0; i < p_m.size(); ++i) block[i] += p_m[i][axis] > middle ? 1 << axis : 0;
  }
  return byRow(table, joinedBlocks(std::move(block), fewest));
}

std::vector<int> timeBlocks(const GapRows& table, int count) {
  std::vector<double> first_s(table.place_nodes.size(), std::numeric_limits<double>::infinity());
  for (const GapRow& row : table.rows) first_s[row.place] = std::min(first_s[row.place], row.time_s);
  std::vector<std::size_t> order(first_s.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return first_s[a] < first_s[b]; });
  std::vector<int> block(first_s.size());
  for (std::size_t rank = 0; rank < order.size(); ++rank) {
    block[order[rank]] = static_cast<int>(rank * static_cast<std::size_t>(count) / order.size());
  }
  return byRow(table, joinedBlocks(std::move(block), 2));
}

}  // namespace fieldtrue::identify
