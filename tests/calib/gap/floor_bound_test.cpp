#include <QTest>
#include <cmath>
#include <numbers>
#include <random>

#include "calib/gap/diagnosis.h"
#include "calib/recording/finding.h"
#include "tests/calib/gap/gap_fixtures.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::gap;
using namespace fieldtrue::testing;

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

/// A clean room whose table states no tolerance; every reading is then moved and turned at random (SD per axis).
CalibrationTable scattered(double moved_m, double turned_rad) {
  CalibrationTable table = recordedIn(gapScene(), gapPlan());
  table.metadata.jig_tolerance_m.reset();
  table.metadata.jig_tolerance_rad.reset();
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal;
  const auto vector = [&](double sd) {
    return Eigen::Vector3d(sd * normal(generator), sd * normal(generator), sd * normal(generator));
  };
  for (Node& node : table.nodes) {
    node.tracker_from_sensor.position_m += vector(moved_m);
    node.tracker_from_sensor.orientation =
        node.tracker_from_sensor.orientation * rotationFromVector(vector(turned_rad));
  }
  return table;
}

bool tellsOf(const GapReport& report, const std::string& words) {
  return std::any_of(report.findings.begin(), report.findings.end(), [&](const recording::GapFinding& finding) {
    return finding.text.find(words) != std::string::npos;
  });
}

constexpr const char* kHeld = "the floor is held there";

}  // namespace

/// A floor that follows whatever is left swallows a gross error: what a person with a jig does bounds it.
class FloorBoundTest : public QObject {
  Q_OBJECT
 private slots:
  void grossErrorsAreNoNoise_data() {
    QTest::addColumn<double>("moved_m");
    QTest::addColumn<double>("turned_rad");
    QTest::addColumn<QString>("unit");
    QTest::newRow("turned by 26 degrees an axis, 45 in all") << 0.0 << 26.0 * kDegree << "degrees";
    QTest::newRow("moved by 60 mm an axis") << 0.06 << 0.0 << "mm";
    QTest::newRow("both") << 0.06 << 26.0 * kDegree << "degrees";
  }
  void grossErrorsAreNoNoise() {
    QFETCH(double, moved_m);
    QFETCH(double, turned_rad);
    QFETCH(QString, unit);
    const GapReport report = diagnose(scattered(moved_m, turned_rad), nullptr, nullptr).value();
    QVERIFY2(report.verdict == GapVerdict::kUnexplained, report.text.c_str());
    QVERIFY(tellsOf(report, kHeld));
    QVERIFY(tellsOf(report, unit.toStdString() + " (SD per axis)"));
    // The bound per axis, three axes; the readings' own noise is far below it.
    if (moved_m > 0.0)
      QVERIFY(report.floor_position_mm < 1.1e3 * std::sqrt(3.0) * identify::Thresholds{}.worst_placing_m);
    if (turned_rad > 0.0) {
      QVERIFY(*report.floor_orientation_deg <
              1.1 * std::sqrt(3.0) * identify::Thresholds{}.worst_placing_rad / kDegree);
      if (moved_m == 0.0) QVERIFY2(report.text.find("degrees") != std::string::npos, report.text.c_str());
      QVERIFY(*report.orientation_rms_deg > 4.0 * *report.floor_orientation_deg);
    }
  }

  void carelessPlacingIsNoGap_data() {
    QTest::addColumn<double>("moved_m");
    QTest::addColumn<double>("turned_rad");
    QTest::newRow("1 mm, 3 mrad") << 0.0 << 0.0;
    QTest::newRow("7 mm, 3 degrees") << 0.007 << 3.0 * kDegree;
  }
  void carelessPlacingIsNoGap() {
    QFETCH(double, moved_m);
    QFETCH(double, turned_rad);
    const GapReport report = diagnose(scattered(moved_m, turned_rad), nullptr, nullptr).value();
    QVERIFY2(report.verdict == GapVerdict::kNoGap, report.text.c_str());
    QVERIFY(!tellsOf(report, kHeld));
  }

  void aStatedToleranceIsBelieved() {
    CalibrationTable table = scattered(0.06, 0.0);
    table.metadata.jig_tolerance_m = 0.06;
    table.metadata.jig_tolerance_rad = 0.003;
    const GapReport report = diagnose(table, nullptr, nullptr).value();
    QVERIFY2(report.verdict == GapVerdict::kNoGap, report.text.c_str());
    QVERIFY(!tellsOf(report, kHeld));
    QVERIFY(report.floor_position_mm > 80.0);
  }

  /// Eight positions are 24 numbers, of which the alignment takes six: no flexible fit of everything smooth is to take
  /// the others, and leave a floor of nothing from which every place stands out. Three axes of 2 mm: 3.46 mm RMS.
  void eightPlacesTellTheirNoise() {
    double square_mm2 = 0.0;
    constexpr int kDraws = 20;
    for (unsigned seed = 1; seed <= kDraws; ++seed) {
      simulation::Scene scene = gapScene();
      scene.rig.tolerance_m = 0.002;
      CalibrationTable table = recordedIn(scene, gapPlan({.counts = {2, 2, 2}}), seed);
      table.metadata.jig_tolerance_m.reset();
      for (Node& node : table.nodes) node.has_orientation = false;
      const GapReport report = diagnose(table, nullptr, nullptr).value();
      QVERIFY2(report.verdict == GapVerdict::kNoGap, report.text.c_str());
      square_mm2 += report.floor_position_mm * report.floor_position_mm / kDraws;
      const auto n_flagged =
          std::count_if(report.nodes.begin(), report.nodes.end(), [](const GapNode& node) { return node.is_flagged; });
      QVERIFY2(n_flagged <= 1, std::to_string(n_flagged).c_str());
    }
    QVERIFY2(std::abs(std::sqrt(square_mm2) / 3.46 - 1.0) < 0.2, std::to_string(square_mm2).c_str());
  }

  /// Two perfect sensors, the second mounted a quarter turn from the first, read as one.
  void twoMountingsAreNoNoise() {
    CalibrationTable table = scattered(0.0, 0.0);
    for (std::size_t i = 0; i < table.nodes.size(); i += 2) {
      Eigen::Quaterniond& q = table.nodes[i].tracker_from_sensor.orientation;
      q = q * rotationFromVector({0.0, 0.0, 90.0 * kDegree});
    }
    const GapReport report = diagnose(table, nullptr, nullptr).value();
    QVERIFY2(report.verdict == GapVerdict::kUnexplained, report.text.c_str());
    QVERIFY(tellsOf(report, kHeld));
  }
};

FIELDTRUE_TEST(FloorBoundTest)
#include "floor_bound_test.moc"
