#include <QTest>

#include "acquisition/plan/place_state.h"
#include "tests/acquisition/session/controller_bench.h"
#include "tests/acquisition/session/session_folder.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

/// A take whose time is over before it has what was asked for: what was said for that is done, or a person is asked.
using namespace fieldtrue;
using namespace fieldtrue::acquisition;

using testing::Bench;
using testing::kRate_hz;
using testing::planOf;

namespace {

/// The mean of readings of 0.1 mm (3-D) is known so well after 10,000 of them: 83 s at 120 a second.
constexpr TakeLength kFar{TakeLength::Until::kStandardError, 1e-6};
constexpr double kLimit_s = 30.0;
constexpr double kToRest_s = 1.0;
constexpr const char* kShort = "known to 0.0017 mm, not to 0.001 mm";

/// A session whose take of the first place has just had its time.
struct HeldBench : Bench {
  HeldBench(const QString& path, AtTimeLimit at_time_limit, const TakeLength& length = kFar, double rate_hz = kRate_hz)
      : Bench(path) {
    QObject::connect(&controller, &AcquisitionController::takeHeld, [this](int, const QString& reason, bool can_keep) {
      held << reason;
      could_keep.push_back(can_keep);
    });
    controller.setTakeLength(length);
    controller.setAtTimeLimit(at_time_limit);
    tracker->rate_hz = rate_hz;
    tracker->true_pose = placePose(0);
    tracker->stand(2.0);
    controller.take();
    tracker->stand(kLimit_s + kToRest_s);
  }
  QStringList held;
  std::vector<bool> could_keep;
};

}  // namespace

class HeldTakeTest : public QObject {
  Q_OBJECT

  testing::SessionFolder folder_;

 private slots:
  void whatWasSaidIsDone_data() {
    QTest::addColumn<int>("at_time_limit");
    QTest::addColumn<bool>("by_error");
    QTest::addColumn<bool>("stored");
    QTest::addColumn<bool>("skipped");
    QTest::addColumn<int>("failures");
    const auto add = [](const char* name, AtTimeLimit rule, bool by_error, bool stored, bool skipped, int failures) {
      QTest::newRow(name) << static_cast<int>(rule) << by_error << stored << skipped << failures;
    };
    add("a mean known less well, usual", AtTimeLimit::kUsual, true, true, false, 0);
    add("a mean known less well, keep", AtTimeLimit::kKeep, true, true, false, 0);
    add("a mean known less well, again", AtTimeLimit::kAgain, true, false, false, 1);
    add("a mean known less well, skip", AtTimeLimit::kSkip, true, false, true, 0);
    add("too few readings, usual", AtTimeLimit::kUsual, false, false, false, 1);
    add("too few readings, keep", AtTimeLimit::kKeep, false, true, false, 0);
    add("too few readings, again", AtTimeLimit::kAgain, false, false, false, 1);
    add("too few readings, skip", AtTimeLimit::kSkip, false, false, true, 0);
  }
  void whatWasSaidIsDone() {
    QFETCH(int, at_time_limit);
    QFETCH(bool, by_error);
    QFETCH(bool, stored);
    QFETCH(bool, skipped);
    QFETCH(int, failures);
    // One reading a second: some thirty of the sixty have come.
    HeldBench bench(folder_.newPath(), static_cast<AtTimeLimit>(at_time_limit), by_error ? kFar : TakeLength(),
                    by_error ? kRate_hz : 1.0);
    QCOMPARE(bench.stored.size(), stored ? std::size_t{1} : std::size_t{0});
    QCOMPARE(bench.controller.status().recorded->n_skipped, skipped ? std::size_t{1} : std::size_t{0});
    QCOMPARE(bench.take_failures.size(), failures);
    QVERIFY(bench.held.isEmpty());
    const std::string why = by_error ? kShort : " of 60 good samples";
    const QString told = stored ? bench.suspicions.value(0) : bench.take_failures.value(0);
    if (!skipped) QVERIFY2(told.contains(QString::fromStdString(why)), qPrintable(told));
  }

  void againIsTwice() {
    HeldBench bench(folder_.newPath(), AtTimeLimit::kAgain);
    QCOMPARE(bench.take_failures.size(), 1);
    QCOMPARE(bench.controller.status().take, TakeState::kCollecting);
    bench.tracker->stand(2.0 * (kLimit_s + kToRest_s));
    QCOMPARE(bench.take_failures.size(), 3);
    bench.tracker->stand(kLimit_s);
    QCOMPARE(bench.take_failures.size(), 3);
    QVERIFY(bench.controller.status().take != TakeState::kCollecting);
    QVERIFY(bench.stored.empty());
  }

