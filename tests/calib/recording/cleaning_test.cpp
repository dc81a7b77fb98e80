#include "calib/recording/cleaning.h"

#include <QTest>
#include <algorithm>
#include <limits>
#include <random>

#include "calib/recording/finding.h"
#include "calib/recording/hemisphere.h"
#include "calib/simulation/simulator.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::recording;
using namespace fieldtrue::testing;

namespace {

/// A grid in front of the transmitter, or around it when `around` is set, in a rig turned against the tracker.
SyntheticOptions grid(std::array<int, 3> counts, bool around = false) {
  SyntheticOptions options;
  options.counts = counts;
  if (around) {
    options.origin_m = Eigen::Vector3d(-0.1 * (counts[0] - 1), -0.1 * (counts[1] - 1), -0.1 * (counts[2] - 1)) +
                       Eigen::Vector3d(0.03, 0.04, 0.05);
  }
  options.reference_from_tracker = {Eigen::Vector3d(0.7, -1.2, 0.4), rotationFromVector(Eigen::Vector3d(0.4, 0.2, -2))};
  return options;
}

SyntheticNoise noise(std::uint64_t seed = 1) {
  SyntheticNoise noise;
  noise.seed = seed;
  noise.position_sd_m = 0.002;
  noise.rotation_sd_rad = 0.003;
  return noise;
}

std::vector<std::size_t> chosenRows(std::size_t rows, double fraction, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < rows; ++i) {
    if (static_cast<double>(generator() >> 11U) * 0x1p-53 < fraction) chosen.push_back(i);
  }
  return chosen;
}

void mirror(CalibrationTable& table, const std::vector<std::size_t>& rows) {
  for (const std::size_t row : rows) table.nodes[row].tracker_from_sensor.position_m *= -1.0;
}

std::vector<std::size_t> marked(const std::vector<bool>& marks) {
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    if (marks[i]) rows.push_back(i);
  }
  return rows;
}

const GapFinding* findingAbout(const Cleaned& cleaned, const std::string& fragment) {
  for (const GapFinding& finding : cleaned.findings) {
    if (finding.text.find(fragment) != std::string::npos) return &finding;
  }
  return nullptr;
}

}  // namespace

class CleaningTest : public QObject {
  Q_OBJECT

 private slots:
  void aGoodTableStaysAsItIs_data() {
    QTest::addColumn<int>("n");
    QTest::addColumn<bool>("around");
    QTest::addColumn<double>("distortion_m");
    QTest::newRow("small grid") << 4 << false << 0.0;
    QTest::newRow("bent by 10 cm") << 5 << false << 0.1;
    QTest::newRow("around the transmitter") << 5 << true << 0.02;
    QTest::newRow("4,913 places") << 17 << false << 0.2;
  }

  void aGoodTableStaysAsItIs() {
    QFETCH(int, n);
    QFETCH(bool, around);
    QFETCH(double, distortion_m);
    SyntheticOptions options = grid({n, n, n}, around);
    options.smooth_distortion_m = distortion_m;
    const CalibrationTable table = syntheticTable(options, noise());
    const Cleaned cleaned = cleanRows(table);
    QVERIFY2(cleaned.findings.empty(), cleaned.findings.empty() ? "" : cleaned.findings.front().text.c_str());
    QCOMPARE(cleaned.nodes.size(), table.nodes.size());
    for (std::size_t i = 0; i < table.nodes.size(); ++i) {
      FT_VERIFY_MATCH(sameBits(cleaned.nodes[i].tracker_from_sensor, table.nodes[i].tracker_from_sensor));
    }
  }

  void aFloorsGapOfAMetreIsNoFlip() {
    // Transmitter and sensors 1 m above a conducting floor, 1.5 to 3 m apart: errors of half a metre to more than one.
    simulation::Scene scene;
    scene.effects = {{"metal_plane", {{"toward", {0, 0, -1}}, {"distance_m", 1.0}}}};
    std::vector<PlannedPlace> plan;
    for (int i = 0; i < 7; ++i) {
      for (int j = 0; j < 7; ++j) {
        for (int k = 0; k < 2; ++k) {
          PlannedPlace place;
          place.node = static_cast<int>(plan.size());
          place.reference_from_sensor.position_m = Eigen::Vector3d(1.5 + 0.25 * i, 0.3 * (j - 3), 0.3 * k);
          plan.push_back(place);
        }
      }
    }
    const auto recorded = simulation::simulate(scene, plan, {});
    FT_VERIFY_OK(recorded);
    double largest_m = 0.0;
    for (const Node& node : recorded->table.nodes) {
      largest_m =
          std::max(largest_m, (node.tracker_from_sensor.position_m - node.reference_from_sensor.position_m).norm());
    }
    QVERIFY2(largest_m > 0.8, qPrintable(QString::number(largest_m)));
    QVERIFY(marked(mirroredRows(recorded->table.nodes)).empty());
  }

