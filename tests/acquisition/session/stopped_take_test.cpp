#include <QTest>

#include "tests/acquisition/session/controller_bench.h"
#include "tests/acquisition/session/session_folder.h"
#include "tests/support/full_disk.h"
#include "tests/support/test_main.h"

/// What ends a take before it is stored: undo, and a disk without room. Nothing else goes with it, and it is told.
using namespace fieldtrue;
using namespace fieldtrue::acquisition;

using testing::Bench;

namespace {

constexpr int kSessionBytes = 4096;  ///< Fewer than any session has.

}  // namespace

class StoppedTakeTest : public QObject {
  Q_OBJECT

  testing::SessionFolder folder_;

 private slots:
  void cancelledTakeStoresNothing() {
    Bench bench(folder_.newPath());
    bench.tracker->setDownAt(bench.placePose(0));
    bench.controller.take();
    bench.tracker->stand(0.3);
    bench.controller.cancelTake();
    QVERIFY(bench.controller.status().take == TakeState::kIdle);
    bench.tracker->stand(2.0);
    QVERIFY(bench.stored.empty() && bench.take_failures.isEmpty());
  }

  void fullDiskIsToldAndNothingIsLost() {
    Bench bench(folder_.newPath());
    bench.takeHere();
    {
      const testing::FullDisk full(kSessionBytes);
      bench.takeHere();
    }
    QCOMPARE(bench.stored, std::vector<int>{0});
    QCOMPARE(bench.take_failures.size(), 1);
    QVERIFY2(bench.take_failures[0].startsWith("B1, pipe 1: not stored: "), qPrintable(bench.take_failures[0]));
    QVERIFY(bench.controller.status().current == 1u);
    bench.controller.take();
    bench.tracker->stand(0.51);
    QCOMPARE(bench.stored, (std::vector<int>{0, 1}));
  }

  void whatCannotBeStoredIsNotTakenOverAndOver_data() {
    QTest::addColumn<bool>("takes_again");
    QTest::newRow("taken again") << true;
    QTest::newRow("acknowledged") << false;
  }
  void whatCannotBeStoredIsNotTakenOverAndOver() {
    QFETCH(bool, takes_again);
    Bench bench(folder_.newPath());
    bench.takeHere();
    bench.controller.setAutomatic(true);
    {
      const testing::FullDisk full(kSessionBytes);
      bench.tracker->carryTo(bench.placePose(1));
      bench.tracker->stand(20.0);
    }
    const AcquisitionStatus status = bench.controller.status();
    QCOMPARE(bench.take_failures.size(), 1);
    QVERIFY2(status.reason.startsWith("B1, pipe 1: not stored: "), qPrintable(status.reason));
    QVERIFY(status.attention && status.not_stored && status.automatic && status.take == TakeState::kFailed);
    bench.tracker->lose();
    bench.tracker->comeBack();
    bench.tracker->stand(5.0);
    QCOMPARE(bench.controller.status().reason, status.reason);
    QCOMPARE(bench.stored, std::vector<int>{0});

    if (takes_again) {
      bench.controller.take();
    } else {
      bench.controller.cancelTake();
    }
    bench.tracker->stand(2.0);
    QCOMPARE(bench.stored, (std::vector<int>{0, 1}));
    QVERIFY(!bench.controller.status().not_stored);
    bench.tracker->carryTo(bench.placePose(2));
    bench.tracker->stand(2.0);
    QCOMPARE(bench.stored, (std::vector<int>{0, 1, 2}));
    QCOMPARE(bench.take_failures.size(), 1);
  }

