// Delaunay tetrahedra by what defines them: no ball through four corners holds another point, and together they fill
// the hull; also when one point after the other is taken out.
#include "calib/correctors/numerics/delaunay.h"

#include <Eigen/LU>
#include <QTest>
#include <algorithm>
#include <random>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;

namespace {

using Corners = Delaunay::Corners;
using Points = std::vector<Eigen::Vector3d>;

Points randomPoints(int count, unsigned seed) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> side(0.0, 1.0);
  Points points_m;
  for (int i = 0; i < count; ++i) points_m.emplace_back(2.0 * side(generator), 1.5 * side(generator), side(generator));
  return points_m;
}

const Eigen::Vector3d& corner(const Points& points_m, const Corners& cell, std::size_t c) {
  return points_m[static_cast<std::size_t>(cell[c])];
}

double volume_m3(const Points& points_m, const std::vector<Corners>& cells) {
  double sum_m3 = 0.0;
  for (const Corners& cell : cells) {
    Eigen::Matrix3d edges_m;
    for (std::size_t c = 0; c < 3; ++c)
      edges_m.col(static_cast<Eigen::Index>(c)) = corner(points_m, cell, c) - corner(points_m, cell, 3);
    sum_m3 += std::abs(edges_m.determinant()) / 6.0;
  }
  return sum_m3;
}

/// How far the deepest point, of those that are no corner, lies in a ball: a share of the radius.
double deepestInBalls(const Points& points_m, const std::vector<Corners>& cells, int except) {
  double deepest = 0.0;
  for (const Corners& cell : cells) {
    // |x - m|^2 is the same for all four corners.
    Eigen::Matrix3d twice_edges_m;
    Eigen::Vector3d squares_m2;
    for (std::size_t c = 0; c < 3; ++c) {
      const Eigen::Vector3d edge_m = corner(points_m, cell, c) - corner(points_m, cell, 3);
      twice_edges_m.row(static_cast<Eigen::Index>(c)) = 2.0 * edge_m.transpose();
      squares_m2[static_cast<Eigen::Index>(c)] = edge_m.squaredNorm();
    }
    const Eigen::Vector3d middle_m = twice_edges_m.fullPivLu().solve(squares_m2);
    const double radius_m = middle_m.norm();
    for (int i = 0; i < static_cast<int>(points_m.size()); ++i) {
      if (i == except || std::find(cell.begin(), cell.end(), i) != cell.end()) continue;
      const double away_m = (points_m[static_cast<std::size_t>(i)] - corner(points_m, cell, 3) - middle_m).norm();
      deepest = std::max(deepest, 1.0 - away_m / radius_m);
    }
  }
  return deepest;
}

/// Rounding and the shaking of coordinates.
constexpr double kShaken = 1e-4;

}  // namespace

class DelaunayTest : public QObject {
  Q_OBJECT
 private slots:
  void ballsAreEmptyAndTheHullIsFull() {
    // Inside a tetrahedron with three right angles at the origin.
    Points points_m{{0.0, 0.0, 0.0}, {3.0, 0.0, 0.0}, {0.0, 3.0, 0.0}, {0.0, 0.0, 3.0}};
    for (const Eigen::Vector3d& p_m : randomPoints(60, 1)) points_m.emplace_back(0.5 * p_m);
    const auto delaunay = Delaunay::of(points_m, "Test");
    FT_VERIFY_OK(delaunay);
    QVERIFY(deepestInBalls(points_m, delaunay->tetrahedra(), -1) < kShaken);
    QVERIFY(std::abs(volume_m3(points_m, delaunay->tetrahedra()) - 4.5) < 1e-9);
  }

  void eachPointCanBeTakenOut() {
    for (const int count : {5, 6, 9, 20, 60}) {
      const Points points_m = randomPoints(count, 7U + static_cast<unsigned>(count));
      const auto delaunay = Delaunay::of(points_m, "Test");
      FT_VERIFY_OK(delaunay);
      for (int out = 0; out < count; ++out) {
        const auto left = delaunay->without(std::vector<std::size_t>{static_cast<std::size_t>(out)});
        QVERIFY(left.has_value());
        for (const Corners& cell : *left) QVERIFY(std::find(cell.begin(), cell.end(), out) == cell.end());
        QVERIFY(std::is_sorted(left->begin(), left->end()));
        QVERIFY(std::adjacent_find(left->begin(), left->end()) == left->end());
        QVERIFY(deepestInBalls(points_m, *left, out) < kShaken);
        Points rest_m = points_m;
        rest_m.erase(rest_m.begin() + out);
        const auto anew = Delaunay::of(rest_m, "Test");
        FT_VERIFY_OK(anew);
        const double expected_m3 = volume_m3(rest_m, anew->tetrahedra());
        QVERIFY(std::abs(volume_m3(points_m, *left) - expected_m3) < 1e-5 * expected_m3);
      }
    }
  }

  void severalPointsCanBeTakenOut() {
    const Points points_m = randomPoints(60, 3);
    const auto delaunay = Delaunay::of(points_m, "Test");
    FT_VERIFY_OK(delaunay);
    std::vector<std::size_t> out;
    Points rest_m = points_m;
    for (std::size_t point = 0; point < 60; point += 7) out.push_back(point);
    for (auto point = out.rbegin(); point != out.rend(); ++point)
      rest_m.erase(rest_m.begin() + static_cast<std::ptrdiff_t>(*point));
    const auto left = delaunay->without(out);
    QVERIFY(left.has_value());
    const auto anew = Delaunay::of(rest_m, "Test");
    FT_VERIFY_OK(anew);
    QCOMPARE(left->size(), anew->tetrahedra().size());
    const double expected_m3 = volume_m3(rest_m, anew->tetrahedra());
    QVERIFY(std::abs(volume_m3(points_m, *left) - expected_m3) < 1e-5 * expected_m3);
  }

  void aPointOfAGridCanBeTakenOut() {
    // Eight corners on one sphere everywhere: any of the many answers fills the hull.
    Points points_m;
    for (int i = 0; i < 64; ++i) points_m.emplace_back(i & 3, i >> 2 & 3, i >> 4);
    const auto delaunay = Delaunay::of(points_m, "Test");
    FT_VERIFY_OK(delaunay);
    for (int out = 0; out < 64; ++out) {
      const auto left = delaunay->without(std::vector<std::size_t>{static_cast<std::size_t>(out)});
      QVERIFY(left.has_value());
      const bool is_corner =
          out == 0 || out == 3 || out == 12 || out == 15 || out == 48 || out == 51 || out == 60 || out == 63;
      const double volume = volume_m3(points_m, *left);
      QVERIFY2(std::abs(volume - (is_corner ? 27.0 - 1.0 / 6.0 : 27.0)) < 1e-4, qPrintable(QString::number(volume)));
    }
  }

  void tooFewOrFlatPointsAreRefused() {
    const auto few = Delaunay::of(randomPoints(3, 1), "Test");
    QVERIFY(!few && few.error().code == ErrorCode::kTooFewNodes);
    const auto same = Delaunay::of(Points(6, Eigen::Vector3d(1.0, 2.0, 3.0)), "Test");
    QVERIFY(!same && same.error().code == ErrorCode::kDegenerate);
  }
};

FIELDTRUE_TEST(DelaunayTest)
#include "delaunay_test.moc"
