#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <QTest>

#include "acquisition/session/session_store.h"
#include "tests/acquisition/session/session_folder.h"
#include "tests/acquisition/session/session_samples.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::acquisition;
using testing::fullMetadata;
using testing::kSamples;
using testing::newStore;
using testing::opened;
using testing::sameSamples;
using testing::samplesOf;
using testing::smallPlan;
using testing::storeTake;

/// What is left of a session when the disk or the program fails.
class SessionCrashTest : public QObject {
  Q_OBJECT

  testing::SessionFolder folder_;

 private slots:
  void fullDiskStoresNothingOfTheTake() {
    const QString path = folder_.newPath();
    {
      SessionStore store = newStore(path);
      FT_VERIFY_OK(storeTake(store, 0, 1));
      FT_VERIFY_OK(store.limitSize(1));
      bool full = false;
      for (int take = 2; take < 50 && !full; ++take) {
        const std::size_t n_before = store.nodeTable().value().nodes.size();
        const auto stored = storeTake(store, std::size_t(take % 12), take);
        full = !stored;
        if (full) {
          QVERIFY(stored.error().code == ErrorCode::kIo);
          FT_VERIFY_MATCH(testing::holdsAll(stored.error().message, {"disk is full"}));
          QCOMPARE(store.nodeTable().value().nodes.size(), n_before);
          QCOMPARE(store.sampleTable().value().rows.size(), n_before * kSamples);
        }
      }
      QVERIFY(full);
      FT_VERIFY_OK(store.limitSize(1 << 30));
      FT_VERIFY_OK(storeTake(store, 11, 99));
    }
    SessionStore store = opened(path);
    QVERIFY(sameSamples(store.samples(0).value(), samplesOf(1)));
    QVERIFY(sameSamples(store.samples(11).value(), samplesOf(99)));
    QCOMPARE(store.sampleTable().value().rows.size(), store.nodeTable().value().nodes.size() * kSamples);
  }

  /// The system itself refuses to let the file grow: the write fails in the middle of a take.
  void refusedWriteStoresNothingOfTheTake() {
    const QString path = folder_.newPath();
    { SessionStore store = newStore(path); }
    const pid_t child = fork();
    if (child == 0) {
      signal(SIGXFSZ, SIG_IGN);
      auto store = SessionStore::open(path);
      const rlimit limit{100000, 100000};
      if (!store || setrlimit(RLIMIT_FSIZE, &limit) != 0) _exit(2);
      std::size_t n_stored = 0;
      for (int take = 0; take < 60; ++take) {
        if (storeTake(*store, std::size_t(take % 12), take)) {
          ++n_stored;
        } else {
          const bool whole =
              store->sampleTable().value().rows.size() == store->nodeTable().value().nodes.size() * kSamples;
          _exit(whole && n_stored > 0 ? 0 : 3);
        }
      }
      _exit(4);
    }
    int status = -1;
    waitpid(child, &status, 0);
    QVERIFY(WIFEXITED(status));
    QCOMPARE(WEXITSTATUS(status), 0);
    SessionStore store = opened(path);
    QVERIFY(!store.nodeTable().value().nodes.empty());
    QCOMPARE(store.sampleTable().value().rows.size(), store.nodeTable().value().nodes.size() * kSamples);
    FT_VERIFY_OK(storeTake(store, 0, 1));
  }

  /// Kills a program that stores takes at any moment: all takes it was told of are there, whole, and at most one more.
  void killedProgramLosesAtMostTheTakeInProgress() {
    const QString path = folder_.newPath();
    { SessionStore store = newStore(path); }
    std::mt19937_64 random(11);
    for (int round = 0; round < 15; ++round) {
      const int n_before = countTakes(path);
      int pipes[2];
      QVERIFY(pipe(pipes) == 0);
      const pid_t child = fork();
      if (child == 0) {
        auto store = SessionStore::open(path);
        if (!store) _exit(1);
        for (int take = 0;; ++take) {
          if (!storeTake(*store, std::size_t(take % 12), take)) _exit(1);
          if (write(pipes[1], "x", 1) != 1) _exit(1);
        }
      }
      ::close(pipes[1]);
      char byte = 0;
      QVERIFY(read(pipes[0], &byte, 1) == 1);
      usleep(static_cast<useconds_t>(random() % 20000));
      ::kill(child, SIGKILL);
      waitpid(child, nullptr, 0);
      int n_told = 1;
      while (read(pipes[0], &byte, 1) == 1) ++n_told;
      ::close(pipes[0]);
      const int n_kept = countTakes(path) - n_before;
      QVERIFY2(n_kept == n_told || n_kept == n_told + 1,
               qPrintable(QString("%1 kept, %2 told").arg(n_kept).arg(n_told)));
    }
  }

 private:
  /// Undo steps of a session: every take stored, superseded ones too; checks that each is whole on the way.
  int countTakes(const QString& path) {
    int n_takes = 0;
    SessionStore store = opened(path);
    while (store.canUndo().value()) {
      const CalibrationTable table = store.nodeTable().value();
      for (const Node& node : table.nodes) {
        if (node.n_used + node.n_rejected != kSamples) qFatal("a take is not whole");
      }
      const auto place = store.undo();
      if (!place) qFatal("%s", place.error().message.c_str());
      ++n_takes;
    }
    for (int i = 0; i < n_takes; ++i) {
      const auto place = store.redo();
      if (!place || store.samples(**place).value().size() != kSamples) qFatal("a take is not whole");
    }
    return n_takes;
  }
};

FIELDTRUE_TEST(SessionCrashTest)
#include "session_crash_test.moc"