  void mirroredReadingsAreFoundAndMirroredBack_data() {
    QTest::addColumn<int>("n");
    QTest::addColumn<bool>("around");
    QTest::addColumn<double>("fraction");
    QTest::addColumn<double>("distortion_m");
    QTest::newRow("few of 64") << 4 << false << 0.05 << 0.0;
    QTest::newRow("a fifth, bent by 10 cm") << 5 << false << 0.2 << 0.1;
    QTest::newRow("two fifths") << 5 << false << 0.4 << 0.05;
    QTest::newRow("around the transmitter") << 5 << true << 0.2 << 0.02;
    QTest::newRow("two fifths of 4,913") << 17 << false << 0.4 << 0.1;
  }

  void mirroredReadingsAreFoundAndMirroredBack() {
    QFETCH(int, n);
    QFETCH(bool, around);
    QFETCH(double, fraction);
    QFETCH(double, distortion_m);
    SyntheticOptions options = grid({n, n, n}, around);
    options.smooth_distortion_m = distortion_m;
    const CalibrationTable good = syntheticTable(options, noise());
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      CalibrationTable table = good;
      const std::vector<std::size_t> rows = chosenRows(table.nodes.size(), fraction, seed);
      QVERIFY(!rows.empty());
      mirror(table, rows);
      const Cleaned cleaned = cleanRows(table);
      QCOMPARE(marked(mirroredRows(table.nodes)), rows);
      for (std::size_t i = 0; i < good.nodes.size(); ++i) {
        FT_VERIFY_MATCH(sameBits(cleaned.nodes[i].tracker_from_sensor, good.nodes[i].tracker_from_sensor));
      }
      QCOMPARE(cleaned.findings.size(), std::size_t(1));
      QCOMPARE(cleaned.findings[0].effect, std::string("hemisphere_flip"));
      QCOMPARE(cleaned.findings[0].nodes.size(), rows.size());
    }
  }

  void aHalfSpaceReportedInTheOtherHemisphereIsFound() {
    const CalibrationTable good = syntheticTable(grid({6, 5, 4}, true), noise());
    CalibrationTable table = good;
    std::vector<double> x_m;
    for (const Node& node : good.nodes) x_m.push_back(node.tracker_from_sensor.position_m.x());
    std::nth_element(x_m.begin(), x_m.begin() + 48, x_m.end());
    std::vector<std::size_t> rows;
    for (std::size_t i = 0; i < good.nodes.size(); ++i) {
      if (good.nodes[i].tracker_from_sensor.position_m.x() < x_m[48]) rows.push_back(i);
    }
    QCOMPARE(rows.size(), std::size_t(48));
    mirror(table, rows);
    QCOMPARE(marked(mirroredRows(table.nodes)), rows);
  }

  void stuckReadingsAreLeftOut() {
    CalibrationTable table = syntheticTable(grid({4, 4, 4}), noise());
    for (const std::size_t row : {std::size_t(11), std::size_t(12), std::size_t(13)}) {
      table.nodes[row].tracker_from_sensor = table.nodes[10].tracker_from_sensor;
    }
    const Cleaned cleaned = cleanRows(table);
    QCOMPARE(cleaned.nodes.size(), std::size_t(61));
    const GapFinding* finding = findingAbout(cleaned, "stands still");
    QVERIFY(finding != nullptr && finding->effect.empty());
    const std::vector<int> stuck = {table.nodes[11].node, table.nodes[12].node, table.nodes[13].node};
    QCOMPARE(finding->nodes, stuck);
  }

  void coarseReadingsOfNeighboursAreNotStuck() {
    // Places 2 mm apart under readings of whole 5 mm: equal readings are no wonder.
    SyntheticOptions options = grid({6, 6, 6});
    options.pitch_m = Eigen::Vector3d::Constant(0.002);
    SyntheticNoise rounded;
    rounded.quantum_m = 0.005;
    const Cleaned cleaned = cleanRows(syntheticTable(options, rounded));
    QVERIFY(findingAbout(cleaned, "stands still") == nullptr);
    QCOMPARE(cleaned.nodes.size(), std::size_t(216));
  }

  void copiedRowsCountOnce() {
    CalibrationTable table = syntheticTable(grid({4, 4, 4}), noise());
    Node copy = table.nodes[5];
    copy.node = 900;
    table.nodes.push_back(copy);
    const Cleaned cleaned = cleanRows(table);
    QCOMPARE(cleaned.nodes.size(), std::size_t(64));
    const GapFinding* finding = findingAbout(cleaned, "count twice");
    QVERIFY(finding != nullptr);
    QCOMPARE(finding->nodes, std::vector<int>{900});
  }

  void placesOfOnePositionAreNamedAndStay() {
    CalibrationTable table = syntheticTable(grid({4, 4, 4}), noise());
    table.nodes[9].reference_from_sensor = table.nodes[3].reference_from_sensor;
    const Cleaned cleaned = cleanRows(table);
    QCOMPARE(cleaned.nodes.size(), std::size_t(64));
    const GapFinding* finding = findingAbout(cleaned, "same true position");
    QVERIFY(finding != nullptr);
    const std::vector<int> both = {table.nodes[3].node, table.nodes[9].node};
    QCOMPARE(finding->nodes, both);
  }

  void visitsOfOnePlaceAreNoFinding() {
    SyntheticOptions options = grid({4, 4, 3});
    options.orientations = 3;
    QVERIFY(cleanRows(syntheticTable(options, noise())).findings.empty());
  }

  void rowsWithoutUseAreLeftOutAndNamed() {
    CalibrationTable table = syntheticTable(grid({4, 4, 4}), noise());
    table.nodes[1].role = NodeRole::kSkipped;
    table.nodes[2].tracker_from_sensor.position_m.y() = std::numeric_limits<double>::quiet_NaN();
    table.nodes[3].tracker_from_sensor.position_m.x() = -3.697314e28;
    const Cleaned cleaned = cleanRows(table);
    QCOMPARE(cleaned.nodes.size(), std::size_t(61));
    QVERIFY(findingAbout(cleaned, "skipped") != nullptr);
    QCOMPARE(findingAbout(cleaned, "no usable number")->nodes.size(), std::size_t(2));
  }

  void theOrderOfTheFileDoesNotCount() {
    CalibrationTable table = syntheticTable(grid({4, 4, 4}), noise());
    for (std::size_t i = 0; i < table.nodes.size(); ++i) table.nodes[i].t_start_s = 10.0 * static_cast<double>(i % 7);
    const auto numbersOf = [](const CalibrationTable& rows) {
      std::vector<int> numbers;
      for (const Node& node : cleanRows(rows).nodes) numbers.push_back(node.node);
      return numbers;
    };
    const std::vector<int> as_written = numbersOf(table);
    CalibrationTable shuffled = table;
    std::shuffle(shuffled.nodes.begin(), shuffled.nodes.end(), std::mt19937_64(3));
    QCOMPARE(numbersOf(shuffled), as_written);
    QCOMPARE(as_written[0], 0);
    QCOMPARE(as_written[1], 7);
    // Without times the numbers decide.
    for (Node& node : shuffled.nodes) node.t_start_s.reset();
    const std::vector<int> numbered = numbersOf(shuffled);
    QVERIFY(std::is_sorted(numbered.begin(), numbered.end()));
  }

  void fewRowsWithoutOrientationAreLeftOut() {
    CalibrationTable table = syntheticTable(grid({4, 4, 4}), noise());
    for (const std::size_t row : {5U, 17U}) table.nodes[row].has_orientation = false;
    const Cleaned cleaned = cleanRows(table);
    QCOMPARE(cleaned.nodes.size(), std::size_t(62));
    QCOMPARE(findingAbout(cleaned, "without an orientation")->nodes, (std::vector<int>{5, 17}));
    // Where many have none, all stay.
    for (std::size_t row = 0; row < 20; ++row) table.nodes[row].has_orientation = false;
    const Cleaned whole = cleanRows(table);
    QCOMPARE(whole.nodes.size(), std::size_t(64));
    QVERIFY(findingAbout(whole, "20 of 64 rows have no orientation") != nullptr);
    for (Node& node : table.nodes) node.has_orientation = false;
    QVERIFY(cleanRows(table).findings.empty());
  }

  void singleReadingsOnALatticeAreNamed_data() {
    QTest::addColumn<double>("quantum_m");
    QTest::addColumn<int>("n_used");
    QTest::addColumn<bool>("found");
    QTest::newRow("5 mm") << 0.005 << 1 << true;
    QTest::newRow("a tenth of an inch") << 0.00254 << 1 << true;
    QTest::newRow("10 um") << 1e-5 << 1 << false;
    QTest::newRow("means of 60") << 0.005 << 60 << false;
  }

  void singleReadingsOnALatticeAreNamed() {
    QFETCH(double, quantum_m);
    QFETCH(int, n_used);
    QFETCH(bool, found);
    SyntheticNoise rounded = noise();
    rounded.quantum_m = quantum_m;
    CalibrationTable table = syntheticTable(grid({4, 4, 4}), rounded);
    table.metadata.quantum_m.reset();
    for (Node& node : table.nodes) node.n_used = n_used;
    const Cleaned cleaned = cleanRows(table);
    QCOMPARE(cleaned.findings.size(), std::size_t(found ? 1 : 0));
    if (found) QCOMPARE(cleaned.findings[0].effect, std::string("quantization"));
  }

  void fewAndEmptyTablesAreTaken() {
    QVERIFY(cleanRows({}).nodes.empty());
    CalibrationTable table = syntheticTable(grid({2, 1, 1}), noise());
    QCOMPARE(cleanRows(table).nodes.size(), std::size_t(2));
  }
};

FIELDTRUE_TEST(CleaningTest)
#include "cleaning_test.moc"
