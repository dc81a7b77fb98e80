#include "calib/correctors/cells/hexahedral_cells.h"

#include <QTest>
#include <set>

#include "tests/calib/correctors/cell_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

FitData shakenData(const std::array<int, 3>& counts, double shake_m = 0.03) {
  return fitDataOf(shakenGrid(counts, 0.2, shake_m), bending_m);
}

PlaceGrid gridOf(const FitData& data) { return placeGrid(data, "This test", "that").value(); }

}  // namespace

class HexahedralCellsTest : public QObject {
  Q_OBJECT
 private slots:
  void everyWholeCellIsThere() {
    const PlaceGrid grid = gridOf(shakenData({4, 3, 5}));
    QCOMPARE(grid.cells.size(), std::size_t{3 * 2 * 4});
    QCOMPARE(grid.n_boxes, 0);
    QVERIFY(gridNote(grid).empty());
    for (const GridCell& cell : grid.cells) {
      const auto at = [&](std::size_t c) { return grid.places.index[static_cast<std::size_t>(cell.corners[c])]; };
      for (std::size_t c = 0; c < 8; ++c)
        for (std::size_t axis = 0; axis < 3; ++axis)
          QCOMPARE(at(c)[axis], at(0)[axis] + static_cast<int>((c >> axis) & 1U));
    }
  }

  void levelsThatNobodyHasDoNotCount() {
    FitData data = shakenData({3, 3, 3});
    for (std::array<int, 3>& index : data.index) index = {2 * index[0] + 1, 3 * index[1], -index[2]};
    QCOMPARE(gridOf(data).cells.size(), std::size_t{8});
  }

  /// Cells around a place that is missing, and where it stood.
  void boxesStandInAroundAMissingPlace_data() {
    QTest::addColumn<int>("i");
    QTest::addColumn<int>("j");
    QTest::addColumn<int>("k");
    QTest::addColumn<int>("cells_lost");
    QTest::addColumn<bool>("surrounded");
    QTest::newRow("inside") << 2 << 1 << 2 << 8 << true;
    QTest::newRow("face") << 2 << 0 << 2 << 4 << true;
    QTest::newRow("edge") << 0 << 0 << 2 << 2 << true;
    QTest::newRow("corner") << 4 << 0 << 4 << 1 << false;
  }
  void boxesStandInAroundAMissingPlace() {
    QFETCH(int, i);
    QFETCH(int, j);
    QFETCH(int, k);
    QFETCH(int, cells_lost);
    QFETCH(bool, surrounded);
    const FitData whole = shakenData({5, 4, 5});
    const std::size_t row = rowAt(whole, {i, j, k});
    const PlaceGrid grid = gridOf(without(whole, row));
    QCOMPARE(static_cast<int>(grid.cells.size()) - grid.n_boxes, 4 * 3 * 4 - cells_lost);
    // A box of two steps covers two of the lost cells.
    QCOMPARE(grid.n_boxes, surrounded ? cells_lost / 2 : 0);
    QCOMPARE(grid.n_empty, surrounded ? 0 : 1);
    FT_VERIFY_MATCH(holdsAll(gridNote(grid), {surrounded ? "missing places" : "uncovered"}));
    QCOMPARE(HexahedralCells::of(grid).locate(whole.p_tracked_m[row]).has_value(), surrounded);
  }

  void aPlaceWithTwoMissingNeighboursStillHasABox() {
    // Three in a row are missing: along the row no box of two steps has all corners, across it every one has.
    const FitData whole = shakenData({5, 5, 5});
    FitData data = whole;
    for (const int i : {1, 2, 3}) data = without(data, rowAt(data, {i, 2, 2}));
    const HexahedralCells cells = HexahedralCells::of(gridOf(data));
    for (const int i : {1, 2, 3}) QVERIFY(cells.locate(whole.p_tracked_m[rowAt(whole, {i, 2, 2})]).has_value());
  }

  void rowsThatShareAnIndexAreAveragedOrRefused() {
    FitData data = shakenData({3, 3, 3});
    FitData visited = data;
    visited.p_tracked_m.push_back(data.p_tracked_m[4] + Eigen::Vector3d(0.002, 0.0, 0.0));
    visited.p_true_m.push_back(data.p_true_m[4] + Eigen::Vector3d(0.0, 0.006, 0.0));
    visited.node.push_back(99);
    visited.index.push_back(data.index[4]);
    const PlaceGrid grid = gridOf(visited);
    QCOMPARE(grid.places.size(), std::size_t{27});
    FT_VERIFY_MATCH(near(grid.places.p_tracked_m[4], data.p_tracked_m[4] + Eigen::Vector3d(0.001, 0.0, 0.0), 1e-12));
    FT_VERIFY_MATCH(near(grid.places.p_true_m[4], data.p_true_m[4] + Eigen::Vector3d(0.0, 0.003, 0.0), 1e-12));
    QCOMPARE(grid.places.rows[4], (std::vector<std::size_t>{4, 27}));

    data.index[5] = data.index[4];
    const auto refused = placeGrid(data, "This test", "that");
    QVERIFY(!refused && refused.error().code == ErrorCode::kUnsupported);
    FT_VERIFY_MATCH(holdsAll(refused.error().message, {"A2, pipe 2 (number 4)", "(number 5)", "2 cm"}));
  }

