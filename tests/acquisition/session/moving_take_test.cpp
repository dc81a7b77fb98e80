#include <QTest>
#include <algorithm>

#include "tests/acquisition/session/controller_bench.h"
#include "tests/acquisition/session/session_folder.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

/// A take that is asked for, or starts over, while the jig moves: its samples begin when the jig rests.
using namespace fieldtrue;
using namespace fieldtrue::acquisition;

using testing::Bench;
using testing::planOf;

namespace {

constexpr double kCarried_m_s = 0.05;
constexpr double kCarriedFor_s = 6.0;
/// What a sensor of 0.1 mm that rested is off by: its noise, and the mid of a hand's last step.
constexpr double kRested_m = 3e-4;

}  // namespace

class MovingTakeTest : public QObject {
  Q_OBJECT

  testing::SessionFolder folder_;

  /// Carries the jig towards a place, to arrive after so long.
  static Pose before(const Pose& place, double seconds) {
    return {place.position_m - Eigen::Vector3d(kCarried_m_s * seconds, 0.0, 0.0), place.orientation};
  }

 private slots:
  void askedForOnTheWay_data() {
    QTest::addColumn<double>("rate_hz");
    for (const double rate_hz : {7.5, 30.0, 120.0, 240.0}) QTest::addRow("%g Hz", rate_hz) << rate_hz;
  }
  void askedForOnTheWay() {
    QFETCH(double, rate_hz);
    Bench bench(folder_.newPath());
    bench.tracker->rate_hz = rate_hz;
    const Pose place = bench.placePose(0);
    bench.tracker->true_pose = before(place, kCarriedFor_s);
    bench.tracker->stand(2.0);
    const Pose on_the_way = before(place, kCarriedFor_s / 2.0);
    bench.tracker->carryTo(on_the_way, kCarriedFor_s / 2.0);
    bench.controller.take();
    bench.tracker->carryTo(place, kCarriedFor_s / 2.0);
    QVERIFY2(bench.stored.empty(), "nothing is taken of a jig that is carried");
    QCOMPARE(bench.controller.status().take, TakeState::kCollecting);
    QCOMPARE(bench.controller.status().collected, 0);
    QVERIFY2(bench.controller.status().reason.startsWith("hold still: moving "),
             qPrintable(bench.controller.status().reason));
    bench.tracker->stand(1.5 + 60.0 / rate_hz);
    QCOMPARE(bench.stored, std::vector<int>{0});
    const Pose expected = inverse(bench.tracker->reference_from_tracker) * place;
    FT_VERIFY_MATCH(testing::near(bench.nodes[0].tracker_from_sensor.position_m, expected.position_m, kRested_m));
    QCOMPARE(bench.suspicions, QStringList{QString()});
    // What was passed over, from second 5 to second 8, is kept as what is read between the places is.
    bench.readTables();
    const auto on_way = [](const SampleRow& row) {
      return row.node < 0 && row.sample.time_s > 5.0 && row.sample.time_s < 8.0;
    };
    const auto kept = std::count_if(bench.samples.rows.begin(), bench.samples.rows.end(), on_way);
    QVERIFY2(static_cast<double>(kept) > 0.9 * 3.0 * std::min(rate_hz, 10.0) - 1.0, qPrintable(QString::number(kept)));
  }

  void aTakeThatMovedGoesOnWhenTheJigRests() {
    Bench bench(folder_.newPath());
    const Pose place = bench.placePose(0);
    bench.tracker->true_pose = before(place, 3.0);
    bench.tracker->stand(2.0);
    bench.controller.take();
    bench.tracker->stand(0.25);
    bench.tracker->carryTo(place, 3.0);
    QVERIFY(bench.stored.empty());
    bench.tracker->stand(1.2);
    QCOMPARE(bench.stored, std::vector<int>{0});
    QCOMPARE(bench.suspicions, QStringList{"moved once while sampling"});
    const Pose expected = inverse(bench.tracker->reference_from_tracker) * place;
    FT_VERIFY_MATCH(testing::near(bench.nodes[0].tracker_from_sensor.position_m, expected.position_m, kRested_m));
  }

