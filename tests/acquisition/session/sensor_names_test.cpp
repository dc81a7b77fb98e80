#include "acquisition/session/sensor_names.h"

#include <QTemporaryDir>
#include <QTest>

#include "tests/acquisition/session/controller_bench.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

/// A number stands for the sensor that had it when the session began, where the tracker tells which that was.
using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using namespace fieldtrue::testing;

namespace {

/// Another tracker in place of the one before, whose two sensors share the jig and have names.
void connectNamed(Bench& bench, const std::vector<std::string>& names) {
  auto device = std::make_unique<FakeTracker>();
  device->names = names;
  device->on_jig[1] = {{{0.0, 0.04, 0.01}, rotationFromVector({0.0, 0.0, 1.5})}, 4e-4};
  bench.tracker = device.get();
  bench.controller.adoptDevice(std::move(device));
}

}  // namespace

class SensorNamesTest : public QObject {
  Q_OBJECT

 private slots:
  void namesStandByNumber() {
    TableMetadata metadata;
    metadata.other = {{"ndi_sensor_1", "3AB0"},  {"openigtlink_sensor_12", "Probe (TDATA)"},
                      {"ndi_sensor_0", "never"}, {"ndi_sensor_x", "never"},
                      {"ndi_firmware", "D.001"}, {"sensor_2", "never"}};
    using Names = std::map<int, std::string>;
    QVERIFY(sensorNames(metadata) == (Names{{0, "3AB0"}, {11, "Probe"}}));
    forgetSensorNames(metadata);
    QVERIFY(sensorNames(metadata).empty());
    QCOMPARE(metadata.other.size(), std::size_t{4});
    // One without a name then or now is not compared, nor one that is not recorded.
    QCOMPARE(otherNamesText({0, 1, 3}, {{0, "A"}, {1, "B"}, {2, "C"}}, {{0, "A"}, {2, "D"}, {3, "E"}}), std::string());
    FT_VERIFY_MATCH(holdsAll(otherNamesText({0, 1}, {{0, "A"}, {1, "B"}}, {{0, "A"}, {1, "C"}}),
                             {"Sensor 1 was B in this session and is C now: nothing is recorded"}));
  }

  void sensorsOfOtherNamesRecordNothing() {
    QTemporaryDir folder;
    const QString path = folder.filePath("names.fieldtrue");
    {
      Bench bench(path, planOf({2, 2, 1}));
      connectNamed(bench, {"Old (TDATA)", "A (TDATA)"});
      // Before the first take nothing hangs on them.
      connectNamed(bench, {"A (TDATA)", "B (TDATA)"});
      bench.takeHere();
      QCOMPARE(bench.nodes.size(), std::size_t{2});
      QVERIFY(bench.remarks.isEmpty());
      bench.controller.closeSession();
    }
    Bench bench(path, {}, false, 100.0);
    connectNamed(bench, {"B (TDATA)", "A (TDATA)"});
    QCOMPARE(bench.remarks.size(), 1);
    FT_VERIFY_MATCH(holdsAll(
        bench.remarks[0].toStdString(),
        {"Sensor 0 was A in this session and is B now", "sensor 1 was B", "connect them in the order of the session"}));
    bench.readTables();
    const std::size_t n_rows = bench.samples.rows.size();
    bench.takeHere();
    bench.controller.setAutomatic(true);
    bench.tracker->stand(5.0);
    bench.readTables();
    QVERIFY(bench.nodes.empty() && bench.samples.rows.size() == n_rows);
    QVERIFY(bench.controller.status().attention);
    QCOMPARE(bench.controller.status().reason, bench.remarks[0]);
    FT_VERIFY_MATCH(holdsAll(bench.take_failures.value(0).toStdString(), {"Sensor 0 was A"}));

    bench.controller.setAutomatic(false);
    connectNamed(bench, {"A (TRANSFORM)", "B (TDATA)", "C (TDATA)"});
    bench.takeHere();
    QCOMPARE(bench.nodes.size(), std::size_t{2});
  }
};

FIELDTRUE_TEST(SensorNamesTest)
#include "sensor_names_test.moc"