  void whatIsNoGridIsRefusedWithWhatWorks() {
    FitData scattered = shakenData({3, 3, 3});
    scattered.index.clear();
    const auto no_index = placeGrid(scattered, "This test", "tetrahedral");
    QVERIFY(!no_index && no_index.error().code == ErrorCode::kUnsupported);
    FT_VERIFY_MATCH(holdsAll(no_index.error().message, {"This test", "grid", "27", "tetrahedral works"}));

    FitData plane = shakenData({3, 3, 3});
    plane.dimension = 2;
    const auto flat = placeGrid(plane, "This test", "that");
    QVERIFY(!flat && flat.error().code == ErrorCode::kDegenerate);
    FT_VERIFY_MATCH(holdsAll(flat.error().message, {"volume", "plane", "polynomial"}));

    FitData few = shakenData({2, 2, 2});
    const auto no_cell = placeGrid(without(few, 3), "This test", "that");
    QVERIFY(!no_cell && no_cell.error().code == ErrorCode::kTooFewNodes);
    FT_VERIFY_MATCH(holdsAll(no_cell.error().message, {"8 corners", "7 places", "2 x 2 x 2"}));
  }

  void anIndexFarTooLargeIsRefused() {
    FitData data = shakenData({3, 3, 3});
    for (std::size_t i = 0; i < data.size(); ++i) {
      const auto level = static_cast<int>(i);
      data.index[i] = {level, level, level};
    }
    const auto grid = placeGrid(data, "This test", "that");
    QVERIFY(!grid && grid.error().code == ErrorCode::kTooFewNodes);
  }

  void naturalCoordinatesAreFoundAgain() {
    const HexahedralCells cells = HexahedralCells::of(gridOf(shakenData({5, 4, 4}, 0.05)));
    std::mt19937_64 generator(3);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    for (std::size_t cell = 0; cell < cells.size(); ++cell)
      for (int n = 0; n < 50; ++n) {
        const Eigen::Vector3d natural(uniform(generator), uniform(generator), uniform(generator));
        const auto at = cells.locate(cells.position_m({cell, natural}));
        QVERIFY(at.has_value());
        QCOMPARE(at->cell, cell);
        FT_VERIFY_MATCH(near(at->natural, natural, 1e-9));
      }
  }

  void aShearedCellByHand() {
    // Corners of a parallelepiped: natural coordinates are those of its edges.
    const Eigen::Vector3d low_m(1.0, -2.0, 0.5);
    Eigen::Matrix3d edges_m;
    edges_m << 0.3, 0.1, 0.0, 0.0, 0.2, 0.05, 0.02, 0.0, 0.25;
    std::vector<Eigen::Vector3d> corners_m = cube(1.0);
    for (Eigen::Vector3d& corner_m : corners_m) corner_m = Eigen::Vector3d(low_m + edges_m * corner_m);
    const HexahedralCells cells(corners_m, {{0, 1, 2, 3, 4, 5, 6, 7}});
    const auto at = cells.locate(low_m + edges_m * Eigen::Vector3d(0.2, 0.7, 0.4));
    QVERIFY(at.has_value());
    FT_VERIFY_MATCH(near(at->natural, {0.2, 0.7, 0.4}, 1e-12));
    FT_VERIFY_MATCH(near(cells.tangent_m(*at), edges_m, 1e-12));
  }

