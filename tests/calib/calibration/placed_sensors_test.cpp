#include "calib/calibration/placed_sensors.h"

#include <QTest>
#include <random>

#include "calib/calibration/corrector.h"
#include "calib/core/statistics.h"
#include "calib/evaluation/comparison.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::calibration;
using namespace fieldtrue::testing;

namespace {

const Pose kRigFromTracker{{0.4, -0.2, 0.7}, rotationFromVector({0.3, -0.2, 1.1})};

Eigen::Vector3d offsetOf_m(int sensor) { return {0.05 * sensor, -0.03 * sensor, 0.02 * sensor * sensor}; }

/// What a faultless tracker reports of sensors that ride on one jig; every row says where the jig is.
CalibrationTable rideOnOneJig(int n_sensors, bool is_turned, double noise_sd_m = 0.0) {
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal(0.0, 1.0);
  CalibrationTable table;
  for (int n = 0; n < 48; ++n) {
    const Eigen::Vector3d turn = is_turned ? Eigen::Vector3d(n % 3, n % 2, 0.3 * (n % 5)) : Eigen::Vector3d::Zero();
    const Pose jig{0.3 * Eigen::Vector3i(n % 4, n / 4 % 4, n / 16).cast<double>(), rotationFromVector(turn)};
    for (int sensor = 0; sensor < n_sensors; ++sensor) {
      Node node;
      node.node = n;
      node.sensor = sensor;
      node.reference_from_sensor = jig;
      node.has_orientation = true;
      node.tracker_from_sensor = inverse(kRigFromTracker) * jig;
      node.tracker_from_sensor.position_m = inverse(kRigFromTracker) * (jig * offsetOf_m(sensor));
      node.tracker_from_sensor.position_m +=
          noise_sd_m * Eigen::Vector3d(normal(generator), normal(generator), normal(generator));
      table.nodes.push_back(node);
    }
  }
  return table;
}

}  // namespace

class PlacedSensorsTest : public QObject {
  Q_OBJECT
 private slots:
  /// Where each sensor sits is found whether the jig was turned or not, for two sensors and for sixteen.
  void findsWhereEachSits_data() {
    QTest::addColumn<int>("n_sensors");
    QTest::addColumn<bool>("is_turned");
    QTest::newRow("two, held one way") << 2 << false;
    QTest::newRow("two, turned") << 2 << true;
    QTest::newRow("sixteen, held one way") << 16 << false;
  }
  void findsWhereEachSits() {
    QFETCH(int, n_sensors);
    QFETCH(bool, is_turned);
    const PlacedSensors placed = placedSensors(rideOnOneJig(n_sensors, is_turned).nodes, AlignMode::kRigid);
    QCOMPARE(placed.offsets_m.size(), static_cast<std::size_t>(n_sensors));
    for (const auto& [sensor, offset_m] : placed.offsets_m)
      QVERIFY2((offset_m - offsetOf_m(sensor)).norm() < 1e-6, QByteArray::number(sensor));
    QVERIFY(placed.note().find("sensor 1 61.6 mm from sensor 0") != std::string::npos || n_sensors > 2);
    // Found once, they stand at points of their own and are left there.
    QVERIFY(placedSensors(placed.nodes, AlignMode::kRigid).offsets_m.empty());
  }

  /// Known to the reference, the alignment takes no part.
  void takesAKnownAlignment() {
    CalibrationTable table = rideOnOneJig(2, true);
    for (Node& node : table.nodes) node.tracker_from_sensor = kRigFromTracker * node.tracker_from_sensor;
    const PlacedSensors placed = placedSensors(table.nodes, AlignMode::kNone);
    QVERIFY((placed.offsets_m.at(1) - offsetOf_m(1)).norm() < 1e-12);
  }

  /// Where the rig says where each sensor stands, its word holds; one sensor alone stands where it stands.
  void leavesWhatTheRigSays() {
    CalibrationTable table = rideOnOneJig(2, true);
    QVERIFY(placedSensors(rideOnOneJig(1, true).nodes, AlignMode::kRigid).offsets_m.empty());
    for (Node& node : table.nodes)
      node.reference_from_sensor.position_m = node.reference_from_sensor * offsetOf_m(node.sensor);
    const PlacedSensors placed = placedSensors(table.nodes, AlignMode::kRigid);
    QVERIFY(placed.offsets_m.empty() && placed.note().empty());
    QCOMPARE(placed.nodes.front().reference_from_sensor.position_m,
             table.nodes.front().reference_from_sensor.position_m);
  }

  /// The distance between the sensors is no error of the tracker: a comparison finds the noise, root three times 1 mm.
  void aDistanceIsNoError() {
    evaluation::ComparisonOptions options;
    options.position_methods = {parseMethodText("none").value(), parseMethodText("polynomial").value()};
    const auto comparison = evaluation::compareMethods(rideOnOneJig(2, true, 0.001), options, {});
    FT_VERIFY_OK(comparison);
    FT_VERIFY_MATCH(near(comparison->position.front().stats.rms, std::sqrt(3.0), 0.2));
    const auto fitted = Corrector::fit(rideOnOneJig(2, true, 0.001).nodes, {},
                                       parseCorrectorChoice("none", "none").value(), AlignMode::kRigid, {});
    FT_VERIFY_OK(fitted);
    FT_VERIFY_MATCH(near(fitted->report().rms_before_mm, std::sqrt(3.0), 0.2));
    QVERIFY(fitted->report().notes.front().find("sit on the jig") != std::string::npos);
  }
};

FIELDTRUE_TEST(PlacedSensorsTest)
#include "placed_sensors_test.moc"
