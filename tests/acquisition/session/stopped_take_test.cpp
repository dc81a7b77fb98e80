#include <signal.h>
#include <sys/resource.h>

#include <QTest>

#include "tests/acquisition/session/controller_bench.h"
#include "tests/acquisition/session/session_folder.h"
#include "tests/support/test_main.h"

/// What ends a take before it is stored: undo, and a disk without room. Nothing else goes with it, and it is told.
using namespace fieldtrue;
using namespace fieldtrue::acquisition;

using testing::Bench;

namespace {

/// No file of this program grows while it lives.
class FullDisk {
 public:
  FullDisk() {
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit none{4096, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &none);
  }
  ~FullDisk() { setrlimit(RLIMIT_FSIZE, &before_); }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
};

}  // namespace

class StoppedTakeTest : public QObject {
  Q_OBJECT

  testing::SessionFolder folder_;

 private slots:
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
      const FullDisk full;
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
