#include <QTest>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "calib/calibration/corrector.h"
#include "calib/core/units.h"
#include "calib/evaluation/comparison.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

/// A table of several sensors: one alignment, a mounting for each, one correction for all unless they err differently.
using namespace fieldtrue;
using namespace fieldtrue::evaluation;
using namespace fieldtrue::testing;

namespace {

const Eigen::Quaterniond kMount1(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, -1).normalized()));
const Eigen::Quaterniond kMount2(Eigen::AngleAxisd(-1.1, Eigen::Vector3d(0, 1, 3).normalized()));

struct TwoSensors {
  double smooth_m = 0.0;
  double gain = 0.0;         ///< What the second reads too far, as a share of the distance.
  double noise_2_m = 0.0;    ///< Placing error of the second, SD an axis.
  bool side_by_side = true;  ///< 10 cm apart, else both at the same place.
};

/// What a tracker reads of a true pose in its own frame.
Pose reading(const SyntheticOptions& options, const Pose& truth, const Eigen::Quaterniond& mount, double gain) {
  Pose tracked = syntheticReading(options, truth);
  tracked.position_m *= 1.0 + gain;
  tracked.orientation = truth.orientation * mount.conjugate();
  return tracked;
}

CalibrationTable twoSensors(const TwoSensors& how) {
  SyntheticOptions options;
  options.smooth_distortion_m = how.smooth_m;
  CalibrationTable table = syntheticTable(options);
  std::mt19937 random(5);
  std::normal_distribution<double> placing_m(0.0, how.noise_2_m);
  std::vector<Node> second = table.nodes;
  for (std::size_t i = 0; i < table.nodes.size(); ++i) {
    Node& one = table.nodes[i];
    Node& other = second[i];
    one.sensor = 1;
    other.sensor = 2;
    if (how.side_by_side) other.reference_from_sensor.position_m.y() += 0.1;
    // Turned from place to place, so that orientations tell something.
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.1 * static_cast<double>(i % 7), Eigen::Vector3d::UnitX()));
    one.reference_from_sensor.orientation = other.reference_from_sensor.orientation = turn;
    one.tracker_from_sensor = reading(options, one.reference_from_sensor, kMount1, 0.0);
    other.tracker_from_sensor = reading(options, other.reference_from_sensor, kMount2, how.gain);
    if (how.noise_2_m > 0.0)
      for (double& coordinate : other.reference_from_sensor.position_m) coordinate += placing_m(random);
  }
  table.nodes.insert(table.nodes.end(), second.begin(), second.end());
  return table;
}

Comparison compared(const CalibrationTable& table, const char* method) {
  ComparisonOptions options;
  options.position_methods = {parseMethodText(method).value()};
  options.orientation_methods = {{"none", {}}};
  options.validation = Validation{ValidationKind::kFolds, 10};
  const auto comparison = compareMethods(table, options);
  if (!comparison) qFatal("%s", comparison.error().message.c_str());
  return *comparison;
}

}  // namespace

class SensorsTest : public QObject {
  Q_OBJECT
 private slots:
  void eachHasItsMounting() {
    const CalibrationTable table = twoSensors({});
    const auto corrector = calibration::Corrector::fit(table.nodes, table.metadata, calibration::CorrectorChoice(),
                                                       calibration::AlignMode::kRigid);
    FT_VERIFY_OK(corrector);
    FT_VERIFY_MATCH(near(corrector->alignment().mountOf(1), kMount1, 1e-9));
    FT_VERIFY_MATCH(near(corrector->alignment().mountOf(2), kMount2, 1e-9));
    const auto again = calibration::Corrector::fromText(corrector->toText(), "again");
    FT_VERIFY_OK(again);
    QCOMPARE(again->toText(), corrector->toText());
    std::vector<Pose> tracked, one_by_one, together(table.nodes.size());
    std::vector<std::optional<int>> sensors;
    for (const Node& node : table.nodes) {
      tracked.push_back(node.tracker_from_sensor);
      sensors.emplace_back(node.sensor);
      one_by_one.push_back(again->correct(node.tracker_from_sensor, node.sensor));
      FT_VERIFY_MATCH(near(one_by_one.back().orientation, node.reference_from_sensor.orientation, 1e-9));
      FT_VERIFY_MATCH(near(one_by_one.back().position_m, node.reference_from_sensor.position_m, 1e-9));
    }
    again->correct(tracked, together, sensors);
    for (std::size_t i = 0; i < together.size(); ++i) FT_VERIFY_MATCH(sameBits(together[i], one_by_one[i]));
  }

