#include "calib/evaluation/region/coverage.h"

#include <QTest>
#include <nlohmann/json.hpp>

#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::evaluation;
using namespace fieldtrue::testing;

namespace {

/// 7 x 7 x 7 places 0.2 m apart, from the origin.
CalibrationTable fullGrid() {
  SyntheticOptions options;
  options.counts = {7, 7, 7};
  options.origin_m = Eigen::Vector3d::Zero();
  return syntheticTable(options);
}

bool isInBlock(const Node& node) {
  return std::all_of(node.index->begin(), node.index->end(), [](int i) { return i >= 2 && i <= 4; });
}

}  // namespace

class CoverageTest : public QObject {
  Q_OBJECT
 private slots:
  void aFullGridHasNoHole() {
    const Coverage coverage = coverageOf(fullGrid());
    QCOMPARE(coverage.n_places, 343);
    FT_VERIFY_MATCH(near(coverage.spacing_m, 0.2, 1e-12));
    FT_VERIFY_MATCH(near(coverage.volume_m3, 1.2 * 1.2 * 1.2, 1e-9));
    FT_VERIFY_MATCH(near(coverage.high_m, Eigen::Vector3d(1.2, 1.2, 1.2), 1e-12));
    // The middle of a cell is half a diagonal from its corners.
    FT_VERIFY_MATCH(near(coverage.largest_gap_m, 0.1 * std::sqrt(3.0), 1e-4));
    QVERIFY(coverage.holes.empty() && coverage.missing.empty());
    FT_VERIFY_MATCH(holdsAll(coverage.text, {"343 places span 1.20 x 1.20 x 1.20 m, 0.20 m apart", "no hole"}));
  }

  void aMissingBlockIsAHoleOfKnownRadius() {
    // 3 x 3 x 3 places left out around the middle: the nearest ones left stand 0.4 m from it, along the axes.
    CalibrationTable table = fullGrid();
    std::erase_if(table.nodes, isInBlock);
    const Coverage coverage = coverageOf(table);
    QCOMPARE(coverage.holes.size(), std::size_t{1});
    FT_VERIFY_MATCH(near(coverage.holes.front().radius_m, 0.4, 1e-4));
    FT_VERIFY_MATCH(near(coverage.holes.front().center_m, Eigen::Vector3d(0.6, 0.6, 0.6), 1e-3));
    FT_VERIFY_MATCH(near(coverage.largest_gap_m, 0.4, 1e-4));
    FT_VERIFY_MATCH(holdsAll(coverage.text, {"1 hole", "0.40 m", "(0.60, 0.60, 0.60) m"}));
  }

  void skippedPlacesAreMissing() {
    CalibrationTable table = fullGrid();
    std::vector<int> skipped;
    for (Node& node : table.nodes)
      if (isInBlock(node)) {
        node.role = NodeRole::kSkipped;
        skipped.push_back(node.node);
      }
    // Skipped on one visit and recorded on another is not missing.
    Node again = table.nodes.front();
    again.role = NodeRole::kSkipped;
    again.visit = 1;
    table.nodes.push_back(again);
    const Coverage coverage = coverageOf(table);
    QCOMPARE(coverage.missing, skipped);
    QCOMPARE(coverage.n_places, 343 - 27);
    QCOMPARE(coverage.holes.size(), std::size_t{1});
    FT_VERIFY_MATCH(holdsAll(coverage.text, {"planned but skipped: ", ", pipe ", " and 21 more"}));
  }

  void aGridOfUnequalPitchHasNoHole() {
    SyntheticOptions options;
    options.counts = {5, 5, 4};
    options.pitch_m = {0.2, 0.2, 0.7};
    const Coverage coverage = coverageOf(syntheticTable(options));
    QVERIFY(coverage.holes.empty());
    FT_VERIFY_MATCH(near(coverage.largest_gap_m, 0.5 * std::sqrt(0.04 + 0.04 + 0.49), 1e-3));
  }

  void extrapolationDistanceIsThatToTheHull() {
    const Coverage coverage = coverageOf(fullGrid());
    FT_VERIFY_MATCH(near(coverage.region.outside_m({0.6, 0.6, 1.5}), 0.3, 1e-12));
    FT_VERIFY_MATCH(near(coverage.region.outside_m({0.6, 0.6, 0.6}), -0.6, 1e-12));
  }

  void volumeOfATetrahedron() {
    SyntheticOptions options;
    options.counts = {2, 2, 2};
    CalibrationTable table = syntheticTable(options);
    table.nodes.resize(4);
    table.nodes[0].reference_from_sensor.position_m = {0.0, 0.0, 0.0};
    table.nodes[1].reference_from_sensor.position_m = {0.6, 0.0, 0.0};
    table.nodes[2].reference_from_sensor.position_m = {0.0, 0.5, 0.0};
    table.nodes[3].reference_from_sensor.position_m = {0.1, 0.1, 0.4};
    for (Node& node : table.nodes) node.index.reset();
    FT_VERIFY_MATCH(near(coverageOf(table).volume_m3, 0.6 * 0.5 * 0.4 / 6.0, 1e-12));
  }

  void placesInOnePlane() {
    SyntheticOptions options;
    options.counts = {6, 5, 1};
    CalibrationTable table = syntheticTable(options);
    const Coverage full = coverageOf(table);
    FT_VERIFY_MATCH(near(full.largest_gap_m, 0.1 * std::sqrt(2.0), 1e-4));
    QVERIFY(full.holes.empty() && full.volume_m3 == 0.0);
    FT_VERIFY_MATCH(holdsAll(full.text, {"30 places in one plane"}));
    // 2 x 1 neighbouring places left out: the circle's middle is between them, the nearest places left 0.1 and 0.2 m
    // away from it along the axes.
    std::erase_if(table.nodes, [](const Node& node) {
      return (*node.index)[1] == 2 && ((*node.index)[0] == 2 || (*node.index)[0] == 3);
    });
    const Coverage holed = coverageOf(table);
    QCOMPARE(holed.holes.size(), std::size_t{1});
    FT_VERIFY_MATCH(near(holed.holes.front().radius_m, std::hypot(0.1, 0.2), 1e-3));
  }

  void fewPlacesEncloseNothing() {
    CalibrationTable table = fullGrid();
    table.nodes.resize(7);  // One row along x.
    const Coverage line = coverageOf(table);
    QVERIFY(line.region.empty() && line.holes.empty() && line.volume_m3 == 0.0);
    FT_VERIFY_MATCH(holdsAll(line.text, {"enclose no region"}));
    QCOMPARE(coverageOf({}).n_places, 0);
    QVERIFY(!toJson(coverageOf({})).dump().empty());
  }

  void jsonHoldsIt() {
    CalibrationTable table = fullGrid();
    std::erase_if(table.nodes, isInBlock);
    const nlohmann::json json = nlohmann::json::parse(toJson(coverageOf(table)).dump());
    QCOMPARE(json.at("places").get<int>(), 316);
    QCOMPARE(json.at("holes").size(), std::size_t{1});
    for (const char* key : {"low_m", "high_m", "volume_m3", "spacing_m", "largest_gap_m", "missing", "region", "text"})
      QVERIFY2(json.contains(key), key);
  }
};

FIELDTRUE_TEST(CoverageTest)
#include "coverage_test.moc"
