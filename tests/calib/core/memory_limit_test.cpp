#include "calib/core/memory_limit.h"

#include <QTemporaryDir>
#include <QTest>
#include <atomic>
#include <fstream>
#include <thread>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;

namespace {

constexpr double kMiB = 1048576.0;

/// A file system of the test's own making.
class FakeRoot {
 public:
  FakeRoot& with(const std::string& path, const std::string& text) {
    const std::filesystem::path file = root() / path;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text;
    return *this;
  }
  std::filesystem::path root() const { return folder_.path().toStdString(); }
  double available_mib() const { return availableMemory_bytes(root()).value_or(-kMiB) / kMiB; }

 private:
  QTemporaryDir folder_;
};

const std::string kMemInfo = "MemTotal:       16000000 kB\nMemFree:  1 kB\nMemAvailable:    2048000 kB\n";  // 2000 MiB

}  // namespace

class MemoryLimitTest : public QObject {
  Q_OBJECT
 private slots:
  void init() { qunsetenv("FIELDTRUE_MEMORY_MIB"); }
  void cleanup() { qunsetenv("FIELDTRUE_MEMORY_MIB"); }

  void asksTheSystem() {
    QVERIFY(!availableMemory_bytes(FakeRoot().root()).has_value());
    QCOMPARE(FakeRoot().with("proc/meminfo", kMemInfo).available_mib(), 2000.0);
    QVERIFY(availableMemory_bytes().value_or(0.0) > kMiB);
  }

  void theVariableOverrides() {
    qputenv("FIELDTRUE_MEMORY_MIB", "12.5");
    QCOMPARE(FakeRoot().with("proc/meminfo", kMemInfo).available_mib(), 12.5);
    qputenv("FIELDTRUE_MEMORY_MIB", "much");
    QCOMPARE(FakeRoot().with("proc/meminfo", kMemInfo).available_mib(), 2000.0);
  }

  void aControlGroupLeavesLess() {
    FakeRoot root;
    root.with("proc/meminfo", kMemInfo).with("proc/self/cgroup", "0::/slice/job\n");
    QCOMPARE(root.available_mib(), 2000.0);
    // The limit stands on the group above; 100 MiB of what it uses are pages of files that nobody needs.
    root.with("sys/fs/cgroup/slice/job/memory.max", "max\n").with("sys/fs/cgroup/slice/job/memory.current", "5\n");
    root.with("sys/fs/cgroup/slice/memory.max", "1048576000\n")
        .with("sys/fs/cgroup/slice/memory.current", "419430400\n");
    root.with("sys/fs/cgroup/slice/memory.stat", "anon 7\ninactive_file 104857600\n");
    QCOMPARE(root.available_mib(), 1000.0 - 400.0 + 100.0);
  }

  void anOldControlGroupToo() {
    FakeRoot root;
    root.with("proc/meminfo", kMemInfo).with("proc/self/cgroup", "5:cpu:/a\n4:memory:/in/a/container\n0::/\n");
    // The container sees its group at the top.
    root.with("sys/fs/cgroup/memory/memory.limit_in_bytes", "524288000\n");
    root.with("sys/fs/cgroup/memory/memory.usage_in_bytes", "104857600\n");
    QCOMPARE(root.available_mib(), 400.0);
  }

  void refusesAboveFourFifths() {
    qputenv("FIELDTRUE_MEMORY_MIB", "100");
    QVERIFY(checkMemory("The work", 80.0 * kMiB));
    const auto refused = checkMemory("The work", 80.5 * kMiB);
    QVERIFY(!refused && refused.error().code == ErrorCode::kUnsupported);
    FT_VERIFY_MATCH(testing::holdsAll(refused.error().message, {"The work needs about 81 MiB", "80 % of the 100 MiB"}));
    const auto alone = MemoryBooking::book("The work", 80.5 * kMiB, {});
    QVERIFY(!alone);
    QCOMPARE(alone.error().message, refused.error().message);
  }

  void workSideBySideTakesTurns() {
    qputenv("FIELDTRUE_MEMORY_MIB", "100");
    std::atomic<int> at_once = 0, most = 0, refused = 0;
    {
      std::vector<std::jthread> threads;
      for (int i = 0; i < 6; ++i)
        threads.emplace_back([&] {
          const auto booking = MemoryBooking::book("One of six", 35.0 * kMiB, {});
          if (!booking) ++refused;
          const int now = ++at_once;
          for (int seen = most; now > seen && !most.compare_exchange_weak(seen, now);) {
          }
          std::this_thread::sleep_for(std::chrono::milliseconds(20));
          --at_once;
        });
    }
    QCOMPARE(refused.load(), 0);
    QVERIFY2(most <= 2, "two of 35 MiB fit into 80, a third does not");
    // All is given back.
    QVERIFY(MemoryBooking::book("The next", 79.0 * kMiB, {}).has_value());
    QVERIFY(MemoryBooking::book("The next", 79.0 * kMiB, {}).has_value());
  }

  void whoWaitsCanBeStopped() {
    qputenv("FIELDTRUE_MEMORY_MIB", "100");
    const auto first = MemoryBooking::book("The first", 70.0 * kMiB, {});
    QVERIFY(first.has_value());
    std::stop_source stop;
    std::jthread stopper([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(30));
      stop.request_stop();
    });
    const auto second = MemoryBooking::book("The second", 70.0 * kMiB, stop.get_token());
    QVERIFY(!second && second.error().code == ErrorCode::kCancelled);
  }
};

FIELDTRUE_TEST(MemoryLimitTest)
#include "memory_limit_test.moc"
