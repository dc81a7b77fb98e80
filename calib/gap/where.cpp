#include "calib/gap/where.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <random>

#include "calib/core/statistics.h"
#include "calib/core/units.h"
#include "calib/gap/row_tails.h"

namespace fieldtrue::gap {
namespace {

struct RowGap {
  double floor_mm = 0.0;
  double floor_deg = 0.0;
  double range_m = 0.0;
  double time_s = 0.0;
};

double rms(double sum, std::size_t count) { return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0.0; }

/// RMS and floor of the rows in one bin.
GapBin binOf(const std::vector<std::size_t>& members, const GapReport& report, const std::vector<RowGap>& rows) {
  GapBin bin;
  double gap = 0.0;
  double floor = 0.0;
  for (const std::size_t i : members) {
    gap += report.nodes[i].before_m.squaredNorm() * 1e6;
    floor += rows[i].floor_mm * rows[i].floor_mm;
  }
  bin.rms_mm = rms(gap, members.size());
  bin.floor_mm = rms(floor, members.size());
  return bin;
}

/// Bins with equally many rows each, by a value.
std::vector<GapBin> equalBins(const std::function<double(std::size_t)>& value, const GapReport& report,
                              const std::vector<RowGap>& rows) {
  std::vector<std::size_t> order(rows.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return value(a) < value(b); });
  const std::size_t count = std::clamp<std::size_t>(rows.size() / 12, 1, 8);
  std::vector<GapBin> bins;
  for (std::size_t b = 0; b < count; ++b) {
    const std::vector<std::size_t> members(order.begin() + static_cast<std::ptrdiff_t>(b * order.size() / count),
                                           order.begin() + static_cast<std::ptrdiff_t>((b + 1) * order.size() / count));
    GapBin bin = binOf(members, report, rows);
    bin.low = value(members.front());
    bin.high = value(members.back());
    bins.push_back(bin);
  }
  return bins;
}

std::vector<GapBin> layerBins(const identify::GapRows& table, const GapReport& report,
                              const std::vector<RowGap>& rows) {
  std::map<long, std::vector<std::size_t>> layers;
  for (std::size_t i = 0; i < rows.size(); ++i)
    layers[std::lround(table.rows[i].reference_from_sensor.position_m.z() / 0.02)].push_back(i);
  std::vector<GapBin> bins;
  if (layers.size() > 40) return bins;
  for (const auto& [layer, members] : layers) {
    GapBin bin = binOf(members, report, rows);
    bin.low = bin.high = table.rows[members.front()].reference_from_sensor.position_m.z();
    bins.push_back(bin);
  }
  return bins;
}

void addChannel(const std::string& name, const std::string& unit, const std::vector<double>& values,
                const std::vector<double>& floors, GapReport& report) {
  double sum = 0.0;
  double floor = 0.0;
  for (const double v : values) sum += v * v;
  for (const double f : floors) floor += f * f;
  report.channels.push_back({name, unit, rms(sum, values.size()), rms(floor, floors.size())});
}

void describeChannels(const identify::GapRows& table, const GapReport& at, const std::vector<identify::Matrix6d>& noise,
                      GapReport& report) {
  const char* const kAxes[] = {"x", "y", "z"};
  std::vector<double> radial;
  std::vector<double> radial_floor;
  std::vector<double> across;
  std::vector<double> across_floor;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    std::vector<double> floors;
    for (std::size_t i = 0; i < noise.size(); ++i) {
      values.push_back(1e3 * at.nodes[i].before_m[axis]);
      floors.push_back(1e3 * std::sqrt(noise[i](axis, axis)));
    }
    addChannel(kAxes[axis], "mm", values, floors, report);
  }
  for (std::size_t i = 0; i < noise.size(); ++i) {
    const Eigen::Vector3d u = at.nodes[i].place_m.normalized();
    const double along = at.nodes[i].before_m.dot(u);
    const double var = u.dot(noise[i].topLeftCorner<3, 3>() * u);
    radial.push_back(1e3 * along);
    radial_floor.push_back(1e3 * std::sqrt(var));
    across.push_back(1e3 * (at.nodes[i].before_m - along * u).norm() / std::numbers::sqrt2);
    across_floor.push_back(1e3 * std::sqrt(0.5 * (noise[i].topLeftCorner<3, 3>().trace() - var)));
  }
  addChannel("radial", "mm", radial, radial_floor, report);
  addChannel("transverse", "mm", across, across_floor, report);
  for (int axis = 0; axis < 3 && table.has_orientation; ++axis) {
    std::vector<double> values;
    std::vector<double> floors;
    for (std::size_t i = 0; i < noise.size(); ++i) {
      values.push_back(kDegPerRad * at.nodes[i].before_rad[axis]);
      floors.push_back(kDegPerRad * std::sqrt(noise[i](3 + axis, 3 + axis)));
    }
    addChannel(std::string("rotation_") + kAxes[axis], "deg", values, floors, report);
  }
}

