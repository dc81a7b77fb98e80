#include "calib/core/thread_pool.h"

#include <QTest>
#include <atomic>
#include <chrono>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

#include "tests/support/test_main.h"

using namespace fieldtrue;

class ThreadPoolTest : public QObject {
  Q_OBJECT
 private slots:
  void visitsEveryIndexOnce_data() {
    QTest::addColumn<int>("threads");
    QTest::addColumn<int>("count");
    for (const int threads : {0, 1, 2, 7}) {
      for (const int count : {0, 1, 2, 6, 1000})
        QTest::addRow("%d threads, %d bodies", threads, count) << threads << count;
    }
  }

  void visitsEveryIndexOnce() {
    QFETCH(int, threads);
    QFETCH(int, count);
    std::vector<std::atomic<int>> visits(static_cast<std::size_t>(count));
    threadedFor(threads)(visits.size(), [&](std::size_t i) { ++visits[i]; });
    for (const auto& n : visits) QCOMPARE(n.load(), 1);
  }

  void usesTheThreadsAskedFor() {
    std::mutex mutex;
    std::set<std::thread::id> seen;
    std::atomic<int> arrived = 0;
    // Each body waits for the other, so the loop ends only when two threads are in it.
    threadedFor(2)(2, [&](std::size_t) {
      ++arrived;
      const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
      while (arrived < 2 && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
      const std::lock_guard lock(mutex);
      seen.insert(std::this_thread::get_id());
    });
    QCOMPARE(seen.size(), std::size_t(2));
    QVERIFY(seen.contains(std::this_thread::get_id()));
  }

  void oneThreadIsTheCallersOwn() {
    std::set<std::thread::id> seen;
    threadedFor(1)(50, [&](std::size_t) { seen.insert(std::this_thread::get_id()); });
    QCOMPARE(seen, std::set{std::this_thread::get_id()});
  }

  void loopsInsideBodiesStayOnTheirThread() {
    const ParallelFor parallel = threadedFor(4);
    std::atomic<int> inner = 0;
    std::atomic<bool> strayed = false;
    parallel(8, [&](std::size_t) {
      const auto self = std::this_thread::get_id();
      parallel(5, [&](std::size_t) {
        ++inner;
        if (std::this_thread::get_id() != self) strayed = true;
      });
    });
    QCOMPARE(inner.load(), 40);
    QVERIFY(!strayed);
  }

  void aThrowingBodyEndsTheLoopAndReachesTheCaller() {
    const ParallelFor parallel = threadedFor(3);
    const auto throwing = [](std::size_t i) {
      if (i == 3) throw std::logic_error("three");
    };
    QVERIFY_THROWS_EXCEPTION(std::logic_error, parallel(100, throwing));
    std::atomic<int> after = 0;
    parallel(10, [&](std::size_t) { ++after; });
    QCOMPARE(after.load(), 10);
  }

  void countsThreads() {
    QCOMPARE(threadCount(3), 3);
    QVERIFY(threadCount(0) >= 1);
    QCOMPARE(threadCount(-2), threadCount(0));
  }
};

FIELDTRUE_TEST(ThreadPoolTest)
#include "thread_pool_test.moc"
