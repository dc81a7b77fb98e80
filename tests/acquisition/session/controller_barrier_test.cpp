#include <QElapsedTimer>
#include <QFile>
#include <QTest>

#include "acquisition/session/guarded_call.h"
#include "tests/acquisition/session/controller_bench.h"
#include "tests/acquisition/session/session_folder.h"
#include "tests/support/matchers.h"
#include "tests/support/silent_port.h"
#include "tests/support/test_main.h"

/// What the acquisition survives: exceptions, its own session opened again, a tracker that never answers.
using namespace fieldtrue;
using namespace fieldtrue::acquisition;

using testing::Bench;
using testing::FakeTracker;
using testing::planOf;
using testing::SilentPort;

namespace {

enum class Fault { kNone, kMemory, kCheck };

/// Throws where the controller asks it something.
class ThrowingTracker : public FakeTracker {
 public:
  Fault fault = Fault::kNone;
  void guideTo(const Pose& pose) override {
    raise();
    FakeTracker::guideTo(pose);
  }
  TableMetadata describe() const override {
    raise();
    return FakeTracker::describe();
  }

 private:
  void raise() const {
    if (fault == Fault::kMemory) throw std::bad_alloc();
    FT_CHECK(fault == Fault::kNone);
  }
};

QString planText(std::array<int, 3> counts) { return QString::fromStdString(toJson(planOf(counts)).dump()); }

}  // namespace

class ControllerBarrierTest : public QObject {
  Q_OBJECT

  testing::SessionFolder folder_;

 private slots:
  void whatTheDevicesSignalsRaiseIsTold_data() {
    QTest::addColumn<int>("fault");
    QTest::addColumn<QByteArray>("fragment");
    QTest::newRow("memory") << static_cast<int>(Fault::kMemory) << QByteArray("not enough memory");
    QTest::newRow("check") << static_cast<int>(Fault::kCheck)
                           << QByteArray("internal check failed: fault == Fault::kNone (controller_barrier_test.cpp:");
  }
  void whatTheDevicesSignalsRaiseIsTold() {
    QFETCH(int, fault);
    QFETCH(QByteArray, fragment);
    Bench bench(folder_.newPath());
    auto owned = std::make_unique<ThrowingTracker>();
    ThrowingTracker* tracker = owned.get();
    bench.tracker = tracker;
    bench.controller.adoptDevice(std::move(owned));
    bench.takeHere();
    QCOMPARE(bench.stored, std::vector<int>{0});
    tracker->lose();
    bench.failures.clear();
    tracker->fault = static_cast<Fault>(fault);
    tracker->comeBack();
    QCOMPARE(bench.failures.size(), qsizetype{1});
    FT_VERIFY_MATCH(testing::holdsAll(bench.failures[0].toStdString(), {fragment, "what is stored stands"}));
    // It goes on as if nothing had happened.
    tracker->fault = Fault::kNone;
    tracker->comeBack();
    bench.takeHere();
    QCOMPARE(bench.stored, (std::vector<int>{0, 1}));
    QCOMPARE(bench.failures.size(), qsizetype{1});
  }

  void whatASlotRaisesIsTold() {
    Bench bench(folder_.newPath());
    auto owned = std::make_unique<ThrowingTracker>();
    ThrowingTracker* tracker = owned.get();
    bench.tracker = tracker;
    bench.controller.adoptDevice(std::move(owned));
    bench.tracker->setDownAt(bench.placePose(0));
    bench.controller.take();
    bench.tracker->stand(0.2);
    QCOMPARE(bench.controller.status().take, TakeState::kCollecting);
    tracker->fault = Fault::kCheck;
    guarded(bench.controller, [&] { bench.controller.goTo(2); });
    QCOMPARE(bench.failures.size(), qsizetype{1});
    QVERIFY2(bench.controller.status().take != TakeState::kCollecting, "half a take is given up");
    tracker->fault = Fault::kNone;
    guarded(bench.controller, [&] { bench.controller.goTo(2); });
    bench.takeHere();
    QCOMPARE(bench.stored, std::vector<int>{2});
  }

  void theOpenSessionIsNotOpenedAgain_data() {
    QTest::addColumn<QString>("spelling");
    for (const char* spelling : {"same", "dotted", "link"}) QTest::newRow(spelling) << QString(spelling);
  }
  void theOpenSessionIsNotOpenedAgain() {
    QFETCH(QString, spelling);
    const QString path = folder_.newPath();
    Bench bench(path);
    bench.takeHere();
    bench.tracker->setDownAt(bench.placePose(1));
    bench.controller.take();
    bench.tracker->stand(0.2);
    QString given = path;
    if (spelling == "dotted") given = folder_.path() + "/./" + QFileInfo(path).fileName();
    if (spelling == "link") given = folder_.filePath("link" + QFileInfo(path).fileName());
    if (spelling == "link") QVERIFY(QFile::link(path, given));
    bench.opened_plan.clear();
    bench.controller.openSession(given, {});
    QCOMPARE(bench.failures, QStringList());
    QVERIFY2(!bench.opened_plan.isEmpty(), "who asked is told");
    QCOMPARE(bench.controller.status().take, TakeState::kCollecting);
    QVERIFY(bench.controller.status().recorded->can_undo);
    bench.tracker->stand(0.4);
    QCOMPARE(bench.stored, (std::vector<int>{0, 1}));
  }

  void noSessionIsMadeInPlaceOfTheOpenOne() {
    const QString path = folder_.newPath();
    Bench bench(path);
    bench.takeHere();
    bench.controller.openSession(path, planText({2, 2, 2}));
    QCOMPARE(bench.failures.size(), qsizetype{1});
    FT_VERIFY_MATCH(testing::holdsAll(bench.failures[0].toStdString(), {"open already", "another name"}));
    const AcquisitionStatus status = bench.controller.status();
    QCOMPARE(status.session->path, path);
    QCOMPARE(status.session->places.size(), std::size_t{18});
    QCOMPARE(status.recorded->n_done, std::size_t{1});
    bench.takeHere();
    QCOMPARE(bench.stored, (std::vector<int>{0, 1}));
  }

  void anUnansweringTrackerHoldsNothingUp() {
    SilentPort port;
    AcquisitionController controller;
    QElapsedTimer timer;
    timer.start();
    controller.connectDevice(QString("fastrak:tcp:127.0.0.1:%1").arg(port.number()), {});
    QVERIFY2(timer.elapsed() < 500, qPrintable(QString("connecting blocked for %1 ms").arg(timer.elapsed())));
    QTest::qWait(100);
    QCOMPARE(controller.status().device, DeviceState::kConnecting);
    timer.restart();
    controller.disconnectDevice();
    QVERIFY(timer.elapsed() < 500);
    QCOMPARE(controller.status().device, DeviceState::kClosed);
    // Given up by itself after a while, in a sentence.
    controller.connectDevice(QString("fastrak:tcp:127.0.0.1:%1").arg(port.number()), {});
    QTRY_COMPARE_WITH_TIMEOUT(controller.status().device, DeviceState::kFailed, 6000);
    FT_VERIFY_MATCH(testing::holdsAll(controller.status().device_text.toStdString(), {"127.0.0.1", "did not answer"}));
  }
};

FIELDTRUE_TEST(ControllerBarrierTest)
#include "controller_barrier_test.moc"
