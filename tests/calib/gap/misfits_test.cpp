#include <QTest>
#include <algorithm>
#include <cmath>
#include <random>

#include "tests/calib/gap/diagnosis_checks.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::gap;
using namespace fieldtrue::testing;

namespace {

/// A recording by a tracker without dipoles, of which only the field itself can tell.
CalibrationTable recordedOptically() {
  CalibrationTable table = recordedIn(gapScene(), gapPlan());
  table.metadata.transmitter_model = "optical";
  return table;
}

const Eigen::Vector3d kBump_m{0.4, 0.2, 0.2};

/// Something that pushes readings away from a place, by half as much 15 cm off.
CalibrationTable recordedBesideABump(double height_m) {
  CalibrationTable table = recordedOptically();
  for (Node& node : table.nodes) {
    const double far = (node.reference_from_sensor.position_m - kBump_m).norm() / 0.15;
    node.tracker_from_sensor.position_m += height_m * std::exp2(-far * far) * Eigen::Vector3d(0.6, 0.0, 0.8);
  }
  return table;
}

}  // namespace

/// What has no name is placed at least.
class GapMisfitsTest : public QObject {
  Q_OBJECT
 private slots:
  void theWorstPlaceComesFirst() {
    CalibrationTable table = recordedOptically();
    std::vector<int> worst_first;
    for (const auto& [row, off_m] : {std::pair(50, 0.3), std::pair(20, 0.2), std::pair(70, 0.1)}) {
      Node& node = table.nodes[static_cast<std::size_t>(row)];
      node.tracker_from_sensor.position_m.y() += off_m;
      worst_first.push_back(node.node);
    }
    const auto report = diagnose(table, nullptr, nullptr);
    FT_VERIFY_OK(report);
    const std::string places = report->names.listInOrder(worst_first, 10);
    QVERIFY2(isTold(*report, "Places that do not fit the others: " + places + "."), report->text.c_str());
  }

  /// One reading of eighty 0.4 m off is no noise of the others: it is what the gap is, and leaves their floor alone.
  void aReadingFarOffIsAGap() {
    CalibrationTable table = recordedIn(gapScene(), gapPlan());
    const auto nearer = [](const Node& a, const Node& b) {
      const Eigen::Vector3d middle_m(0.4, 0.3, 0.3);
      return (a.reference_from_sensor.position_m - middle_m).norm() <
             (b.reference_from_sensor.position_m - middle_m).norm();
    };
    Node& node = *std::min_element(table.nodes.begin(), table.nodes.end(), nearer);
    node.tracker_from_sensor.position_m.z() += 0.4;
    const auto report = diagnose(table, nullptr, nullptr);
    FT_VERIFY_OK(report);
    QVERIFY2(report->verdict == GapVerdict::kUnexplained && report->selected.empty(), report->text.c_str());
    QVERIFY2(isTold(*report, "One place does not fit the others: " + report->names.of(node.node)),
             report->text.c_str());
    QCOMPARE(report->candidates.front().effect, std::string(kUnnamedScattered));
    const auto calm = diagnose(recordedIn(gapScene(), gapPlan()), nullptr, nullptr);
    QVERIFY2(report->floor_position_mm < 1.5 * calm->floor_position_mm, report->text.c_str());
    // A place inside stands for a cell of 0.2 m of a region of 0.8 x 0.6 x 0.6 m.
    const double share = 0.2 * 0.2 * 0.2 / (0.8 * 0.6 * 0.6);
    FT_VERIFY_MATCH(near(std::sqrt(report->remaining.excess2_before_mm2), 400.0 * std::sqrt(share), 4.0));
  }

  void aReadingFarOffIsToldBesideACause() {
    Withheld made = withheldFrom("compact_metal", R"({"center_m": [1.3, 0.5, 0.3], "radius_m": 0.15})");
    Node& node = made.table.nodes[7];
    node.tracker_from_sensor.position_m.z() += 0.05;
    const auto report = diagnose(made.table, nullptr, nullptr);
    FT_VERIFY_OK(report);
    FT_VERIFY_MATCH(names(*report, "compact_metal"));
    QVERIFY2(isTold(*report, "Beside what is named, one place does not fit the others: " + report->names.of(node.node)),
             report->text.c_str());
  }

  /// Tails of Student's law with four degrees of freedom throw a reading of 2400 twenty scales off.
  void heavyTailsAreNoise() {
    std::mt19937_64 generator(5);
    std::student_t_distribution<double> off(4.0);
    for (unsigned seed = 1; seed <= 10; ++seed) {
      CalibrationTable table = recordedIn(gapScene(), gapPlan({}, seed), seed);
      for (Node& node : table.nodes)
        node.tracker_from_sensor.position_m += 0.001 * Eigen::Vector3d(off(generator), off(generator), off(generator));
      const auto report = diagnose(table, nullptr, nullptr);
      FT_VERIFY_OK(report);
      QVERIFY2(report->verdict == GapVerdict::kNoGap, report->text.c_str());
    }
  }

  void somethingLocalIsPlaced_data() {
    QTest::addColumn<double>("height_m");
    QTest::newRow("a few places lie off") << 0.02;
    QTest::newRow("most places lie off") << 0.5;
  }
  void somethingLocalIsPlaced() {
    QFETCH(double, height_m);
    const auto report = diagnose(recordedBesideABump(height_m), nullptr, nullptr);
    FT_VERIFY_OK(report);
    QVERIFY(report->selected.empty() && report->hotspot);
    QVERIFY2(isTold(*report, "Something local acts within"), report->text.c_str());
    const Eigen::Vector3d in_rig_m = inverse(report->tracker_from_reference) * report->hotspot->center_m;
    QVERIFY2((in_rig_m - kBump_m).norm() < 0.1, report->text.c_str());  // Half a pitch.
  }

  /// What scatters everywhere is nowhere.
  void scatterIsNothingLocal() {
    CalibrationTable table = recordedOptically();
    std::mt19937_64 generator(4);
    std::normal_distribution<double> off_m(0.0, 0.05);
    for (Node& node : table.nodes)
      node.tracker_from_sensor.position_m += Eigen::Vector3d(off_m(generator), off_m(generator), off_m(generator));
    const auto report = diagnose(table, nullptr, nullptr);
    FT_VERIFY_OK(report);
    QVERIFY2(report->verdict == GapVerdict::kUnexplained, report->text.c_str());
    QVERIFY(isTold(*report, "places lie off, most of all"));
    QVERIFY(!isTold(*report, "Something local"));
  }
};

FIELDTRUE_TEST(GapMisfitsTest)
#include "misfits_test.moc"
