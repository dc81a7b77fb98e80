#pragma once

#include <set>
#include <vector>

#include "tests/acquisition/session/controller_bench.h"

namespace fieldtrue::testing {

using Numbers = std::vector<int>;

inline const FakeTracker::OnJig kSecond{{{0.0, 0.04, 0.01}, rotationFromVector({0.0, 0.0, 1.5})}, 4e-4};
inline const FakeTracker::OnJig kThird{{{0.05, 0.0, 0.0}, rotationFromVector({1.0, 0.0, 0.0})}, 2e-4};

/// A bench whose jig carries sensors 0 and 1.
struct TwoSensors : Bench {
  explicit TwoSensors(const QString& path, const acquisition::Plan& plan = planOf({2, 2, 1}), bool create = true,
                      double after_s = 0.0)
      : Bench(path, plan, create, after_s) {
    tracker->on_jig[1] = kSecond;
  }
  Numbers recorded() const {
    Numbers sensors;
    for (const acquisition::SensorProgress& one : controller.status().sensors) sensors.push_back(one.sensor);
    return sensors;
  }
  Numbers sensorsOfTable() {
    readTables();
    std::set<int> sensors;
    for (const Node& node : table.nodes) sensors.insert(node.sensor);
    return {sensors.begin(), sensors.end()};
  }
};

}  // namespace fieldtrue::testing
