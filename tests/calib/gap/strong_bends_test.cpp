#include <QTest>
#include <cmath>

#include "calib/core/units.h"
#include "calib/gap/diagnosis.h"
#include "tests/calib/gap/gap_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::gap;
using namespace fieldtrue::testing;

namespace {

/// A rig placed within 5 mm, its frame 0.6 m before the transmitter; one plane straight below the transmitter.
simulation::Scene overFloor(double distance_m, const char* material, double strength) {
  simulation::Scene scene;
  scene.reference_from_tracker.position_m = {-0.6, 1.2192, 0.9144};
  scene.rig.tolerance_m = 0.005;
  scene.effects.push_back(
      {"metal_plane",
       {{"toward", {0.0, 0.0, -1.0}}, {"distance_m", distance_m}, {"material", material}, {"strength", strength}}});
  return scene;
}

std::vector<PlannedPlace> movedBy(const Eigen::Vector3d& origin_m, const GapPlan& options) {
  std::vector<PlannedPlace> plan = gapPlan(options);
  for (PlannedPlace& place : plan) place.reference_from_sensor.position_m += origin_m;
  return plan;
}

}  // namespace

Q_DECLARE_METATYPE(fieldtrue::testing::GapPlan)
Q_DECLARE_METATYPE(Eigen::Vector3d)

/// Readings bent by more than a decimetre draw the rig's alignment with them; what bends them is found all the same.
class StrongBendsTest : public QObject {
  Q_OBJECT
 private slots:
  void aFloorIsFound_data() {
    QTest::addColumn<double>("distance_m");
    QTest::addColumn<QByteArray>("material");
    QTest::addColumn<double>("strength");
    QTest::addColumn<GapPlan>("places");
    QTest::addColumn<Eigen::Vector3d>("origin_m");
    QTest::addColumn<bool>("is_timed");
    GapPlan fine;
    fine.counts = {5, 5, 4};
    fine.pitch_m = 0.3;
    const Eigen::Vector3d low_m(0.45, -0.6, -0.45);
    QTest::newRow("conducting, the lowest places 14 cm above it")
        << 1.5 << QByteArray("conductive") << 0.6 << fine << low_m << true;
    QTest::newRow("ferromagnetic, the lowest places 44 cm above it")
        << 1.8 << QByteArray("ferromagnetic") << 1.0 << fine << low_m << true;
    GapPlan scattered;
    scattered.counts = {3, 5, 4};
    scattered.pitch_m = 0.6;
    scattered.is_scattered = true;
    QTest::newRow("conducting, scattered places")
        << 1.5 << QByteArray("conductive") << 0.6 << scattered << Eigen::Vector3d(0.0, 0.0, -0.1) << true;
    // What a smooth field leaves of places so far apart counts as noise at first, and the bend is only five times that.
    GapPlan coarse = fine;
    coarse.pitch_m = 0.6096;
    QTest::newRow("conducting, a coarse grid")
        << 1.5 << QByteArray("conductive") << 0.6 << coarse << Eigen::Vector3d(0.0, 0.0, 0.0) << true;
    QTest::newRow("conducting, a coarse grid without times")
        << 1.5 << QByteArray("conductive") << 0.6 << coarse << Eigen::Vector3d(0.0, 0.0, 0.0) << false;
  }
  void aFloorIsFound() {
    QFETCH(double, distance_m);
    QFETCH(QByteArray, material);
    QFETCH(double, strength);
    QFETCH(GapPlan, places);
    QFETCH(Eigen::Vector3d, origin_m);
    QFETCH(bool, is_timed);
    const simulation::Scene scene = overFloor(distance_m, material.constData(), strength);
    CalibrationTable table = recordedIn(scene, movedBy(origin_m, places));
    if (!is_timed)
      for (Node& node : table.nodes) node.t_start_s = node.t_end_s = std::nullopt;
    const auto report = diagnose(table, nullptr, nullptr);
    FT_VERIFY_OK(report);
    QVERIFY2(report->position_rms_mm > 120.0, qPrintable(QString::number(report->position_rms_mm)));
    QVERIFY2(report->verdict == GapVerdict::kExplained, report->text.c_str());
    const SelectedEffect& floor = report->selected.front();
    QCOMPARE(floor.effect, std::string("metal_plane"));
    QCOMPARE(floor.material.value_or(""), material.toStdString());
    QVERIFY(std::abs(floor.location_m->norm() - distance_m) < 0.1);
    const double leaning_rad = std::acos(-floor.location_m->normalized().z());
    QVERIFY2(leaning_rad < 5.0 / kDegPerRad, qPrintable(QString::number(leaning_rad * kDegPerRad)));
    QVERIFY2(report->remaining.fraction < 0.02, qPrintable(QString::number(report->remaining.fraction)));
  }

  /// A loop at a corner of the grid bends a few places by decimetres, and a scan of small changes takes it for a small
  /// body: what is left is told by folds that search the loop all the same (0.11 and 0.04 by those that did not).
  void everyFoldFindsALoopAtACorner_data() {
    using Vector = std::vector<double>;
    QTest::addColumn<Vector>("center_m");
    QTest::addColumn<Vector>("normal");
    QTest::addColumn<double>("radius_m");
    QTest::newRow("lying") << Vector{1.268, -0.5385, 0.312} << Vector{0.9262, 0.4113, 1.5621} << 0.353;
    QTest::newRow("standing") << Vector{1.5506, -0.3134, 0.5144} << Vector{0.3077, 0.3996, -0.0188} << 0.3851;
  }
  void everyFoldFindsALoopAtACorner() {
    QFETCH(std::vector<double>, center_m);
    QFETCH(std::vector<double>, normal);
    QFETCH(double, radius_m);
    simulation::Scene scene = gapScene();
    scene.reference_from_tracker.orientation = Eigen::Quaterniond(0.99443, 0.0249, -0.0149, 0.0997).normalized();
    scene.effects.push_back(
        {"closed_loop", {{"center_m", center_m}, {"normal", normal}, {"radius_m", radius_m}, {"strength", 0.6}}});
    GapPlan in_order;
    in_order.in_random_order = false;
    const auto report = diagnose(recordedIn(scene, movedBy({0.3, -0.3, -0.3}, in_order)), nullptr, nullptr);
    FT_VERIFY_OK(report);
    QVERIFY2(report->position_rms_mm > 10.0, qPrintable(QString::number(report->position_rms_mm)));
    QCOMPARE(report->selected.front().effect, std::string("closed_loop"));
    QVERIFY2(report->remaining.fraction < 0.02, qPrintable(QString::number(report->remaining.fraction)));
  }
};

FIELDTRUE_TEST(StrongBendsTest)
#include "strong_bends_test.moc"
