#include "calib/gap/where.h"

#include <QTest>
#include <algorithm>
#include <cmath>
#include <string>

#include "calib/simulation/scene.h"
#include "tests/calib/gap/gap_fixtures.h"
#include "tests/calib/identify/noisy_rows.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::gap;
using namespace fieldtrue::testing;

namespace {

GapReport whereIn(const identify::GapRows& rows) {
  const identify::GapSearch search(rows, {});
  GapReport report;
  describeWhere(search, search.none().model, report);
  return report;
}

double rmsOf(const GapReport& report, const std::string& channel) {
  for (const GapChannel& one : report.channels)
    if (one.name == channel) return one.rms;
  return std::nan("");
}

}  // namespace

class GapWhereTest : public QObject {
  Q_OBJECT
 private slots:
  /// Where every row is noise, every flag is false, and a draw with any is a false discovery: at most 5 % of the draws,
  /// with a margin of 2.33 binomial SDs.
  void flagsNothingInNoise_data() {
    QTest::addColumn<int>("turns");
    QTest::newRow("one orientation") << 1;
    QTest::newRow("two orientations") << 2;
  }
  void flagsNothingInNoise() {
    QFETCH(int, turns);
    constexpr int kDraws = 200;
    int n_false = 0;
    for (unsigned seed = 1; seed <= kDraws; ++seed) {
      const GapReport report = whereIn(noisyRows({.per_axis = turns == 1 ? 4 : 3, .turns = turns, .change = {}}, seed));
      const auto is_flagged = [](const GapNode& node) { return node.is_flagged; };
      if (std::any_of(report.nodes.begin(), report.nodes.end(), is_flagged)) ++n_false;
      QCOMPARE(report.hotspot.has_value(), std::any_of(report.nodes.begin(), report.nodes.end(), is_flagged));
    }
    const double most = 0.05 + 2.33 * std::sqrt(0.05 * 0.95 / kDraws);
    QVERIFY2(n_false <= most * kDraws, qPrintable(QString::number(n_false)));
  }

  /// Twenty readings that follow one another know their scatter badly, and far off the scatter is most of the noise.
  void flagsNothingInMeansOfFewReadings() {
    const auto scene = simulation::readScene(FIELDTRUE_RESOURCES "/rooms/clean.scene.json");
    FT_VERIFY_OK(scene);
    const CalibrationTable table = recordedIn(*scene, gapPlan({.counts = {9, 9, 7}, .pitch_m = 0.3048}));
    const GapReport report = whereIn(identify::makeGapRows(table.nodes, table.metadata).value());
    const auto n_flagged =
        std::count_if(report.nodes.begin(), report.nodes.end(), [](const GapNode& node) { return node.is_flagged; });
    QVERIFY2(n_flagged <= 1, std::to_string(n_flagged).c_str());
  }

  /// One place 15 noise SDs off, of 64.
  void flagsAPlantedOffset_data() {
    QTest::addColumn<int>("node");
    for (const int node : {0, 21, 42, 63}) QTest::addRow("node %d", node) << node;
  }
  void flagsAPlantedOffset() {
    QFETCH(int, node);
    std::vector<Node> nodes = noisyNodes({.change = {}}, 9);
    nodes[static_cast<std::size_t>(node)].tracker_from_sensor.position_m += Eigen::Vector3d(0.02, 0.02, -0.01);
    const GapReport report = whereIn(identify::makeGapRows(nodes, {}).value());
    for (const GapNode& one : report.nodes)
      if (one.node == node) QVERIFY(one.is_flagged && one.excess > 5.0);
    QVERIFY(report.hotspot.has_value());
    const Eigen::Vector3d place_m = nodes[static_cast<std::size_t>(node)].reference_from_sensor.position_m;
    FT_VERIFY_MATCH(near(report.hotspot->center_m, place_m, 0.5 * kCubePitch_m));
    QVERIFY(report.hotspot->radius_m < kCubePitch_m);
  }

