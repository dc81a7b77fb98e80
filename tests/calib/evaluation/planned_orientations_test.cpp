#include "calib/evaluation/orientation/planned_orientations.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <QTest>
#include <cmath>

#include "calib/core/units.h"
#include "calib/correctors/base/sensor_coils.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::evaluation;
using namespace fieldtrue::testing;

namespace {

using Turns = std::vector<Eigen::Quaterniond>;

Eigen::Quaterniond about(const Eigen::Vector3d& axis, double angle_deg) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(kRadPerDeg * angle_deg, axis.normalized()));
}

/// The 24 rotations that take a cube to itself; the first 12 are those of the tetrahedron in it.
Turns cubeTurns() {
  Turns turns{Eigen::Quaterniond::Identity()};
  for (int axis = 0; axis < 3; ++axis) turns.push_back(about(Eigen::Vector3d::Unit(axis), 180.0));
  for (int corner = 0; corner < 8; ++corner)
    turns.push_back(about(Eigen::Vector3d(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1), 120.0));
  for (int axis = 0; axis < 3; ++axis)
    for (const double angle_deg : {90.0, 270.0}) turns.push_back(about(Eigen::Vector3d::Unit(axis), angle_deg));
  for (int a = 0; a < 3; ++a)
    for (const double sign : {1.0, -1.0})
      turns.push_back(about(Eigen::Vector3d::Unit(a) + sign * Eigen::Vector3d::Unit((a + 1) % 3), 180.0));
  return turns;
}

/// A grid of 3x3x3 places 0.2 m apart from 0.3 m before the transmitter on.
/// @param turned how many of its places are visited in all turns; the others in the first alone
std::vector<PlannedPlace> grid(const Turns& turns, int turned = 27) {
  std::vector<PlannedPlace> plan;
  for (int node = 0; node < 27; ++node) {
    const int layer = node / 9;
    PlannedPlace place;
    place.node = node;
    place.index = {node % 3, node / 3 % 3, layer};
    place.reference_from_sensor.position_m =
        Eigen::Vector3d(0.3, -0.2, 0.1) + 0.2 * Eigen::Vector3d(node % 3, node / 3 % 3, layer);
    for (const Eigen::Quaterniond& q : turns) {
      place.reference_from_sensor.orientation = q;
      plan.push_back(place);
      ++place.visit;
      if (node >= turned) break;
    }
  }
  return plan;
}

}  // namespace

class PlannedOrientationsTest : public QObject {
  Q_OBJECT
 private slots:
  /// Covering radii of groups of rotations: of one rotation 180 degrees; of rotations about one axis too, for a half
  /// turn about an axis across is so far from each; of the tetrahedron's 90 (the 24-cell's 45 on the sphere of unit
  /// quaternions), of the cube's 2 acos((2 + sqrt 2) / 4) = 62.80 (Handscomb 1958, of cubic crystals).
  void nobodyIsFartherThanTheCoveringRadius_data() {
    QTest::addColumn<Turns>("turns");
    QTest::addColumn<double>("radius_deg");
    const Turns cube = cubeTurns();
    const Eigen::Vector3d corner = Eigen::Vector3d::Ones();
    QTest::newRow("one") << Turns{cube[0]} << 180.0;
    QTest::newRow("about one axis") << Turns{cube[0], about(corner, 120.0), about(corner, 240.0)} << 180.0;
    QTest::newRow("tetrahedron") << Turns(cube.begin(), cube.begin() + 12) << 90.0;
    QTest::newRow("cube") << cube << 62.8;
  }
  void nobodyIsFartherThanTheCoveringRadius() {
    QFETCH(const Turns, turns);
    QFETCH(const double, radius_deg);
    const PlannedOrientations planned = plannedOrientations(grid(turns), Pose{});
    QCOMPARE(planned.cover.n_orientations, static_cast<int>(turns.size()));
    QVERIFY2(planned.cover.farthest_deg <= radius_deg + 0.1 && planned.cover.farthest_deg > radius_deg - 4.0,
             qPrintable(QString::number(planned.cover.farthest_deg)));
  }

  /// Between visits E - R E R^T is seen: of turns about one axis the strain that is round about it commutes with all
  /// and is never seen; of half turns about x, y and z the three diagonal strains commute, less the scale two.
  void waysThatCommuteWithTheTurnsAreNotTold_data() {
    QTest::addColumn<Turns>("turns");
    QTest::addColumn<int>("told");
    const Turns cube = cubeTurns();
    const Eigen::Vector3d corner = Eigen::Vector3d::Ones();
    QTest::newRow("one orientation") << Turns{cube[0]} << 0;
    QTest::newRow("two of a third turn") << Turns{cube[0], about(corner, 120.0)} << 4;
    QTest::newRow("three about that axis") << Turns{cube[0], about(corner, 120.0), about(corner, 240.0)} << 4;
    QTest::newRow("half turns") << Turns(cube.begin(), cube.begin() + 4) << 3;
    QTest::newRow("a half turn about x") << Turns{cube[0], cube[1]} << 2;
    QTest::newRow("two axes") << Turns{cube[0], about(corner, 120.0), about(corner, 240.0),
                                       about(Eigen::Vector3d(1, 1, -1), 120.0)}
                              << 5;
  }
  void waysThatCommuteWithTheTurnsAreNotTold() {
    QFETCH(const Turns, turns);
    QFETCH(const int, told);
    const PlannedOrientations planned = plannedOrientations(grid(turns), Pose{});
    QCOMPARE(planned.coil_ways_told, told);
    QCOMPARE(planned.coil_sd.has_value(), told > 0);
  }

