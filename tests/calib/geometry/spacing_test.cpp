#include "calib/geometry/spacing.h"

#include <QTest>
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
};

FIELDTRUE_TEST(SpacingTest)
#include "spacing_test.moc"
