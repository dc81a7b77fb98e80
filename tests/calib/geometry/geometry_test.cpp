#include "calib/geometry/geometry.h"

#include <QTest>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "calib/core/json_reader.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

using Points = std::vector<Eigen::Vector3d>;

Points grid(int nx, int ny, int nz, double pitch_m) {
  Points points;
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) points.emplace_back(i * pitch_m, j * pitch_m, k * pitch_m);
    }
  }
  return points;
}

Points moved(const Points& points, const Pose& to_from_from) {
  Points result;
  for (const Eigen::Vector3d& point : points) result.push_back(to_from_from * point);
  return result;
}

double squaredError(const Points& from, const Points& to, const Pose& pose) {
  double sum = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i) sum += (pose * from[i] - to[i]).squaredNorm();
  return sum;
}

const Pose kPose{{0.3, -1.2, 2.5}, rotationFromVector({0.4, -1.9, 0.8})};

}  // namespace

class GeometryTest : public QObject {
  Q_OBJECT

 private slots:
  void rigidRecoversPose_data() {
    QTest::addColumn<int>("layers");
    QTest::newRow("volume") << 3;
    QTest::newRow("one plane") << 1;
  }
  void rigidRecoversPose() {
    QFETCH(int, layers);
    const Points from = grid(4, 3, layers, 0.2);
    const auto pose = fitRigid(from, moved(from, kPose));
    FT_VERIFY_OK(pose);
    FT_VERIFY_MATCH(near(*pose, kPose, 1e-14, 1e-14));
    QVERIFY(pose->orientation.w() >= 0.0);
  }

  void rigidNeedsOnlyThreePoints() {
    const Points from{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const auto pose = fitRigid(from, moved(from, kPose));
    FT_VERIFY_OK(pose);
    FT_VERIFY_MATCH(near(*pose, kPose, 1e-14, 1e-14));
  }

  // A mirror image cannot be reached by a rotation: the fit must still be proper, and no small turn may be better.
  void rigidIsProperAndOptimal() {
    const Points from = grid(3, 3, 3, 0.1);
    Points mirrored = from;
    for (Eigen::Vector3d& point : mirrored) point.x() = -point.x() + 0.01 * std::sin(50.0 * point.y());
    const auto pose = fitRigid(from, mirrored);
    FT_VERIFY_OK(pose);
    FT_VERIFY_MATCH(near(pose->orientation.toRotationMatrix().determinant(), 1.0, 1e-12));
    const double best = squaredError(from, mirrored, *pose);
    for (int axis = 0; axis < 3; ++axis) {
      for (const double step : {-1e-3, 1e-3}) {
        Pose turned = *pose;
        const Eigen::Vector3d& center = from[13];
        turned.orientation = rotationFromVector(step * Eigen::Vector3d::Unit(axis)) * pose->orientation;
        turned.position_m = *pose * center - turned.orientation * center;
        QVERIFY(squaredError(from, mirrored, turned) > best);
        Pose shifted = *pose;
        shifted.position_m[axis] += step;
        QVERIFY(squaredError(from, mirrored, shifted) > best);
      }
    }
  }

  void rigidRefuses_data() {
    QTest::addColumn<int>("kind");
    QTest::addColumn<int>("code");
    QTest::addColumn<QByteArray>("says");
    QTest::newRow("two points") << 0 << int(ErrorCode::kTooFewNodes)
                                << QByteArray("needs 3 points not on one line, got 2");
    QTest::newRow("a line") << 1 << int(ErrorCode::kDegenerate) << QByteArray("got 5 points on one line");
    QTest::newRow("one place") << 2 << int(ErrorCode::kDegenerate) << QByteArray("on one line");
    QTest::newRow("nan") << 3 << int(ErrorCode::kBadInput) << QByteArray("finite");
    QTest::newRow("none") << 4 << int(ErrorCode::kTooFewNodes) << QByteArray("got 0");
  }
  void rigidRefuses() {
    QFETCH(int, kind);
    QFETCH(int, code);
    QFETCH(QByteArray, says);
    const Points from =
        std::vector<Points>{{{0, 0, 0}, {1, 0, 0}},
                            {{0.1, 0.2, 0.3}, {0.2, 0.4, 0.6}, {0.3, 0.6, 0.9}, {0.7, 1.4, 2.1}, {-0.1, -0.2, -0.3}},
                            {{1, 2, 3}, {1, 2, 3}, {1, 2, 3}},
                            {{0, 0, 0}, {1, 0, 0}, {0, std::nan(""), 0}},
                            {}}[static_cast<std::size_t>(kind)];
    const auto pose = fitRigid(from, from);
    QVERIFY(!pose);
    QCOMPARE(int(pose.error().code), code);
    FT_VERIFY_MATCH(holdsAll(pose.error().message, {says}));
  }

  void spread() {
    // Variances of the corners of a box are the squares of its half edges.
    const Points box{{4, 2, 1},  {4, 2, -1},  {4, -2, 1},  {4, -2, -1},
                     {-4, 2, 1}, {-4, 2, -1}, {-4, -2, 1}, {-4, -2, -1}};
    const PointSpread spread = pointSpread(moved(box, kPose));
    FT_VERIFY_MATCH(near(spread.center_m, kPose.position_m, 1e-14));
    FT_VERIFY_MATCH(near(spread.sd_m, Eigen::Vector3d(4, 2, 1), 1e-13));
    QCOMPARE(spread.dimension, 3);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d expected = kPose.orientation * Eigen::Vector3d::Unit(axis);
      FT_VERIFY_MATCH(near(std::abs(spread.axes.col(axis).dot(expected)), 1.0, 1e-13));
    }
    FT_VERIFY_MATCH(near(spread.axes.determinant(), 1.0, 1e-13));
  }

