#include "calib/tables/table_sensors.h"

#include <QTest>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

Node rowOf(int node, int sensor, NodeRole role = NodeRole::kFit) {
  Node row;
  row.node = node;
  row.sensor = sensor;
  row.role = role;
  return row;
}

}  // namespace

/// Rows of one sensor out of a table of several.
class TableSensorsTest : public QObject {
  Q_OBJECT
 private slots:
  void oneSensorNeedsNoChoice() {
    const CalibrationTable table{{}, {rowOf(0, 3), rowOf(1, 3), rowOf(2, 0, NodeRole::kSkipped)}};
    QVERIFY((sensorsOf(table) == std::vector<int>{3}));
    const auto rows = rowsOfSensor(table, std::nullopt);
    FT_VERIFY_OK(rows);
    QCOMPARE(rows->nodes.size(), std::size_t{3});
    FT_VERIFY_OK(rowsOfSensor(table, 3));
    FT_VERIFY_OK(rowsOfSensor(CalibrationTable{}, std::nullopt));
  }

  void severalAreNamed() {
    CalibrationTable table{{}, {rowOf(0, 2), rowOf(0, 0), rowOf(1, 7), rowOf(1, 2)}};
    table.metadata.rig = "bar";
    const auto refused = rowsOfSensor(table, std::nullopt);
    QVERIFY(!refused);
    FT_VERIFY_MATCH(holdsAll(refused.error().message, {"sensors 0, 2 and 7", "choose"}));
    const auto rows = rowsOfSensor(table, 2);
    FT_VERIFY_OK(rows);
    QCOMPARE(rows->nodes.size(), std::size_t{2});
    for (const Node& node : rows->nodes) QCOMPARE(node.sensor, 2);
    QCOMPARE(*rows->metadata.rig, std::string("bar"));
    const auto absent = rowsOfSensor(table, 1);
    QVERIFY(!absent);
    FT_VERIFY_MATCH(holdsAll(absent.error().message, {"sensor 1", "sensors 0, 2 and 7"}));
  }

  void samplesFollow() {
    SampleTable samples;
    for (const int sensor : {0, 1, 1}) {
      samples.rows.emplace_back();
      samples.rows.back().sample.sensor = sensor;
    }
    QCOMPARE(rowsOfSensor(samples, 1).rows.size(), std::size_t{2});
  }
};

FIELDTRUE_TEST(TableSensorsTest)
#include "table_sensors_test.moc"