  void aPersonIsAskedAndNothingGoesOn() {
    HeldBench bench(folder_.newPath(), AtTimeLimit::kAsk);
    QCOMPARE(bench.held.size(), 1);
    FT_VERIFY_MATCH(testing::holdsAll(bench.held[0].toStdString(), {kShort, "after 30 s"}));
    QVERIFY(bench.could_keep[0]);
    const int collected = bench.controller.status().collected;
    bench.controller.setAutomatic(true);
    bench.tracker->stand(60.0);
    const AcquisitionStatus status = bench.controller.status();
    QCOMPARE(status.take, TakeState::kHeld);
    QCOMPARE(status.collected, collected);
    QVERIFY(status.can_keep && status.attention);
    QVERIFY2(status.reason.contains(kShort) && status.reason.contains("Carrying the jig on keeps it"),
             qPrintable(status.reason));
    QVERIFY(bench.stored.empty() && bench.take_failures.isEmpty());
  }

  void keptItIsMarked() {
    HeldBench bench(folder_.newPath(), AtTimeLimit::kAsk);
    bench.controller.keepTake();
    QCOMPARE(bench.stored, std::vector<int>{0});
    QVERIFY2(bench.suspicions[0].contains(kShort), qPrintable(bench.suspicions[0]));
    QVERIFY(bench.controller.status().recorded->states[0] == PlaceState::kSuspicious);
    // Thirty seconds of readings, and the first of the next.
    QVERIFY(std::abs(bench.nodes[0].n_used + bench.nodes[0].n_rejected - kLimit_s * kRate_hz) <= 2.0);
  }

  void waitingLongEnoughHasWhatWasAskedFor() {
    HeldBench bench(folder_.newPath(), AtTimeLimit::kAsk);
    for (int waits = 0; waits < 4 && bench.stored.empty(); ++waits) {
      bench.controller.waitLonger();
      QCOMPARE(bench.controller.status().take, TakeState::kCollecting);
      bench.tracker->stand(kLimit_s + kToRest_s);
    }
    QCOMPARE(bench.stored, std::vector<int>{0});
    QCOMPARE(bench.suspicions, QStringList{QString()});
    // 0.1 mm / 0.001 mm, squared, is 10,000.
    QVERIFY2(bench.nodes[0].n_used > 8000 && bench.nodes[0].n_used < 13000,
             qPrintable(QString::number(bench.nodes[0].n_used)));
    QVERIFY(bench.held.size() >= 2);
    QVERIFY2(bench.held[1].contains("after 60 s"), qPrintable(bench.held[1]));
  }

  void whatItHadStaysHoweverLateTheAnswer() {
    HeldBench bench(folder_.newPath(), AtTimeLimit::kAsk);
    const int collected = bench.controller.status().collected;
    bench.tracker->stand(60.0);
    bench.controller.waitLonger();
    bench.tracker->stand(2.0);
    QVERIFY(bench.controller.status().take == TakeState::kCollecting);
    QVERIFY2(bench.controller.status().collected > collected, "the wait is no gap of the stream");
  }

  void aJigThatMovedMeanwhileStartsOver() {
    HeldBench bench(folder_.newPath(), AtTimeLimit::kAsk);
    bench.tracker->true_pose.position_m.x() += 0.004;
    bench.tracker->stand(2.0);
    QCOMPARE(bench.controller.status().take, TakeState::kHeld);
    bench.controller.waitLonger();
    bench.tracker->stand(5.0);
    QVERIFY2(bench.controller.status().collected < 7.0 * kRate_hz, "what stood elsewhere counts no more");
    bench.controller.cancelTake();
    QVERIFY(bench.stored.empty());
  }

  /// Pressed while a hand still corrects the jig, which ends where it was.
  void longerIsFromRestOn() {
    HeldBench bench(folder_.newPath(), AtTimeLimit::kAsk);
    const int collected = bench.controller.status().collected;
    const Pose place = bench.placePose(0);
    bench.tracker->carryTo({place.position_m + Eigen::Vector3d(0.01, 0.0, 0.0), place.orientation}, 0.5);
    bench.controller.waitLonger();
    bench.tracker->carryTo(place, 0.5);
    bench.tracker->stand(2.0);
    QVERIFY(bench.controller.status().take == TakeState::kCollecting);
    QVERIFY2(bench.controller.status().collected > collected, "what was read on the way starts nothing over");
  }