  void dimension_data() {
    QTest::addColumn<double>("thickness");
    QTest::addColumn<double>("width");
    QTest::addColumn<int>("dimension");
    QTest::newRow("volume") << 0.02 << 1.0 << 3;
    QTest::newRow("plane with noise") << 0.005 << 1.0 << 2;
    QTest::newRow("exact plane") << 0.0 << 1.0 << 2;
    QTest::newRow("line") << 0.0 << 0.0 << 1;
  }
  void dimension() {
    QFETCH(double, thickness);
    QFETCH(double, width);
    QFETCH(int, dimension);
    Points points;
    for (const double x : {-1.0, 1.0}) {
      for (const double y : {-width, width}) {
        for (const double z : {-thickness, thickness}) points.push_back(kPose * Eigen::Vector3d(x, y, z));
      }
    }
    QCOMPARE(pointSpread(points).dimension, dimension);
  }
  void dimensionOfOnePoint() {
    QCOMPARE(pointSpread(Points{{0.1, 0.2, 0.3}}).dimension, 0);
    QCOMPARE(pointSpread(Points{{0.1, 0.2, 0.3}, {0.1, 0.2, 0.3}, {0.1, 0.2, 0.3}}).dimension, 0);
    QCOMPARE(pointSpread(Points{}).dimension, 0);
  }

  void regionOfABox() {
    const Region region = Region::around(grid(5, 5, 4, 0.25), 3, 0.01);
    // Edges 1 m, 1 m, 0.75 m: from the middle of the top the nearest face is at 0, the others at -0.5.
    FT_VERIFY_MATCH(near(region.outside_m({0.5, 0.5, 0.75}), 0.0, 1e-12));
    FT_VERIFY_MATCH(near(region.outside_m({0.5, 0.5, 0.375}), -0.375, 1e-12));
    FT_VERIFY_MATCH(near(region.outside_m({1.2, 0.5, 0.3}), 0.2, 1e-12));
    QVERIFY(region.contains({1.009, 0.5, 0.3}));
    QVERIFY(!region.contains({1.011, 0.5, 0.3}));
    QVERIFY(!region.contains({0.5, 0.5, std::nan("")}));
    QCOMPARE(region.toJson()["half_spaces_nx_ny_nz_d_m"].size(), std::size_t{6});
  }

  void regionHoldsItsPointsAndNothingElse() {
    std::mt19937 engine(7);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    Points points;
    while (points.size() < 400) {
      const Eigen::Vector3d p(uniform(engine), uniform(engine), uniform(engine));
      if (p.norm() < 1.0) points.push_back(Eigen::Vector3d(100.0, 0.0, 0.0) + 0.5 * p);
    }
    const Region region = Region::around(points, 3, 0.0);
    for (const Eigen::Vector3d& point : points) QVERIFY(region.contains(point));
    for (int i = 0; i < 200; ++i) {
      Eigen::Vector3d direction(uniform(engine), uniform(engine), uniform(engine));
      direction.normalize();
      const Eigen::Vector3d outside = Eigen::Vector3d(100.0, 0.0, 0.0) + 0.501 * direction;
      QVERIFY(!region.contains(outside));
      const Eigen::Vector3d midpoint =
          0.5 * (points[static_cast<std::size_t>(i)] + points[static_cast<std::size_t>(399 - i)]);
      QVERIFY(region.contains(midpoint));
    }
  }

