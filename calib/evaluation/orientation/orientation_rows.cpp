#include "calib/evaluation/orientation/orientation_rows.h"

#include <algorithm>
#include <map>

#include "calib/calibration/alignment.h"
#include "calib/calibration/corrector.h"
#include "calib/core/units.h"
#include "calib/tables/table_sensors.h"

namespace fieldtrue::evaluation {
namespace {

constexpr std::size_t kMostGroups = 8;

/// Groups around orientations picked farthest from those picked before, until all are within the tolerance or there
/// are enough groups.
void groupOrientations(OrientationRows& rows) {
  rows.group.assign(rows.size(), 0);
  std::vector<double> nearest_rad(rows.size(), 10.0);
  std::size_t next = 0;
  for (std::size_t g = 0; g < kMostGroups; ++g) {
    const Eigen::Quaterniond center = rows.q_true[next];
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double angle_rad = angleBetween_rad(center, rows.q_true[i]);
      if (angle_rad >= nearest_rad[i]) continue;
      nearest_rad[i] = angle_rad;
      rows.group[i] = g;
    }
    rows.n_groups = g + 1;
    next = static_cast<std::size_t>(std::max_element(nearest_rad.begin(), nearest_rad.end()) - nearest_rad.begin());
    rows.has_more_groups = nearest_rad[next] > kAlike_rad;
    if (!rows.has_more_groups) break;
  }
}

int sensorOfMostRows(std::span<const Node> nodes) {
  std::map<int, std::size_t> n_rows;
  for (const Node& node : nodes) ++n_rows[node.sensor];
  const auto most =
      std::max_element(n_rows.begin(), n_rows.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == n_rows.end() ? 0 : most->first;
}

}  // namespace

const char* unitOf(PosePart part) { return part == PosePart::kPosition ? "mm" : "degrees"; }

std::vector<Node> nodesOfAskedSensor(const CalibrationTable& table) {
  std::vector<Node> nodes;
  std::copy_if(table.nodes.begin(), table.nodes.end(), std::back_inserter(nodes),
               [](const Node& node) { return node.role != NodeRole::kSkipped; });
  return nodesOfSensor(nodes, sensorOfMostRows(nodes));
}

Result<OrientationRows> orientationRows(const CalibrationTable& table, PosePart part) {
  const std::vector<Node> nodes = nodesOfAskedSensor(table);
  const auto n_without = std::count_if(nodes.begin(), nodes.end(), [](const Node& n) { return !n.has_orientation; });
  if (nodes.empty() || n_without > 0)
    return fail(ErrorCode::kUnsupported,
                "Whether errors depend on orientation needs an orientation in every row, and " +
                    std::to_string(n_without) + " of " + std::to_string(nodes.size()) + " rows have none");
  calibration::Alignment alignment;
  if (calibration::defaultAlignMode(table.metadata) == calibration::AlignMode::kRigid) {
    FT_TRY(const auto fitted, calibration::fitAlignment(nodes, table.metadata.jig_tolerance_m));
    alignment = fitted;
  }
  correctors::FitData data = calibration::makeFitData(nodes, table.metadata, alignment);
  OrientationRows rows;
  std::map<int, std::size_t> number_of_place;
  for (std::size_t i = 0; i < data.size(); ++i) {
    if (part == PosePart::kPosition)
      rows.error.push_back((data.p_tracked_m[i] - data.p_true_m[i]) / kMPerMm);
    else
      rows.error.push_back(kDegPerRad * rotationVector_rad(data.q_tracked[i] * data.q_true[i].conjugate()));
    rows.place.push_back(number_of_place.try_emplace(data.node[i], number_of_place.size()).first->second);
  }
  rows.n_places = number_of_place.size();
  rows.dimension = data.dimension;
  rows.node = std::move(data.node);
  rows.p_tracked_m = std::move(data.p_tracked_m);
  rows.q_true = std::move(data.q_true);
  groupOrientations(rows);
  return rows;
}

int placesWithThreeOrientations(const OrientationRows& rows) {
  std::vector<std::vector<Eigen::Quaterniond>> distinct(rows.n_places);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::vector<Eigen::Quaterniond>& seen = distinct[rows.place[i]];
    const bool is_known = std::any_of(seen.begin(), seen.end(), [&](const Eigen::Quaterniond& q) {
      return angleBetween_rad(q, rows.q_true[i]) <= kAlike_rad;
    });
    if (!is_known) seen.push_back(rows.q_true[i]);
  }
  return static_cast<int>(std::count_if(distinct.begin(), distinct.end(), [](const auto& q) { return q.size() >= 3; }));
}

}  // namespace fieldtrue::evaluation
