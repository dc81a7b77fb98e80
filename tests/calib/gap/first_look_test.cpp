#include "calib/gap/first_look.h"

#include <QTest>
#include <cmath>
#include <limits>
#include <set>

#include "tests/support/test_main.h"

using namespace fieldtrue;

namespace {

/// n x n x 6 places 0.1 m apart, two visits each.
CalibrationTable twiceVisited(int n) {
  CalibrationTable table;
  table.metadata.jig_tolerance_m = 0.001;
  for (int visit = 0; visit < 2; ++visit) {
    for (int k = 0; k < n * n * 6; ++k) {
      const int layer = k / (n * n);
      Node node;
      node.node = 10 + k;
      node.visit = visit;
      node.reference_from_sensor.position_m = 0.1 * Eigen::Vector3d(k % n, k / n % n, layer);
      node.tracker_from_sensor.position_m = node.reference_from_sensor.position_m;
      table.nodes.push_back(node);
    }
  }
  return table;
}

std::set<int> placesOf(const CalibrationTable& table) {
  std::set<int> places;
  for (const Node& node : table.nodes) places.insert(node.node);
  return places;
}

}  // namespace

class FirstLookTest : public QObject {
  Q_OBJECT
 private slots:
  void takesSpreadPlacesWithAllTheirVisits();
  void smallTablesNeedNone();
  void leavesOutWhatSaysNothing();
};

void FirstLookTest::takesSpreadPlacesWithAllTheirVisits() {
  const CalibrationTable table = twiceVisited(6);
  const auto part = gap::firstLook(table);
  QVERIFY(part);
  QCOMPARE(placesOf(*part).size(), gap::kFirstLookPlaces);
  QCOMPARE(part->nodes.size(), 2 * gap::kFirstLookPlaces);
  QCOMPARE(part->metadata.jig_tolerance_m, table.metadata.jig_tolerance_m);
  for (const Node& node : table.nodes) {
    double nearest_m = std::numeric_limits<double>::infinity();
    for (const Node& chosen : part->nodes)
      nearest_m =
          std::min(nearest_m, (chosen.reference_from_sensor.position_m - node.reference_from_sensor.position_m).norm());
    QVERIFY2(nearest_m < 0.25, qPrintable(QString::number(nearest_m)));
  }
}

void FirstLookTest::smallTablesNeedNone() {
  QVERIFY(!gap::firstLook(CalibrationTable()));
  CalibrationTable table = twiceVisited(6);
  while (placesOf(table).size() >= 3 * gap::kFirstLookPlaces) table.nodes.erase(table.nodes.begin() + 100);
  QVERIFY(placesOf(table).size() == 3 * gap::kFirstLookPlaces - 1);
  QVERIFY(!gap::firstLook(table));
}

void FirstLookTest::leavesOutWhatSaysNothing() {
  CalibrationTable table = twiceVisited(7);
  for (std::size_t i = 0; i < table.nodes.size(); i += 5) table.nodes[i].role = NodeRole::kSkipped;
  for (std::size_t i = 1; i < table.nodes.size(); i += 5)
    table.nodes[i].tracker_from_sensor.position_m.x() = std::numeric_limits<double>::quiet_NaN();
  const auto part = gap::firstLook(table);
  QVERIFY(part);
  for (const Node& node : part->nodes) {
    QVERIFY(node.role != NodeRole::kSkipped);
    QVERIFY(node.tracker_from_sensor.position_m.allFinite());
  }
}

FIELDTRUE_TEST(FirstLookTest)
#include "first_look_test.moc"