/// The middle of the rows with at least half the largest excess, weighted by its square.
/// @param times how often each row counts
std::optional<Hotspot> hottest(const std::vector<GapNode>& nodes, const std::vector<double>& times) {
  double most = 0.0;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (nodes[i].is_flagged && times[i] > 0.0) most = std::max(most, nodes[i].excess);
  if (!(most > 0.0)) return std::nullopt;
  std::vector<double> weights;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const bool counts = nodes[i].is_flagged && nodes[i].excess >= 0.5 * most;
    weights.push_back(counts ? times[i] * nodes[i].excess * nodes[i].excess : 0.0);
  }
  const double weight = std::accumulate(weights.begin(), weights.end(), 0.0);
  Hotspot hotspot;
  for (std::size_t i = 0; i < nodes.size(); ++i) hotspot.center_m += weights[i] / weight * nodes[i].place_m;
  double spread_m2 = 0.0;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    spread_m2 += weights[i] / weight * (nodes[i].place_m - hotspot.center_m).squaredNorm();
  hotspot.radius_m = std::sqrt(spread_m2);
  return hotspot;
}

/// Distance from a row to the nearest other place, 0 where there is none.
double nearestOther_m(const std::vector<GapNode>& nodes, const Eigen::Vector3d& center_m) {
  const auto nearer = [&](const GapNode& a, const GapNode& b) {
    return (a.place_m - center_m).squaredNorm() < (b.place_m - center_m).squaredNorm();
  };
  const GapNode& nearest = *std::min_element(nodes.begin(), nodes.end(), nearer);
  double other_m = std::numeric_limits<double>::infinity();
  for (const GapNode& node : nodes)
    if (node.node != nearest.node) other_m = std::min(other_m, (node.place_m - nearest.place_m).norm());
  return std::isfinite(other_m) ? other_m : 0.0;
}

/// How far the middle moves when other places are drawn from the same ones, and what lies between them: evenly within
/// half a pitch, half of it for the three axes together.
/// @source Efron 1979, Ann. Statist. 7 1
std::optional<double> centerSd_m(const std::vector<GapNode>& nodes, const Eigen::Vector3d& center_m) {
  constexpr int kDraws = 200;
  std::map<int, std::size_t> place_of;
  for (const GapNode& node : nodes) place_of.emplace(node.node, place_of.size());
  std::mt19937_64 generator(1);
  double sum_m2 = 0.0, draws = 0.0;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<double> drawn(place_of.size(), 0.0);
    for (std::size_t k = 0; k < drawn.size(); ++k) drawn[generator() % drawn.size()] += 1.0;
    std::vector<double> times;
    for (const GapNode& node : nodes) times.push_back(drawn[place_of[node.node]]);
    const auto again = hottest(nodes, times);
    if (!again) continue;
    sum_m2 += (again->center_m - center_m).squaredNorm();
    draws += 1.0;
  }
  if (draws < 0.25 * kDraws) return std::nullopt;
  return std::hypot(std::sqrt(sum_m2 / draws), 0.5 * nearestOther_m(nodes, center_m));
}

/// Where, going away from the middle, the gap of the nearest rows (RMS, in floors) has fallen to half.
std::optional<double> halfDistance_m(const std::vector<GapNode>& nodes, const Eigen::Vector3d& center_m) {
  std::vector<std::pair<double, double>> rows;  // Distance, squared excess.
  for (const GapNode& node : nodes) rows.emplace_back((node.place_m - center_m).norm(), node.excess * node.excess);
  std::sort(rows.begin(), rows.end());
  const std::size_t together = std::max<std::size_t>(3, rows.size() / 20);
  if (rows.size() < 3 * together) return std::nullopt;
  double first = 0.0;
  for (std::size_t from = 0; from + together <= rows.size(); ++from) {
    double square = 0.0, distance_m = 0.0;
    for (std::size_t k = from; k < from + together; ++k) {
      square += rows[k].second / static_cast<double>(together);
      distance_m += rows[k].first / static_cast<double>(together);
    }
    if (from == 0) first = square;
    if (square < 0.25 * first) return distance_m;
  }
  return std::nullopt;
}

