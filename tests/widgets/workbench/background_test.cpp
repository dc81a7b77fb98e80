#include "widgets/workbench/background.h"

#include <QPushButton>
#include <QSignalSpy>
#include <QTest>
#include <atomic>
#include <semaphore>
#include <thread>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"
#include "widgets/shell/application.h"

using namespace fieldtrue;
using namespace fieldtrue::widgets;

class BackgroundTest : public QObject {
  Q_OBJECT
 private slots:
  void cleanup() { QThreadPool::globalInstance()->waitForDone(); }

  void handsTheResultOver() {
    QObject receiver;
    QThread* on = nullptr;
    int got = 0;
    runInBackground(
        &receiver, [] { return 6 * 7; },
        [&](const Result<int>& result) {
          got = result.value_or(-1);
          on = QThread::currentThread();
        });
    QTRY_COMPARE(got, 42);
    QCOMPARE(on, receiver.thread());
  }

  void whatTheWorkThrowsArrivesAsAnError_data() {
    QTest::addColumn<bool>("memory");
    QTest::newRow("memory") << true;
    QTest::newRow("check") << false;
  }
  void whatTheWorkThrowsArrivesAsAnError() {
    QFETCH(bool, memory);
    QObject receiver;
    std::optional<Result<int>> got;
    runInBackground(
        &receiver,
        [memory]() -> Result<int> {
          if (memory) throw std::bad_alloc();
          FT_CHECK(false);
          return 1;
        },
        [&](Result<int> result) { got = std::move(result); });
    QTRY_VERIFY(got.has_value());
    QVERIFY(!got->has_value());
    FT_VERIFY_MATCH(testing::holdsAll(got->error().message,
                                      {memory ? "not enough memory" : "internal check failed", "nothing was changed"}));
  }

  /// Work that ends, and progress that is told, at the very moment at which the receiver goes.
  void theReceiverMayGoAnyTime() {
    std::atomic<int> n_called = 0;
    for (int round = 0; round < 300; ++round) {
      auto receiver = std::make_unique<QObject>();
      std::counting_semaphore<> begun(0);
      const Postbox box(receiver.get());
      runInBackground(
          receiver.get(),
          [&begun, box, &n_called, alive = receiver.get()] {
            begun.release();
            for (int i = 0; i < 20; ++i) box.post([&n_called, alive] { n_called += alive->objectName().isEmpty(); });
            return 1;
          },
          [&n_called, alive = receiver.get()](const Result<int>&) { n_called += alive->objectName().isEmpty(); });
      begun.acquire();
      if (round % 3 == 0) QCoreApplication::processEvents();
      receiver.reset();
      const int before = n_called;
      QThreadPool::globalInstance()->waitForDone();
      QCoreApplication::processEvents();
      QCOMPARE(n_called.load(), before);
    }
  }

  void jobsAnswerAndAreCounted() {
    QObject owner;
    BackgroundJobs jobs(&owner);
    QVERIFY(!jobs.busy());
    std::vector<int> got;
    for (int i = 0; i < 3; ++i)
      jobs.run([i](const RunControl&) { return i; }, [&](const Result<int>& result) { got.push_back(result.value()); });
    QVERIFY(jobs.busy());
    QTRY_COMPARE(got.size(), std::size_t{3});
    QVERIFY(!jobs.busy());
  }

  void aStoppedJobIsToldToEndAndAnswersNobody() {
    QObject owner;
    BackgroundJobs jobs(&owner);
    std::binary_semaphore begun(0);
    std::atomic<bool> was_stopped = false;
    int n_answers = 0, n_progress = 0;
    jobs.run(
        [&](const RunControl& control) {
          begun.release();
          while (!control.stop.stop_requested()) std::this_thread::yield();
          was_stopped = true;
          control.progress(0.5);
          return 1;
        },
        [&](const Result<int>&) { ++n_answers; }, [&](double) { ++n_progress; });
    begun.acquire();
    jobs.stop();
    QVERIFY(!jobs.busy());
    int second = 0;
    jobs.run([](const RunControl& control) { return control.stop.stop_requested() ? -1 : 2; },
             [&](const Result<int>& result) { second = result.value(); });
    QTRY_COMPARE(second, 2);
    QThreadPool::globalInstance()->waitForDone();
    QCoreApplication::processEvents();
    QVERIFY(was_stopped);
    QCOMPARE(n_answers, 0);
    QCOMPARE(n_progress, 0);
    QVERIFY(!jobs.busy());
  }

  void progressIsToldOnTheOwnersThread() {
    QObject owner;
    BackgroundJobs jobs(&owner);
    std::vector<double> told;
    bool done = false;
    jobs.run(
        [](const RunControl& control) {
          for (const double fraction : {0.25, 0.5, 1.0}) control.progress(fraction);
          return 0;
        },
        [&](const Result<int>&) { done = true; }, [&](double fraction) { told.push_back(fraction); });
    QTRY_VERIFY(done);
    QCOMPARE(told, (std::vector<double>{0.25, 0.5, 1.0}));
  }

  void jobsEndWithTheirOwner() {
    std::atomic<bool> was_stopped = false;
    std::atomic<int> n_answers = 0;
    std::binary_semaphore begun(0);
    struct Owner : QObject {
      BackgroundJobs jobs{this};
    };
    auto owner = std::make_unique<Owner>();
    owner->jobs.run(
        [&](const RunControl& control) {
          begun.release();
          while (!control.stop.stop_requested()) std::this_thread::yield();
          was_stopped = true;
          return 1;
        },
        [&](const Result<int>&) { ++n_answers; });
    begun.acquire();
    owner.reset();
    QThreadPool::globalInstance()->waitForDone();
    QCoreApplication::processEvents();
    QVERIFY(was_stopped);
    QCOMPARE(n_answers.load(), 0);
  }

  void aSlotThatThrowsIsToldAndTheProgramGoesOn() {
    QSignalSpy told(qobject_cast<Application*>(qApp), &Application::threw);
    QPushButton button;
    int clicks = 0;
    connect(&button, &QPushButton::clicked, this, [&] {
      if (++clicks == 1) FT_CHECK(false);
    });
    button.show();
    QTest::mouseClick(&button, Qt::LeftButton);
    QCOMPARE(told.size(), qsizetype{1});
    FT_VERIFY_MATCH(testing::holdsAll(told[0][0].toString().toStdString(), {"internal check failed"}));
    QTest::mouseClick(&button, Qt::LeftButton);
    QCOMPARE(clicks, 2);
    QCOMPARE(told.size(), qsizetype{1});
  }
};

namespace {

int runInApplication(int argc, char** argv) {
  if (qEnvironmentVariableIsEmpty("DISPLAY")) qputenv("QT_QPA_PLATFORM", "offscreen");
  Application application(argc, argv);
  BackgroundTest test;
  return fieldtrue::testing::runTest(test, argc, argv);
}

}  // namespace

FIELDTRUE_TEST_PROGRAM(runInApplication)
#include "background_test.moc"