  void aJigThatNeverRestsFails() {
    Bench bench(folder_.newPath());
    const Pose place = bench.placePose(0);
    bench.tracker->true_pose = before(place, 40.0);
    bench.tracker->carryTo(before(place, 35.0), 5.0);
    bench.controller.take();
    bench.tracker->carryTo(before(place, 4.0), 31.0);
    QCOMPARE(bench.take_failures.size(), 1);
    FT_VERIFY_MATCH(testing::holdsAll(bench.take_failures[0].toStdString(),
                                      {"not finished within 30 s: 0 of 60", "it never rested: let the sensor rest"}));
    QVERIFY(bench.stored.empty());
  }

  void itIsJudgedWhereTheJigCameToRest() {
    Bench bench(folder_.newPath());
    for (int i = 0; i < 6; ++i) bench.takeHere();
    const Pose place = bench.placePose(*bench.controller.status().current);
    const Pose wrong{place.position_m + Eigen::Vector3d(0.0, 0.36, 0.48), place.orientation};
    // Asked for as the jig passes the place.
    bench.tracker->carryTo(place, 1.0);
    bench.controller.take();
    QVERIFY(bench.refused.empty());
    bench.tracker->carryTo(wrong, 3.0);
    bench.tracker->stand(1.2);
    QCOMPARE(bench.refused.size(), std::size_t{1});
    QCOMPARE(bench.stored.size(), std::size_t{6});
  }

  /// A session begun by itself: each place is taken after it was reached, with few readings a second too.
  void byItselfWithFewReadings_data() {
    QTest::addColumn<double>("rate_hz");
    for (const double rate_hz : {1.5, 2.0, 5.0, 8.0, 10.0}) QTest::addRow("%g Hz", rate_hz) << rate_hz;
  }
  void byItselfWithFewReadings() {
    QFETCH(double, rate_hz);
    Bench bench(folder_.newPath(), planOf({2, 2, 1}));
    bench.tracker->rate_hz = rate_hz;
    bench.controller.setTakeLength({TakeLength::Until::kSamples, 10});
    bench.controller.setAutomatic(true);
    for (std::size_t place = 0; place < 4; ++place) {
      bench.tracker->carryTo(bench.placePose(place), 4.0);
      bench.tracker->stand(6.0 / rate_hz + 10.0 / rate_hz + 3.0);
    }
    QCOMPARE(bench.stored, (std::vector<int>{0, 1, 2, 3}));
    for (std::size_t place = 0; place < 4; ++place) {
      const Pose expected = inverse(bench.tracker->reference_from_tracker) * bench.placePose(place);
      FT_VERIFY_MATCH(testing::near(bench.nodes[place].tracker_from_sensor.position_m, expected.position_m, kRested_m));
    }
  }

  /// The clock runs on where a recording has a gap: what was before may have been elsewhere.
  void aGapBeginsAgain() {
    Bench bench(folder_.newPath());
    bench.tracker->true_pose = bench.placePose(0);
    bench.tracker->stand(2.0);
    bench.controller.take();
    bench.tracker->stand(0.25);
    QCOMPARE(bench.controller.status().collected, 30);
    bench.tracker->pass(10.0);
    bench.tracker->stand(0.3);
    QVERIFY2(bench.stored.empty(), "readings from before the gap are no part of it");
    bench.tracker->stand(1.0);
    QCOMPARE(bench.stored, std::vector<int>{0});
    QCOMPARE(bench.suspicions, QStringList{QString()});
    QVERIFY2(*bench.nodes[0].t_end_s - *bench.nodes[0].t_start_s < 1.0, "and its time does not span the gap");
  }

  /// Where so few readings come that rest cannot be seen, a take that is asked for is one.
  void aTrackerTooSlowToTell() {
    Bench bench(folder_.newPath());
    bench.tracker->rate_hz = 0.8;
    bench.controller.setTakeLength({TakeLength::Until::kSamples, 10});
    bench.tracker->true_pose = bench.placePose(0);
    bench.tracker->stand(5.0);
    bench.controller.take();
    bench.tracker->stand(15.0);
    QCOMPARE(bench.stored, std::vector<int>{0});
  }
};

FIELDTRUE_TEST(MovingTakeTest)
#include "moving_take_test.moc"
