#include "calib/evaluation/region/fold_back.h"

#include <QTest>
#include <nlohmann/json.hpp>
#include <set>

#include "calib/calibration/alignment.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::evaluation;
using namespace fieldtrue::testing;

namespace {

constexpr double kPitch_m = 0.2;

/// 5 x 4 x 4 places whose tracked x is a function of the column alone, so that the determinant of a cell is the
/// difference of its two columns over the pitch.
CalibrationTable gridWithColumns(const std::array<double, 5>& x_tracked_m) {
  SyntheticOptions options;
  options.counts = {5, 4, 4};
  options.pitch_m = Eigen::Vector3d::Constant(kPitch_m);
  options.origin_m = {0.5, -0.3, 0.1};
  CalibrationTable table = syntheticTable(options);
  table.metadata.alignment_known = true;
  for (Node& node : table.nodes)
    node.tracker_from_sensor.position_m.x() = x_tracked_m[static_cast<std::size_t>((*node.index)[0])];
  return table;
}

FoldBack judged(const CalibrationTable& table, const char* method = "none") {
  const auto corrector = calibration::Corrector::fit(table.nodes, table.metadata,
                                                     calibration::parseCorrectorChoice(method, "none").value(),
                                                     calibration::defaultAlignMode(table.metadata));
  if (!corrector) qFatal("%s", corrector.error().message.c_str());
  return foldBackOf(*corrector);
}

std::vector<FoldBackCell> gridCells(const FoldBack& fold_back) {
  std::vector<FoldBackCell> cells;
  for (const FoldBackCell& cell : fold_back.cells)
    if (!cell.nodes.empty()) cells.push_back(cell);
  return cells;
}

}  // namespace

class FoldBackTest : public QObject {
  Q_OBJECT
 private slots:
  void anUndistortedGridIsOneToOne() {
    const FoldBack fold_back = judged(gridWithColumns({0.5, 0.7, 0.9, 1.1, 1.3}));
    const std::vector<FoldBackCell> cells = gridCells(fold_back);
    QCOMPARE(cells.size(), std::size_t{36});
    QCOMPARE(fold_back.n_folded, 0);
    for (const FoldBackCell& cell : cells) {
      FT_VERIFY_MATCH(near(cell.determinant, 1.0, 1e-9));
      FT_VERIFY_MATCH(near(cell.condition, 1.0, 1e-9));
      FT_VERIFY_MATCH(near(cell.size_m, kPitch_m, 1e-9));
    }
    QVERIFY(fold_back.cells.size() - cells.size() > 1000 && fold_back.cells.size() - cells.size() <= 4000);
    FT_VERIFY_MATCH(holdsAll(fold_back.text, {"does not fold back", "36 cells of the grid"}));
  }

  void stretchIsTold() {
    // The last column is read twice as far: d tracked / d true is two there, along x only.
    const FoldBack fold_back = judged(gridWithColumns({0.5, 0.7, 0.9, 1.1, 1.5}));
    std::set<int> stretched;
    for (const FoldBackCell& cell : gridCells(fold_back)) {
      const bool is_last = cell.center_m.x() > 1.15;
      FT_VERIFY_MATCH(near(cell.determinant, is_last ? 2.0 : 1.0, 1e-9));
      FT_VERIFY_MATCH(near(cell.condition, is_last ? 2.0 : 1.0, 1e-9));
    }
    FT_VERIFY_MATCH(near(fold_back.smallest_determinant.value(), 1.0, 1e-6));
    FT_VERIFY_MATCH(near(fold_back.worst_condition, 2.0, 1e-9));
  }

  void aFoldedColumnIsNamed() {
    // Readings run back between the third and the fourth column: 0.9, then 0.8. d tracked / d true = -0.1 / 0.2.
    const CalibrationTable table = gridWithColumns({0.5, 0.7, 0.9, 0.8, 1.3});
    const FoldBack fold_back = judged(table);
    const std::vector<FoldBackCell> cells = gridCells(fold_back);
    int n_folded = 0;
    for (const FoldBackCell& cell : cells) {
      const bool is_third = cell.center_m.x() > 0.95 && cell.center_m.x() < 1.05;
      QCOMPARE(cell.one_to_one, !is_third);
      n_folded += !cell.one_to_one;
      if (is_third) FT_VERIFY_MATCH(near(cell.determinant, -0.5, 1e-9));
    }
    QCOMPARE(n_folded, 9);
    QCOMPARE(fold_back.n_folded, 9);  // A method that corrects nothing does not fold.
    FT_VERIFY_MATCH(holdsAll(fold_back.text, {"folds back in 9 of 36 cells", "between "}));
    // Named worst first, by the places at the corners: places of columns 2 and 3 only.
    for (const int node : cells.front().nodes) QVERIFY(node % 5 == 2 || node % 5 == 3);
    const nlohmann::json json = nlohmann::json::parse(toJson(fold_back).dump());
    QCOMPARE(json.at("n_folded").get<int>(), 9);
    QCOMPARE(json.at("folded").size(), std::size_t{9});
    QCOMPARE(json.at("folded").at(0).at("nodes").size(), std::size_t{8});
  }