  void planarRegionIsASlab() {
    const Points flat = moved(grid(3, 3, 1, 0.5), kPose);
    const Region region = Region::around(flat, 2, 0.02);
    QVERIFY(region.contains(kPose * Eigen::Vector3d(0.5, 0.5, 0.019)));
    QVERIFY(!region.contains(kPose * Eigen::Vector3d(0.5, 0.5, 0.021)));
    QVERIFY(region.contains(kPose * Eigen::Vector3d(1.019, 0.5, 0.0)));
    QVERIFY(!region.contains(kPose * Eigen::Vector3d(1.021, 0.5, 0.0)));
    for (const Eigen::Vector3d& point : flat) QVERIFY(region.contains(point));
    QCOMPARE(region.toJson()["half_spaces_nx_ny_nz_d_m"].size(), std::size_t{6});
  }

  void planarRegionFollowsTheHull() {
    // A triangle: the corner of its bounding square is outside.
    const Points triangle{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.2, 0.2, 0}, {0.5, 0.5, 0}};
    const Region region = Region::around(triangle, 2, 0.0);
    QVERIFY(region.contains({0.25, 0.25, 0.0}));
    FT_VERIFY_MATCH(near(region.outside_m({1.0, 1.0, 0.0}), std::sqrt(0.5), 1e-12));
  }

  void emptyRegions() {
    QVERIFY(Region().empty() && !Region().contains({0, 0, 0}));
    QVERIFY(Region::around(grid(4, 1, 1, 1.0), 1, 0.1).empty());
    QVERIFY(Region::around(Points{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, 2, 0.1).empty());
    QVERIFY(std::isinf(Region().outside_m({0, 0, 0})));
  }

  // The caller says volume, the points are flat, repeated or nearly so: Qhull gives up, the points stay inside.
  void survivesQhullFailure_data() {
    QTest::addColumn<double>("thickness");
    QTest::newRow("exactly flat") << 0.0;
    QTest::newRow("flat to rounding") << 1e-16;
    QTest::newRow("nearly flat") << 1e-9;
  }
  void survivesQhullFailure() {
    QFETCH(double, thickness);
    Points points = grid(4, 4, 1, 0.1);
    for (std::size_t i = 0; i < points.size(); ++i) points[i].z() = thickness * static_cast<double>(i % 3);
    const Region region = Region::around(points, 3, 0.001);
    QVERIFY(!region.empty());
    for (const Eigen::Vector3d& point : points) QVERIFY(region.contains(point));
    QVERIFY(!region.contains({0.15, 0.15, 0.01}));
    QVERIFY(!region.contains({0.5, 0.5, 0.0}));
  }

  void regionSurvivesJson() {
    const Region region = Region::around(moved(grid(3, 4, 3, 0.3), kPose), 3, 0.015);
    const auto back = readJson<Region>(nlohmann::json::parse(region.toJson().dump()), "region", Region::fromJson);
    FT_VERIFY_OK(back);
    FT_VERIFY_MATCH(sameBits(back->margin_m(), region.margin_m()));
    for (const double x : {-0.3, 0.1, 2.0}) {
      FT_VERIFY_MATCH(sameBits(back->outside_m({x, 0.2, 0.1}), region.outside_m({x, 0.2, 0.1})));
    }
  }

  void regionRefusesJson_data() {
    QTest::addColumn<QByteArray>("text");
    QTest::newRow("not an object") << QByteArray("[]");
    QTest::newRow("no margin") << QByteArray(R"({"half_spaces_nx_ny_nz_d_m": []})");
    QTest::newRow("negative margin") << QByteArray(R"({"half_spaces_nx_ny_nz_d_m": [], "margin_m": -1})");
    QTest::newRow("three numbers") << QByteArray(R"({"half_spaces_nx_ny_nz_d_m": [[1,0,0]], "margin_m": 0})");
    QTest::newRow("not unit") << QByteArray(R"({"half_spaces_nx_ny_nz_d_m": [[2,0,0,1]], "margin_m": 0})");
    QTest::newRow("text") << QByteArray(R"({"half_spaces_nx_ny_nz_d_m": [["1",0,0,1]], "margin_m": 0})");
  }
  void regionRefusesJson() {
    QFETCH(QByteArray, text);
    const auto region = readJson<Region>(nlohmann::json::parse(text.toStdString()), "region", Region::fromJson);
    QVERIFY(!region);
    QVERIFY(region.error().code == ErrorCode::kBadInput);
  }
};

FIELDTRUE_TEST(GeometryTest)
#include "geometry_test.moc"