  void againItBeginsAnew() {
    HeldBench bench(folder_.newPath(), AtTimeLimit::kAsk);
    bench.controller.takeAgain();
    bench.tracker->stand(1.0);
    const AcquisitionStatus status = bench.controller.status();
    QCOMPARE(status.take, TakeState::kCollecting);
    QVERIFY2(status.collected > 60 && status.collected <= 120, qPrintable(QString::number(status.collected)));
    bench.tracker->stand(kLimit_s);
    QCOMPARE(bench.held.size(), 2);
    bench.controller.skip();
    QCOMPARE(bench.controller.status().recorded->n_skipped, std::size_t{1});
    QVERIFY(bench.stored.empty());
  }

  void carryingTheJigOnKeepsIt() {
    HeldBench bench(folder_.newPath(), AtTimeLimit::kAsk);
    bench.tracker->stand(5.0);
    bench.tracker->carryTo(bench.placePose(1));
    QCOMPARE(bench.stored, std::vector<int>{0});
    const Pose expected = inverse(bench.tracker->reference_from_tracker) * bench.placePose(0);
    FT_VERIFY_MATCH(testing::near(bench.nodes[0].tracker_from_sensor.position_m, expected.position_m, 1e-4));
    QVERIFY(bench.suspicions[0].contains(kShort));
  }

  /// The place that was taken before was left long ago: that is no reason to end what is held at the next one.
  void oneThatIsHeldAtTheNextPlaceStaysSo() {
    Bench bench(folder_.newPath());
    bench.takeHere();
    QCOMPARE(bench.stored, std::vector<int>{0});
    bench.controller.setTakeLength(kFar);
    bench.controller.setAtTimeLimit(AtTimeLimit::kAsk);
    bench.tracker->setDownAt(bench.placePose(1));
    bench.controller.take();
    bench.tracker->stand(kLimit_s + kToRest_s);
    QCOMPARE(bench.controller.status().take, TakeState::kHeld);
    bench.tracker->stand(5.0);
    QCOMPARE(bench.controller.status().take, TakeState::kHeld);
    QCOMPARE(bench.stored, std::vector<int>{0});
    bench.tracker->carryTo(bench.placePose(2));
    QCOMPARE(bench.stored, (std::vector<int>{0, 1}));
  }

  /// A silent sensor has nothing to be kept; back again, it has what was asked for.
  void whereNothingIsToBeKept() {
    Bench bench(folder_.newPath());
    QStringList held;
    bool can_keep = true;
    QObject::connect(&bench.controller, &AcquisitionController::takeHeld,
                     [&](int, const QString& reason, bool can) { held << reason, can_keep = can; });
    bench.controller.setAtTimeLimit(AtTimeLimit::kAsk);
    bench.tracker->on_jig[1] = {{{0.0, 0.04, 0.01}, Eigen::Quaterniond::Identity()}};
    bench.tracker->true_pose = bench.placePose(0);
    bench.tracker->stand(2.0);
    bench.controller.take();
    bench.tracker->on_jig[1].is_plugged = false;
    bench.tracker->stand(kLimit_s + kToRest_s);
    QCOMPARE(held.size(), 1);
    QVERIFY2(held[0].startsWith("sensor 1: silent for the last 30 s: 0 of 60"), qPrintable(held[0]));
    QVERIFY(!can_keep);
    bench.controller.keepTake();
    QVERIFY2(bench.controller.status().take == TakeState::kHeld && bench.stored.empty(), "there is nothing to keep");
    bench.tracker->on_jig[1].is_plugged = true;
    bench.controller.waitLonger();
    bench.tracker->stand(2.0);
    QCOMPARE(bench.stored, std::vector<int>{0});
    QCOMPARE(bench.nodes.size(), std::size_t{2});
  }

  void aTrackerThatIsLostEndsIt() {
    HeldBench bench(folder_.newPath(), AtTimeLimit::kAsk);
    bench.tracker->lose();
    QCOMPARE(bench.take_failures.size(), 1);
    QVERIFY(bench.controller.status().take == TakeState::kFailed);
    bench.controller.keepTake();
    QVERIFY(bench.stored.empty());
  }
};

FIELDTRUE_TEST(HeldTakeTest)
#include "held_take_test.moc"