void describeHotspot(GapReport& report) {
  report.hotspot = hottest(report.nodes, std::vector<double>(report.nodes.size(), 1.0));
  if (!report.hotspot) return;
  report.hotspot->sd_m = centerSd_m(report.nodes, report.hotspot->center_m);
  report.hotspot->half_m = halfDistance_m(report.nodes, report.hotspot->center_m);
}

}  // namespace

void describeWhere(const identify::GapSearch& search, const identify::GapModel& with_effects, GapReport& report) {
  const identify::GapRows& table = search.physics().rows();
  const identify::GapModel& none = search.none().model;
  const std::vector<identify::Vector6d> before = search.physics().residuals(none);
  const std::vector<identify::Vector6d> after = search.physics().residuals(with_effects);
  const std::vector<identify::Vector6d> white = identify::whitenedResiduals(
      search.physics(), none, identify::makeWhitening(table, search.floorPlacingSd_m(), search.floorPlacingSd_rad()));
  const std::vector<field::SensorSetting> settings = search.physics().settings(with_effects.alignment);
  std::vector<identify::Matrix6d> noise;
  std::vector<RowGap> rows;
  const double channels = table.channels();
  double sum = 0.0;
  double floor_m2 = 0.0;
  double floor_rad2 = 0.0;
  double gap_m2 = 0.0;
  double gap_rad2 = 0.0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    noise.push_back(identify::noiseOf(table.rows[i], search.floorPlacingSd_m(), search.floorPlacingSd_rad()));
    const double var_m2 = noise.back().topLeftCorner<3, 3>().trace();
    const double var_rad2 = noise.back().bottomRightCorner<3, 3>().trace();
    rows.push_back({1e3 * std::sqrt(var_m2), kDegPerRad * std::sqrt(var_rad2),
                    settings[i].tracker_from_sensor.position_m.norm(), table.rows[i].time_s});
    const double d2 = white[i].squaredNorm();
    sum += d2;
    floor_m2 += var_m2;
    floor_rad2 += var_rad2;
    gap_m2 += before[i].head<3>().squaredNorm();
    gap_rad2 += before[i].tail<3>().squaredNorm();
    GapNode node;
    node.node = table.rows[i].node;
    node.visit = table.rows[i].visit;
    node.sensor = table.sensors[table.rows[i].sensor];
    node.place_m = settings[i].tracker_from_sensor.position_m;
    node.before_m = before[i].head<3>();
    node.after_m = after[i].head<3>();
    node.before_rad = before[i].tail<3>();
    node.after_rad = after[i].tail<3>();
    node.excess = std::sqrt(std::max(0.0, d2 / channels - 1.0));
    report.nodes.push_back(node);
  }
  const std::vector<char> flagged = farOff(search, white, search.thresholds().false_discoveries);
  for (std::size_t i = 0; i < flagged.size(); ++i) report.nodes[i].is_flagged = flagged[i] != 0;
  const auto n = static_cast<double>(before.size());
  report.position_rms_mm = 1e3 * std::sqrt(gap_m2 / n);
  report.floor_position_mm = 1e3 * std::sqrt(floor_m2 / n);
  if (table.has_orientation) {
    report.orientation_rms_deg = kDegPerRad * std::sqrt(gap_rad2 / n);
    report.floor_orientation_deg = kDegPerRad * std::sqrt(floor_rad2 / n);
  }
  report.ratio_to_floor = std::sqrt(sum / (n * channels));
  describeHotspot(report);
  describeChannels(table, report, noise, report);
  report.by_range = equalBins([&](std::size_t i) { return rows[i].range_m; }, report, rows);
  report.by_layer = layerBins(table, report, rows);
  if (table.has_times) report.by_time = equalBins([&](std::size_t i) { return rows[i].time_s; }, report, rows);
}

}  // namespace fieldtrue::gap