  void aQuarterOfACellOutsideStillCounts_data() {
    QTest::addColumn<double>("x");
    QTest::addColumn<double>("y");
    QTest::addColumn<double>("z");
    QTest::newRow("low face") << -1.0 << 0.0 << 0.0;
    QTest::newRow("high face") << 0.0 << 1.0 << 0.0;
    QTest::newRow("edge") << 1.0 << 0.0 << -1.0;
    QTest::newRow("corner") << -1.0 << 1.0 << 1.0;
  }
  void aQuarterOfACellOutsideStillCounts() {
    QFETCH(double, x);
    QFETCH(double, y);
    QFETCH(double, z);
    // 3 x 3 x 3 places at 0.2 m around the origin; a quarter of a cell is 0.05 m.
    std::vector<Eigen::Vector3d> corners_m = shakenGrid({3, 3, 3}, 0.2, 0.0);
    for (Eigen::Vector3d& corner_m : corners_m) corner_m -= Eigen::Vector3d(0.6, -0.1, 0.0);
    const HexahedralCells cells = HexahedralCells::of(gridOf(fitDataOf(corners_m, bending_m)));
    const Eigen::Vector3d outwards(x, y, z);
    const Eigen::Vector3d within =
        Eigen::Vector3d(0.07, -0.07, 0.07).cwiseProduct(Eigen::Vector3d::Ones() - outwards.cwiseAbs());
    const auto covered = cells.locate(within + 0.249 * outwards);
    QVERIFY(covered.has_value());
    FT_VERIFY_MATCH(near(cells.position_m(*covered), within + 0.249 * outwards, 1e-12));
    QVERIFY(!cells.locate(within + 0.251 * outwards).has_value());
  }

  void outsideTheNearestCellHasIt() {
    // Off the high x face, over the lower cell in y and z: neighbours are as far off in x, and to a side as well.
    const PlaceGrid grid = gridOf(fitDataOf(shakenGrid({3, 3, 3}, 0.2, 0.0), bending_m));
    const HexahedralCells cells = HexahedralCells::of(grid);
    std::mt19937_64 generator(4);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    for (int n = 0; n < 500; ++n) {
      const Eigen::Vector3d natural(1.0 + 0.24 * uniform(generator), uniform(generator), uniform(generator));
      const auto at = cells.locate(Eigen::Vector3d(0.6, -0.3, -0.2) + 0.2 * natural);
      QVERIFY(at.has_value());
      FT_VERIFY_MATCH(near(at->natural, natural, 1e-9));
    }
  }

  void sharedFacesEdgesAndCornersBelongToTheLowestCell() {
    const PlaceGrid grid = gridOf(shakenData({3, 3, 3}));
    const HexahedralCells cells = HexahedralCells::of(grid);
    for (std::size_t i = 0; i < grid.places.size(); ++i) {
      std::size_t lowest = cells.size();
      for (std::size_t cell = cells.size(); cell-- > 0;)
        for (const int corner : cells.corners(cell))
          if (corner == static_cast<int>(i)) lowest = cell;
      const auto at = cells.locate(grid.places.p_tracked_m[i]);
      QVERIFY(at.has_value());
      QCOMPARE(at->cell, lowest);
    }
    for (const SharedFace& face : sharedFaces(cells)) {
      Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();
      for (const int corner : face.corners)
        middle_m += 0.25 * grid.places.p_tracked_m[static_cast<std::size_t>(corner)];
      QCOMPARE(cells.locate(middle_m)->cell, std::min(face.first_cell, face.second_cell));
    }
    // 2 x 2 x 2 cells have 4 shared faces across each of three planes.
    QCOMPARE(sharedFaces(cells).size(), std::size_t{12});
  }

  void noPositionIsLostBetweenCells() {
    // Where a place is missing, faces do not meet: positions between them belong to the nearest cell.
    const FitData whole = shakenData({5, 5, 5}, 0.04);
    const HexahedralCells cells = HexahedralCells::of(gridOf(without(whole, rowAt(whole, {2, 2, 2}))));
    std::mt19937_64 generator(9);
    std::uniform_real_distribution<double> uniform(0.1, 0.7);
    for (int n = 0; n < 20000; ++n) {
      const Eigen::Vector3d p_m(0.4 + uniform(generator), -0.3 + uniform(generator), -0.2 + uniform(generator));
      QVERIFY(cells.locate(p_m).has_value());
    }
  }

  void positionsThatAreNoNumbersAreNowhere() {
    const HexahedralCells cells = HexahedralCells::of(gridOf(shakenData({3, 3, 3})));
    QVERIFY(!cells.locate({std::nan(""), 0.0, 0.0}).has_value());
    QVERIFY(!cells.locate({HUGE_VAL, 0.0, 0.0}).has_value());
  }

  void cellsThatFoldBackAreNamed() {
    FitData data = shakenData({4, 4, 4}, 0.0);
    QVERIFY(foldNote(HexahedralCells::of(gridOf(data)), gridOf(data).places).empty());
    // The reading of one place lies beyond that of its neighbour.
    const std::size_t row = rowAt(data, {1, 1, 1});
    data.p_tracked_m[row].x() += 0.3;
    const PlaceGrid grid = gridOf(data);
    const std::string note = foldNote(HexahedralCells::of(grid), grid.places);
    FT_VERIFY_MATCH(holdsAll(note, {"folds back", "near "}));
  }
};

FIELDTRUE_TEST(HexahedralCellsTest)
#include "hexahedral_cells_test.moc"
