#include <sys/resource.h>
#include <sys/wait.h>

#include <QDir>
#include <QTemporaryDir>
#include <QTest>
#include <csignal>

#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

/// `acquire --trace` where the trace cannot be written any more: told when that happens, not at the end of the day.
using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

constexpr rlim_t kMiB = 1 << 20;

/// What was said on stderr until a text came.
bool saysOnStderr(QProcess& process, const QByteArray& text, int timeout_ms = 10000) {
  QElapsedTimer timer;
  timer.start();
  process.setReadChannel(QProcess::StandardError);
  QByteArray heard;
  while (!heard.contains(text) && timer.elapsed() < timeout_ms && process.state() == QProcess::Running) {
    process.waitForReadyRead(500);
    heard += process.readAllStandardError();
  }
  process.setReadChannel(QProcess::StandardOutput);
  return heard.contains(text);
}

}  // namespace

class CliTraceRoomTest : public QObject {
  Q_OBJECT

 private slots:
  void aDiskThatFillsIsToldAtOnce() {
    QProcess process;
    begin(process, at("filling.trace.zip"));
    if (QTest::currentTestFailed()) return;
    // As a disk with so much room left: the kernel refuses what is written beyond.
    const rlimit full{20 * kMiB, 20 * kMiB};
    QCOMPARE(::prlimit(static_cast<pid_t>(process.processId()), RLIMIT_FSIZE, &full, nullptr), 0);
    QVERIFY2(saysOnStderr(process, "filling.trace.zip: its disk has room for 20 MiB, and a trace may need 32"),
             "told while nothing is taken");
    process.write("q\n");
    FT_VERIFY_STATUS(finished(process, 20000), 0);
    QVERIFY(QFileInfo(at("filling.trace.zip")).size() > 0);
  }

  void aFolderThatGoesIsToldAtOnceAndAtTheEnd() {
    QVERIFY(QDir(folder_.path()).mkdir("stick"));
    QProcess process;
    begin(process, at("stick/line.trace.zip"));
    if (QTest::currentTestFailed()) return;
    QVERIFY(QDir(folder_.path()).rmdir("stick"));
    QVERIFY(saysOnStderr(process, "stick/line.trace.zip: its folder does not exist"));
    process.write("q\n");
    const CliRun run = finished(process, 20000);
    FT_VERIFY_STATUS(run, 1);
    QVERIFY2(run.err.contains("line.trace.zip"), run.err.constData());
  }

  void aDiskWithoutRoomIsRefusedBeforeAnythingIsTaken() {
    QProcess process;
    process.setChildProcessModifier([] {
      const rlimit full{20 * kMiB, 20 * kMiB};
      setrlimit(RLIMIT_FSIZE, &full);
    });
    process.start(cliPath(), acquire(at("none.trace.zip")));
    const CliRun run = finished(process, 20000);
    FT_VERIFY_STATUS(run, 2);
    QVERIFY2(run.err.contains("its disk has room for 20 MiB"), run.err.constData());
  }

 private:
  QString at(const QString& name) const { return folder_.filePath(name); }
  QStringList acquire(const QString& trace) {
    return {"acquire",
            "--device",
            "simulated:speed=5",
            "--plan",
            "grid:2x1x1@0.2",
            "--session",
            at(QStringLiteral("%1.fieldtrue").arg(n_sessions_++)),
            "--trace",
            trace};
  }
  void begin(QProcess& process, const QString& trace) {
    process.start(cliPath(), acquire(trace));
    QVERIFY(waitForLine(process, "^Next: A1").hasMatch());
  }

  QTemporaryDir folder_;
  int n_sessions_ = 0;
};

FIELDTRUE_TEST(CliTraceRoomTest)
#include "cli_trace_room_test.moc"
