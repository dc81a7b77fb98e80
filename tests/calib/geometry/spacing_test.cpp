#include "calib/geometry/spacing.h"

#include <QTest>
#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "tests/support/test_main.h"

using namespace fieldtrue;

class SpacingTest : public QObject {
  Q_OBJECT

 private slots:
  void fewerThanTwoPointsHaveNone() {
    QCOMPARE(medianSpacing_m({}), 0.0);
    QCOMPARE(medianSpacing_m(std::vector{Eigen::Vector3d(1.0, 2.0, 3.0)}), 0.0);
  }

  void aGridHasItsPitch() {
    std::vector<Eigen::Vector3d> grid_m;
    for (int x = 0; x < 4; ++x)
      for (int y = 0; y < 3; ++y) grid_m.emplace_back(0.25 * x, 0.5 * y, 0.0);
    QCOMPARE(medianSpacing_m(grid_m), 0.25);
  }

  /// Nearest distances of 0, 1, 3, 7 and 15 m on a line: 1, 1, 2, 4, 8.
  void pointsOnALineByHand() {
    std::vector<Eigen::Vector3d> line_m;
    for (const double x_m : {0.0, 1.0, 3.0, 7.0, 15.0}) line_m.emplace_back(x_m, 0.0, 0.0);
    QCOMPARE(medianSpacing_m(line_m), 2.0);
    // Without the last one 1, 1, 2, 4: half way between the two in the middle.
    line_m.pop_back();
    QCOMPARE(medianSpacing_m(line_m), 1.5);
  }

  void coincidentPointsAreNotApart() {
    QCOMPARE(medianSpacing_m(std::vector<Eigen::Vector3d>(3, Eigen::Vector3d::Ones())), 0.0);
  }

  void spreadPlacesLeaveNoGapAndKeepNeighbours() {
    std::vector<Eigen::Vector3d> p_m;
    for (int x = 0; x < 10; ++x)
      for (int y = 0; y < 10; ++y)
        for (int z = 0; z < 10; ++z) p_m.emplace_back(0.1 * x, 0.1 * y, 0.1 * z);
    const std::vector<std::size_t> chosen = spreadPlaces(p_m, 200);
    QCOMPARE(chosen.size(), std::size_t{200});
    QVERIFY(std::adjacent_find(chosen.begin(), chosen.end(), std::greater_equal<>()) == chosen.end());
    for (const Eigen::Vector3d& place_m : p_m) {
      double nearest_m = HUGE_VAL;
      for (const std::size_t i : chosen) nearest_m = std::min(nearest_m, (p_m[i] - place_m).norm());
      QVERIFY2(nearest_m < 0.25, qPrintable(QString::number(nearest_m)));
    }
    int n_pairs = 0;
    for (const std::size_t a : chosen)
      for (const std::size_t b : chosen) n_pairs += a < b && (p_m[a] - p_m[b]).norm() < 0.101 ? 1 : 0;
    QVERIFY2(n_pairs >= 100, qPrintable(QString::number(n_pairs)));
    QCOMPARE(spreadPlaces(p_m, 5000).size(), p_m.size());
  }
};

FIELDTRUE_TEST(SpacingTest)
#include "spacing_test.moc"
