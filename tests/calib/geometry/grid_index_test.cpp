#include "calib/geometry/grid_index.h"

#include <QtTest>
#include <algorithm>
#include <random>

#include "tests/support/test_main.h"

using namespace fieldtrue;

namespace {

/// Points of a grid with unequal spacing, node i j k at (x[i], y[j], z[k]), each off by up to 2 mm, in random order.
struct MadeGrid {
  std::vector<Eigen::Vector3d> points_m;
  std::vector<std::array<int, 3>> index;
};

MadeGrid madeGrid() {
  const std::vector<double> x_m = {-0.9, -0.6, 0.1, 0.4};
  const std::vector<double> y_m = {0.0, 0.05, 0.5};
  const std::vector<double> z_m = {1.0, 1.3048};
  std::mt19937_64 generator(3);
  std::uniform_real_distribution<double> off_m(-0.002, 0.002);
  MadeGrid grid;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 2; ++k) grid.index.push_back({i, j, k});
  std::shuffle(grid.index.begin(), grid.index.end(), generator);
  for (const auto& [i, j, k] : grid.index)
    grid.points_m.emplace_back(x_m[std::size_t(i)] + off_m(generator), y_m[std::size_t(j)] + off_m(generator),
                               z_m[std::size_t(k)] + off_m(generator));
  return grid;
}

}  // namespace

class GridIndexTest : public QObject {
  Q_OBJECT
 private slots:
  void findsTheLevelsOfAGridOfAnySpacing() {
    const MadeGrid grid = madeGrid();
    QVERIFY(gridIndex(grid.points_m) == grid.index);
  }

  void visitsOfOnePlaceShareItsIndex() {
    MadeGrid grid = madeGrid();
    grid.points_m.push_back(grid.points_m[5] + Eigen::Vector3d(0.001, -0.001, 0.0));
    grid.index.push_back(grid.index[5]);
    QVERIFY(gridIndex(grid.points_m) == grid.index);
  }

  void aGapKeepsTheIndexOfTheRest() {
    MadeGrid grid = madeGrid();
    grid.points_m.erase(grid.points_m.begin() + 7);
    grid.index.erase(grid.index.begin() + 7);
    QVERIFY(gridIndex(grid.points_m) == grid.index);
  }

  void pointsOfOnePlaneHaveNone() {
    std::vector<Eigen::Vector3d> points_m = madeGrid().points_m;
    for (Eigen::Vector3d& p_m : points_m) p_m.z() = 1.0;
    QVERIFY(!gridIndex(points_m));
  }

  void scatteredPointsHaveNone() {
    std::mt19937_64 generator(9);
    std::uniform_real_distribution<double> uniform_m(0.0, 2.0);
    std::vector<Eigen::Vector3d> points_m(60);
    for (Eigen::Vector3d& p_m : points_m)
      p_m = Eigen::Vector3d(uniform_m(generator), uniform_m(generator), uniform_m(generator));
    QVERIFY(!gridIndex(points_m));
  }

  void anEmptyTableHasNone() { QVERIFY(!gridIndex({})); }
};

FIELDTRUE_TEST(GridIndexTest)
#include "grid_index_test.moc"