  void aColumnThatNearlyFoldsIsNamed() {
    // Between the third and the fourth column readings move by 0.02 m where the rig moves by 0.2: d tracked / d true is
    // a tenth, along x only, so the ratio of the singular values is ten.
    const CalibrationTable table = gridWithColumns({0.5, 0.7, 0.9, 0.92, 1.3});
    const FoldBack fold_back = judged(table);
    QCOMPARE(fold_back.n_folded, 0);
    QCOMPARE(fold_back.n_near_fold, 9);  // A method that corrects nothing does not come near.
    for (const FoldBackCell& cell : gridCells(fold_back)) {
      const bool is_third = cell.center_m.x() > 0.95 && cell.center_m.x() < 1.05;
      QCOMPARE(cell.is_near_fold, is_third);
      if (!is_third) continue;
      FT_VERIFY_MATCH(near(cell.determinant, 0.1, 1e-9));
      FT_VERIFY_MATCH(near(cell.condition, 10.0, 1e-9));
    }
    FT_VERIFY_MATCH(holdsAll(fold_back.text, {"comes near to it at 9 of ", "smallest determinant 0.10", "between "}));
    const nlohmann::json json = nlohmann::json::parse(toJson(fold_back).dump());
    QCOMPARE(json.at("n_near_fold").get<int>(), 9);
    QCOMPARE(json.at("near_fold").size(), std::size_t{9});
    QVERIFY(json.at("folded").empty());
  }

  void noiseAloneComesNotNear() {
    // Steps of the jig and of the readings of 0.1 m over columns of 0.2 m: a tenth says nothing.
    CalibrationTable table = gridWithColumns({0.5, 0.7, 0.9, 0.92, 1.3});
    table.metadata.jig_tolerance_m = 0.1;
    for (Node& node : table.nodes) node.covariance_m2 = Eigen::Matrix3d(0.01 * Eigen::Matrix3d::Identity());
    QCOMPARE(judged(table).n_near_fold, 0);
  }

  void whatTheJigExplainsIsNotAFold_data() {
    QTest::addColumn<double>("jig_m");
    QTest::addColumn<int>("n_folded");
    // The columns run back by 4 mm over 0.2 m.
    QTest::newRow("exact jig") << 0.0 << 9;
    QTest::newRow("0.1 mm jig") << 0.0001 << 9;
    QTest::newRow("10 mm jig") << 0.010 << 0;
  }
  void whatTheJigExplainsIsNotAFold() {
    QFETCH(double, jig_m);
    QFETCH(int, n_folded);
    CalibrationTable table = gridWithColumns({0.5, 0.7, 0.9, 0.896, 1.3});
    if (jig_m > 0.0) table.metadata.jig_tolerance_m = jig_m;
    // Readings of a fold differ by noise too, so that the jig's share is not nothing by itself.
    for (Node& node : table.nodes) node.covariance_m2 = Eigen::Matrix3d(Eigen::Matrix3d::Identity() * jig_m * jig_m);
    const FoldBack fold_back = judged(table);
    QCOMPARE(fold_back.n_folded, n_folded);
    if (n_folded == 0)
      FT_VERIFY_MATCH(holdsAll(fold_back.text, {"does not fold back", "9 cells fold by no more than jig tolerance"}));
  }

  void theFrameDoesNotMatter() {
    // Turned rig and tracker: the same cells fold.
    CalibrationTable table = gridWithColumns({0.5, 0.7, 0.9, 0.8, 1.3});
    const Pose turned{{0.3, 1.2, -0.4}, rotationFromVector({0.4, 1.1, -0.7})};
    for (Node& node : table.nodes) {
      node.tracker_from_sensor.position_m = turned * node.tracker_from_sensor.position_m;
      node.tracker_from_sensor.orientation = turned.orientation * node.tracker_from_sensor.orientation;
    }
    table.metadata.alignment_known = false;
    const FoldBack fold_back = judged(table);
    QCOMPARE(fold_back.n_folded, 9);
    FT_VERIFY_MATCH(near(gridCells(fold_back).front().determinant, -0.5, 1e-9));
  }

  void theCorrectionItselfIsJudgedBetweenThePlaces() {
    // An affine map that mirrors: readings run against the truth along x everywhere.
    const FoldBack fold_back = judged(gridWithColumns({1.3, 1.1, 0.9, 0.7, 0.5}), "affine");
    QCOMPARE(fold_back.n_folded, static_cast<int>(fold_back.cells.size()));
    FT_VERIFY_MATCH(near(fold_back.smallest_determinant.value(), -1.0, 1e-6));
  }

  void scatteredPlacesAreJudgedByTheCorrection() {
    CalibrationTable table = gridWithColumns({0.5, 0.7, 0.9, 1.1, 1.3});
    for (Node& node : table.nodes) {
      node.index.reset();
      const double shift_m = 0.05 * std::sin(7.0 * node.node);
      node.reference_from_sensor.position_m += Eigen::Vector3d(shift_m, -shift_m, 0.7 * shift_m);
    }
    const FoldBack fold_back = judged(table, "affine");
    QVERIFY(gridCells(fold_back).empty() && !fold_back.cells.empty());
    QCOMPARE(fold_back.n_folded, 0);
  }
};

FIELDTRUE_TEST(FoldBackTest)
#include "fold_back_test.moc"