  /// The SD against a least-squares problem written out whole: a free shift of every place, five strains.
  void theSdIsThatOfTheWrittenOutProblem() {
    const Turns cube = cubeTurns();
    const std::vector<PlannedPlace> plan = grid({cube[0], cube[4], cube[5], cube[16]}, 9);
    const Pose tracker_from_reference{{0.1, -0.2, 0.3}, about({1, 2, 3}, 40.0)};
    constexpr double kPlacing_m = 0.001;
    const double r = std::sqrt(0.5);
    Eigen::Matrix<double, 6, 5> strains;
    strains.transpose() << r, -r, 0, 0, 0, 0, r / std::sqrt(3), r / std::sqrt(3), -std::sqrt(2.0 / 3.0), 0, 0, 0, 0, 0,
        0, r, 0, 0, 0, 0, 0, 0, r, 0, 0, 0, 0, 0, 0, r;
    Eigen::MatrixXd design = Eigen::MatrixXd::Zero(3 * static_cast<Eigen::Index>(plan.size()), 3 * 27 + 5);
    for (std::size_t i = 0; i < plan.size(); ++i) {
      const auto at = 3 * static_cast<Eigen::Index>(i);
      design.block<3, 3>(at, 3 * plan[i].node).setIdentity();
      design.block<3, 5>(at, 3 * 27) =
          correctors::coilDerivative(correctors::CoilEffect::kShift,
                                     tracker_from_reference * plan[i].reference_from_sensor) *
          strains;
    }
    const Eigen::MatrixXd covariance = (design.transpose() * design).inverse() * kPlacing_m * kPlacing_m;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance.bottomRightCorner<5, 5>());
    const double worst = std::sqrt(eigen.eigenvalues().maxCoeff());
    const PlannedOrientations planned = plannedOrientations(plan, tracker_from_reference, kPlacing_m);
    QCOMPARE(planned.coil_ways_told, 5);
    FT_VERIFY_MATCH(near(*planned.coil_sd, worst, 1e-9 * worst));
  }

  /// Only the lowest level is turned at: the top one, 0.4 m above, is advised, its corners and middle are all equal.
  void placesFarFromATurnedOneAreAdvised() {
    const Turns cube = cubeTurns();
    const PlannedOrientations planned = plannedOrientations(grid({cube[0], cube[4]}, 9), Pose{});
    QCOMPARE(planned.cover.n_places, 27);
    QCOMPARE(planned.cover.n_turned, 9);
    FT_VERIFY_MATCH(near(*planned.cover.farthest_turned_m, 0.4, 1e-12));
    QVERIFY(!planned.turn_here.empty());
    QVERIFY(std::all_of(planned.turn_here.begin(), planned.turn_here.end(), [](int node) { return node >= 18; }));
    QVERIFY(planned.text.find("pipe 3") != std::string::npos);
    const PlannedOrientations all = plannedOrientations(grid({cube[0], cube[4]}), Pose{});
    QVERIFY(all.turn_here.empty());
    FT_VERIFY_MATCH(near(*all.cover.farthest_turned_m, 0.0, 1e-12));
  }

  /// A recording of that plan stands for the same, whatever its mounting turns all orientations by.
  void aRecordingIsAskedTheSame() {
    const Turns cube = cubeTurns();
    CalibrationTable table;
    for (const PlannedPlace& stop : grid({cube[0], cube[4]}, 9)) {
      Node node;
      node.node = stop.node;
      node.visit = stop.visit;
      node.reference_from_sensor = stop.reference_from_sensor * Pose{{}, about({1, 2, 3}, 25.0)};
      table.nodes.push_back(node);
    }
    const auto cover = orientationCover(table);
    QVERIFY(cover);
    QCOMPARE(cover->n_orientations, 2);
    QCOMPARE(cover->n_places, 27);
    QCOMPARE(cover->n_turned, 9);
    FT_VERIFY_MATCH(near(cover->farthest_deg, 180.0, 4.0));
    FT_VERIFY_MATCH(near(*cover->farthest_turned_m, 0.4, 1e-12));
    FT_VERIFY_MATCH(holdsAll(cover->text, {"held in 2 ways, at 9 of 27 places", "0.40 m from a place"}));
    table.nodes[3].has_orientation = false;
    QVERIFY(!orientationCover(table));
    std::erase_if(table.nodes, [](const Node& node) { return node.visit > 0 || !node.has_orientation; });
    FT_VERIFY_MATCH(holdsAll(orientationCover(table)->text, {"in one way"}));
    QVERIFY(!orientationCover(CalibrationTable{}));
  }

  void skippedPlacesAndVisitsOfOneOrientationDoNotCount() {
    const Turns cube = cubeTurns();
    std::vector<PlannedPlace> plan = grid({cube[0], about({0, 0, 1}, 5.0), cube[4]});
    const PlannedOrientations before = plannedOrientations(plan, Pose{});
    QCOMPARE(before.cover.n_orientations, 2);
    for (PlannedPlace& place : plan)
      if (place.visit == 2) place.role = NodeRole::kSkipped;
    const PlannedOrientations skipped = plannedOrientations(plan, Pose{});
    QCOMPARE(skipped.cover.n_orientations, 1);
    QCOMPARE(skipped.cover.n_turned, 0);
    QVERIFY(skipped.text.find("One orientation") == 0);
  }
};

FIELDTRUE_TEST(PlannedOrientationsTest)
#include "planned_orientations_test.moc"
