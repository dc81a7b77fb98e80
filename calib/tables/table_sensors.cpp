#include "calib/tables/table_sensors.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <string>

namespace fieldtrue {

std::string sensorsText(const std::vector<int>& sensors) {
  std::string text = sensors.size() == 1 ? "sensor " : "sensors ";
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const bool is_last = i + 1 == sensors.size();
    text += (i == 0 ? "" : is_last ? " and " : ", ") + std::to_string(sensors[i]);
  }
  return text;
}

std::vector<int> sensorsOf(std::span<const Node> nodes) {
  std::set<int> sensors;
  for (const Node& node : nodes) {
    if (node.role != NodeRole::kSkipped) sensors.insert(node.sensor);
  }
  return {sensors.begin(), sensors.end()};
}

std::vector<int> sensorsOf(const CalibrationTable& table) { return sensorsOf(std::span<const Node>(table.nodes)); }

std::vector<Node> nodesOfSensor(std::span<const Node> nodes, int sensor) {
  std::vector<Node> rows;
  std::copy_if(nodes.begin(), nodes.end(), std::back_inserter(rows),
               [&](const Node& node) { return node.sensor == sensor; });
  return rows;
}

Result<CalibrationTable> rowsOfSensor(const CalibrationTable& table, std::optional<int> sensor) {
  const std::vector<int> sensors = sensorsOf(table);
  if (!sensor && sensors.size() <= 1) return table;
  if (!sensor) {
    return fail(ErrorCode::kBadInput, "the table holds rows of " + sensorsText(sensors) +
                                          ", and each sensor has a mounting of its own; choose one of them");
  }
  if (std::find(sensors.begin(), sensors.end(), *sensor) == sensors.end()) {
    return fail(ErrorCode::kBadInput, "the table holds no row of sensor " + std::to_string(*sensor) +
                                          (sensors.empty() ? "" : ", only of " + sensorsText(sensors)));
  }
  CalibrationTable rows{table.metadata, {}};
  std::copy_if(table.nodes.begin(), table.nodes.end(), std::back_inserter(rows.nodes),
               [&](const Node& node) { return node.sensor == *sensor || node.role == NodeRole::kSkipped; });
  return rows;
}

SampleTable rowsOfSensor(const SampleTable& table, int sensor) {
  SampleTable rows{table.metadata, {}};
  std::copy_if(table.rows.begin(), table.rows.end(), std::back_inserter(rows.rows),
               [&](const SampleRow& row) { return row.sample.sensor == sensor; });
  return rows;
}

}  // namespace fieldtrue
