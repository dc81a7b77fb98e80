#include "acquisition/sampling/rig_fit.h"

#include <QDir>
#include <QTest>

#include "acquisition/plan/plan.h"
#include "calib/simulation/simulator.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;

namespace {

constexpr double kPitch_m = 0.3;
constexpr double kRightlyMarked_m = 0.25;
const Pose kReferenceFromTracker{{-0.4, 0.3, 0.2}, rotationFromVector({0.1, -0.2, 0.4})};

Plan planOf(std::array<int, 3> counts) {
  Plan plan;
  plan.counts = counts;
  plan.pitch_m = Eigen::Vector3d::Constant(kPitch_m);
  return plan;
}

/// Takes whose reading is the true position, bent away from the transmitter by a field that grows as the fourth power
/// of the distance.
std::vector<Node> bentTakes(const std::vector<PlannedPlace>& places, double worst_m) {
  double farthest_m = 0.0;
  std::vector<Eigen::Vector3d> true_m;
  for (const PlannedPlace& place : places) {
    true_m.push_back(inverse(kReferenceFromTracker) * place.reference_from_sensor.position_m);
    farthest_m = std::max(farthest_m, true_m.back().norm());
  }
  std::vector<Node> nodes;
  for (std::size_t i = 0; i < places.size(); ++i) {
    Node node;
    node.node = places[i].node;
    node.reference_from_sensor = places[i].reference_from_sensor;
    const double share = std::pow(true_m[i].norm() / farthest_m, 4);
    node.tracker_from_sensor.position_m = true_m[i] + worst_m * share * Eigen::Vector3d(0.6, 0.0, -0.8);
    nodes.push_back(node);
  }
  return nodes;
}

}  // namespace

class RigFitTest : public QObject {
  Q_OBJECT

 private slots:
  void tellsTheRelationInSpiteOfAWrongTake_data() {
    QTest::addColumn<int>("count");
    QTest::addColumn<int>("wrong");
    for (const int count : {6, 7, 9, 18, 36})
      for (const int wrong : {1, count / 2, count - 1})
        QTest::addRow("%d takes, number %d", count, wrong) << count << wrong;
  }
  void tellsTheRelationInSpiteOfAWrongTake() {
    QFETCH(int, count);
    QFETCH(int, wrong);
    // By rows of two, so that no single take holds the turn about a line.
    const auto all = places(planOf({2, 3, 6}));
    auto takes = bentTakes({all.begin(), all.begin() + count}, 0.0);
    Eigen::Vector3d& p_m = takes[static_cast<std::size_t>(wrong)].tracker_from_sensor.position_m;
    p_m += Eigen::Vector3d(0.36, 0.0, 0.48);  // 0.6 m
    const RigFit fit(takes, kPitch_m);
    QVERIFY(fit.usable());
    FT_VERIFY_MATCH(testing::near(fit.reference_from_tracker(), kReferenceFromTracker, 1e-9, 1e-9));
    const auto misfits = fit.misfits();
    QCOMPARE(misfits.size(), std::size_t{1});
    QCOMPARE(misfits[0].take, static_cast<std::size_t>(wrong));
    QVERIFY(std::abs(misfits[0].off_m - 0.6) < 1e-9);
  }

  void fourTakesOfWhichOneIsWrongSayNothing() {
    auto takes = bentTakes(places(planOf({2, 2, 1})), 0.0);
    QVERIFY(RigFit(takes, kPitch_m).usable());
    takes[2].tracker_from_sensor.position_m.z() += 0.6;
    const RigFit fit(takes, kPitch_m);
    QVERIFY(!fit.usable());
    QVERIFY(fit.misfits().empty());
  }

  void takesOnALineSayNothing() { QVERIFY(!RigFit(bentTakes(places(planOf({6, 1, 1})), 0.0), kPitch_m).usable()); }

  /// The operator goes from place to place of a field bent by up to 0.3 m: no good take is refused or marked, and a
  /// sensor 0.6 m from its place is, wherever that is, once the relation is known.
  void aBentFieldIsNoMisfit_data() {
    QTest::addColumn<double>("worst_m");
    for (const double worst_m : {0.0, 0.1, 0.2, 0.3}) QTest::addRow("%g m", worst_m) << worst_m;
  }
  void aBentFieldIsNoMisfit() {
    QFETCH(double, worst_m);
    walk(bentTakes(places(planOf({5, 5, 4})), worst_m), 0.95);
  }

  void simulatedRoomsAreNoMisfit_data() {
    QTest::addColumn<QString>("path");
    for (const char* folder : {"/rooms", "/scenes"}) {
      const QDir scenes(QStringLiteral(FIELDTRUE_RESOURCES) + QString::fromLatin1(folder));
      for (const QString& name : scenes.entryList({"*.scene.json"}))
        // The example's tracker now and then reports the far side of the transmitter: that is a misfit.
        if (name != "example.scene.json")
          QTest::newRow(qPrintable(scenes.filePath(name).section('/', -2))) << scenes.filePath(name);
    }
  }
  void simulatedRoomsAreNoMisfit() {
    QFETCH(QString, path);
    const auto scene = simulation::readScene(path.toStdString());
    QVERIFY(scene.has_value());
    const auto recorded = simulation::simulate(*scene, places(planOf({5, 5, 4})), {});
    QVERIFY2(recorded.has_value(), recorded ? "" : recorded.error().message.c_str());
    walk(recorded->table.nodes, 0.9);
  }

 private:
  /// @param found share of the wrong stands that must be found
  static void walk(const std::vector<Node>& takes, double found) {
    int n_wrong = 0, n_found = 0;
    for (std::size_t n = 4; n < takes.size(); ++n) {
      const std::vector<Node> done(takes.begin(), takes.begin() + static_cast<std::ptrdiff_t>(n));
      const RigFit fit(done, kPitch_m);
      if (!fit.usable()) continue;
      // Where a room throws a reading a quarter of a metre off its neighbours, it is rightly to be looked at.
      for (const RigFit::Misfit& misfit : fit.misfits())
        QVERIFY2(misfit.off_m > kRightlyMarked_m,
                 qPrintable(QString("take %1 of %2 is good, and %3 m off").arg(misfit.take).arg(n).arg(misfit.off_m)));
      const Eigen::Vector3d& there_m = takes[n].reference_from_sensor.position_m;
      const Eigen::Vector3d& tracked_m = takes[n].tracker_from_sensor.position_m;
      const double off_m = fit.off_m(tracked_m, there_m);
      QVERIFY2(off_m <= fit.limit_m(there_m) || off_m > kRightlyMarked_m,
               qPrintable(QString("after %1: %2 m").arg(n).arg(off_m)));
      for (const Eigen::Vector3d& away : {Eigen::Vector3d(0.0, 0.36, 0.48), Eigen::Vector3d(0.6, 0.0, 0.0),
                                          Eigen::Vector3d(0.0, 0.0, -0.6), Eigen::Vector3d(-0.48, 0.36, 0.0)}) {
        ++n_wrong;
        n_found += fit.off_m(tracked_m + away, there_m) > fit.limit_m(there_m);
      }
    }
    QVERIFY2(n_found >= found * n_wrong, qPrintable(QString("%1 of %2 found").arg(n_found).arg(n_wrong)));
  }
};

FIELDTRUE_TEST(RigFitTest)
#include "rig_fit_test.moc"