  /// A gap of 4 cm at one corner that fades over 0.2 m: the hot spot lies there.
  void putsTheHotSpotWhereTheGapIs() {
    std::vector<Node> nodes = noisyNodes({.per_axis = 5, .change = {}}, 4);
    const Eigen::Vector3d corner_m = nodes.back().reference_from_sensor.position_m;
    for (Node& node : nodes) {
      const double away = (node.reference_from_sensor.position_m - corner_m).norm() / 0.2;
      node.tracker_from_sensor.position_m += 0.04 * std::exp(-away * away) * Eigen::Vector3d(0.6, 0.0, 0.8);
    }
    const GapReport report = whereIn(identify::makeGapRows(nodes, {}).value());
    QVERIFY(report.hotspot.has_value());
    FT_VERIFY_MATCH(near(report.hotspot->center_m, corner_m, 0.2));
    // exp(-(r / 0.2)^2) is a half at 0.2 sqrt(ln 2) = 0.17 m from the corner; the middle lies up to a pitch within.
    QVERIFY(report.hotspot->sd_m && *report.hotspot->sd_m > 0.005 && *report.hotspot->sd_m < kCubePitch_m);
    QVERIFY(report.hotspot->half_m && std::abs(*report.hotspot->half_m - 0.17) < kCubePitch_m);
  }

  /// How far the middle is off from draw to draw of noise and places is what is stated of it.
  void statesHowFarTheHotSpotMayLieOff() {
    std::vector<Eigen::Vector3d> centers_m;
    double stated_m2 = 0.0;
    for (unsigned seed = 1; seed <= 60; ++seed) {
      std::vector<PlannedPlace> plan = gapPlan({.counts = {5, 5, 5}, .pitch_m = 0.15, .is_scattered = true}, seed);
      CalibrationTable table = recordedIn(gapScene(), plan, seed);
      for (Node& node : table.nodes) {
        const Eigen::Vector3d p_m = node.reference_from_sensor.position_m;
        const double away = (p_m - Eigen::Vector3d(0.3, 0.3, 0.3)).norm() / 0.15;
        node.tracker_from_sensor.position_m += 0.05 * std::exp(-away * away) * Eigen::Vector3d(0.6, 0.0, 0.8);
      }
      const GapReport report = whereIn(identify::makeGapRows(table.nodes, table.metadata).value());
      if (!report.hotspot || !report.hotspot->sd_m) continue;  // No place was drawn near enough.
      centers_m.push_back(report.hotspot->center_m);
      stated_m2 += *report.hotspot->sd_m * *report.hotspot->sd_m;
    }
    const auto n = static_cast<double>(centers_m.size());
    QVERIFY2(n >= 45, std::to_string(n).c_str());
    Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& center_m : centers_m) middle_m += center_m / n;
    double off_m2 = 0.0;
    for (const Eigen::Vector3d& center_m : centers_m) off_m2 += (center_m - middle_m).squaredNorm() * n / (n - 1.0);
    const double ratio = std::sqrt(stated_m2 / off_m2);
    QVERIFY2(ratio > 0.7 && ratio < 1.8, std::to_string(ratio).c_str());
  }

  /// Splitting a vector into components keeps its length, and bins share the rows out.
  void channelsAndBinsAddUp() {
    const GapReport report = whereIn(noisyRows({.change = {}}, 2));
    const double axes_mm2 =
        std::pow(rmsOf(report, "x"), 2) + std::pow(rmsOf(report, "y"), 2) + std::pow(rmsOf(report, "z"), 2);
    const double parts_mm2 = std::pow(rmsOf(report, "radial"), 2) + 2.0 * std::pow(rmsOf(report, "transverse"), 2);
    FT_VERIFY_MATCH(near(axes_mm2, std::pow(report.position_rms_mm, 2), 1e-9));
    FT_VERIFY_MATCH(near(parts_mm2, std::pow(report.position_rms_mm, 2), 1e-9));
    QCOMPARE(report.by_layer.size(), std::size_t{4});
    double layers_mm2 = 0.0;
    for (const GapBin& layer : report.by_layer) layers_mm2 += layer.rms_mm * layer.rms_mm / 4.0;
    FT_VERIFY_MATCH(near(layers_mm2, std::pow(report.position_rms_mm, 2), 1e-9));
    for (const auto& bins : {report.by_range, report.by_time}) {
      QVERIFY(!bins.empty());
      for (std::size_t b = 1; b < bins.size(); ++b) QVERIFY(bins[b].low >= bins[b - 1].high);
    }
  }
};

FIELDTRUE_TEST(GapWhereTest)
#include "where_test.moc"