  void oneSensorIsAsBefore() {
    CalibrationTable table = twoSensors({});
    std::erase_if(table.nodes, [](const Node& node) { return node.sensor != 2; });
    const auto corrector = calibration::Corrector::fit(table.nodes, table.metadata, calibration::CorrectorChoice(),
                                                       calibration::AlignMode::kRigid);
    FT_VERIFY_OK(corrector);
    QVERIFY(corrector->alignment().mounts.empty());
    QVERIFY(corrector->toText().find("mounts_wxyz") == std::string::npos);
    const Comparison comparison = compared(table, "polynomial:degree=1");
    QVERIFY(comparison.before_sensors.empty() && comparison.position.front().sensors.empty() && !comparison.split);
  }

  void errorsAreToldBySensor() {
    // The first is read exactly, the second stands 2 mm off an axis: 3.46 mm RMS.
    const Comparison comparison = compared(twoSensors({.noise_2_m = 0.002}), "polynomial:degree=1");
    QCOMPARE(comparison.places.size(), std::size_t{100});
    const auto& sensors = comparison.position.front().sensors;
    QCOMPARE(sensors.size(), std::size_t{2});
    QCOMPARE(sensors[0].sensor, 1);
    QCOMPARE(sensors[1].sensor, 2);
    QVERIFY(sensors[0].stats.rms < 0.6);
    FT_VERIFY_MATCH(near(sensors[1].stats.rms, 2.0 * std::sqrt(3.0), 0.5));
    // A place's error is the RMS over its rows, of both sensors.
    for (std::size_t k = 0; k < comparison.places.size(); ++k) {
      const double both = std::hypot(sensors[0].place_errors[k], sensors[1].place_errors[k]) / std::sqrt(2.0);
      FT_VERIFY_MATCH(near(comparison.position.front().place_errors[k], both, 1e-12));
    }
    QCOMPARE(toJson(comparison).at("sensors").size(), std::size_t{2});
  }

  void sensorsThatErrAlikeShare_data() {
    QTest::addColumn<bool>("side_by_side");
    QTest::newRow("side by side") << true;
    QTest::newRow("in one place") << false;
  }
  void sensorsThatErrAlikeShare() {
    QFETCH(bool, side_by_side);
    const Comparison comparison = compared(
        twoSensors({.smooth_m = 0.02, .noise_2_m = 0.001, .side_by_side = side_by_side}), "polynomial:degree=3");
    QVERIFY(comparison.split.has_value());
    QVERIFY2(!comparison.split->is_better, comparison.split->text.c_str());
    FT_VERIFY_MATCH(holdsAll(comparison.split->text, {"share one correction"}));
  }

  void sensorsThatErrDifferentlyAreToldApart() {
    // A gain of 2 % is up to 2 cm of the second's reading, and none of the first's.
    const Comparison comparison =
        compared(twoSensors({.smooth_m = 0.02, .gain = 0.02, .noise_2_m = 0.001}), "polynomial:degree=3");
    QVERIFY(comparison.split.has_value());
    QVERIFY2(comparison.split->is_better, comparison.split->text.c_str());
    QVERIFY(comparison.split->separate_mm < 0.5 * comparison.split->shared_mm);
    FT_VERIFY_MATCH(holdsAll(comparison.split->text, {"err differently", "--sensor N"}));
  }

  void gridMethodsTakeSensorsSideBySide() {
    // One index, two positions: the index tells nothing, and the places are scattered.
    const Comparison comparison = compared(twoSensors({.smooth_m = 0.02}), "trilinear");
    const MethodScore& score = comparison.position.front();
    QVERIFY2(!score.skipped || score.skipped->find("one place for each grid index") == std::string::npos,
             score.skipped.value_or("").c_str());
  }
};

FIELDTRUE_TEST(SensorsTest)
#include "sensors_test.moc"
