#include "calib/tables/table_setup.h"

#include <algorithm>
#include <string>

namespace fieldtrue {

Setup setupOf(const CalibrationTable& table) {
  Setup setup = table.metadata.setup;
  if (table.metadata.date) setup.emplace("date", *table.metadata.date);
  if (table.nodes.empty()) return setup;
  const int sensor = table.nodes.front().sensor;
  if (std::all_of(table.nodes.begin(), table.nodes.end(), [&](const Node& node) { return node.sensor == sensor; }))
    setup.emplace("sensor", std::to_string(sensor));
  return setup;
}

}  // namespace fieldtrue