  void aTakeThatWasStoppedDoesNotBeginAgainByItself_data() {
    QTest::addColumn<bool>("by_undo");
    QTest::addColumn<int>("n_done");
    for (const int n_done : {0, 6}) {
      QTest::addRow("escape, %d places done", n_done) << false << n_done;
      QTest::addRow("undo, %d places done", n_done) << true << n_done;
    }
  }
  /// Of the first place the frame is not known yet; after six in all three directions it is.
  void aTakeThatWasStoppedDoesNotBeginAgainByItself() {
    QFETCH(bool, by_undo);
    QFETCH(int, n_done);
    Bench bench(folder_.newPath(), testing::planOf({2, 2, 3}));
    for (int i = 0; i < n_done; ++i) bench.takeHere();
    QCOMPARE(bench.controller.status().reference_known, n_done > 0);
    // What there is to be taken back before the first place: a skip.
    if (n_done == 0) bench.controller.skip();
    const auto place = *bench.controller.status().current;
    bench.controller.setAutomatic(true);
    bench.tracker->carryTo(bench.placePose(place));
    for (int n = 0; n < 240 && bench.controller.status().take != TakeState::kCollecting; ++n)
      bench.tracker->stand(1.0 / testing::kRate_hz);
    QVERIFY(bench.controller.status().take == TakeState::kCollecting);
    by_undo ? bench.controller.undo() : bench.controller.cancelTake();
    bench.tracker->stand(20.0);
    const AcquisitionStatus status = bench.controller.status();
    QVERIFY(status.take == TakeState::kIdle && status.automatic && status.current == place);
    QCOMPARE(bench.stored.size(), static_cast<std::size_t>(n_done));
    QVERIFY2(status.reason.startsWith("stopped: "), qPrintable(status.reason));

    const Pose at = bench.placePose(place);
    bench.tracker->carryTo({at.position_m + Eigen::Vector3d(0.0, 0.0, 0.1), at.orientation}, 0.3);
    bench.tracker->carryTo(at, 0.3);
    bench.tracker->stand(3.0);
    QCOMPARE(bench.stored.size(), static_cast<std::size_t>(n_done) + 1);
    QCOMPARE(bench.stored.back(), static_cast<int>(place));
    QVERIFY(bench.take_failures.isEmpty() && bench.failures.isEmpty());
  }

  void aTakeThatWasStoppedIsTakenWhenItIsAskedFor() {
    Bench bench(folder_.newPath());
    bench.tracker->setDownAt(bench.placePose(0));
    bench.controller.take();
    bench.tracker->stand(0.2);
    bench.controller.cancelTake();
    // That it takes by itself from now on is no word on the stand that was stopped.
    bench.controller.setAutomatic(true);
    bench.tracker->stand(10.0);
    QVERIFY(bench.stored.empty());
    bench.controller.take();
    bench.tracker->stand(0.6);
    QCOMPARE(bench.stored, std::vector<int>{0});
    QCOMPARE(bench.controller.status().reason, QString("move the sensor here; or press space"));
  }

  void undoAndRedoWithNothingLeftStopNoTake() {
    Bench bench(folder_.newPath());
    bench.tracker->setDownAt(bench.placePose(0));
    bench.controller.take();
    bench.tracker->stand(0.2);
    bench.controller.undo();
    bench.controller.redo();
    QVERIFY(bench.controller.status().take == TakeState::kCollecting);
    bench.tracker->stand(0.4);
    QCOMPARE(bench.stored, std::vector<int>{0});
  }

  void undoOfARunningTakeLeavesThePlaceBefore() {
    Bench bench(folder_.newPath());
    bench.takeHere();
    bench.tracker->setDownAt(bench.placePose(1));
    bench.controller.take();
    bench.tracker->stand(0.2);
    bench.controller.undo();
    AcquisitionStatus status = bench.controller.status();
    QVERIFY(status.take == TakeState::kIdle && status.current == 1u);
    QVERIFY(status.recorded->n_done == 1 && !status.recorded->can_redo);

    bench.controller.undo();
    status = bench.controller.status();
    QVERIFY(status.current == 0u && status.recorded->n_done == 0 && status.recorded->can_redo);
    bench.controller.take();
    bench.tracker->stand(0.2);
    bench.controller.redo();
    status = bench.controller.status();
    QVERIFY(status.take == TakeState::kIdle && status.current == 1u && status.recorded->n_done == 1);
    QVERIFY(bench.take_failures.isEmpty() && bench.failures.isEmpty());
  }
};

FIELDTRUE_TEST(StoppedTakeTest)
#include "stopped_take_test.moc"
