#include <sys/resource.h>

#include <QFileInfo>
#include <QProcess>
#include <QTemporaryDir>
#include <QTest>
#include <filesystem>

#include "calib/tables/table_io.h"
#include "calib/tables/table_writer.h"
#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

/// No command ends without a sentence: what does not fit into memory, and what is thrown.
using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

QByteArray sizeOfProgram_kb(qint64 pid) {
  for (const QByteArray& line : readWhole(QString("/proc/%1/status").arg(pid)).split('\n'))
    if (line.startsWith("VmPeak:")) return line.mid(7).trimmed().split(' ').first();
  return {};
}

}  // namespace

class CliBarrierTest : public QObject {
  Q_OBJECT

  QTemporaryDir folder_;
  QString at(const QString& name) const { return folder_.filePath(name); }

  CliRun runWith(const QString& variable, const QString& value, const QStringList& arguments, rlim_t limit_bytes = 0) {
    QProcess process;
    QProcessEnvironment environment = QProcessEnvironment::systemEnvironment();
    environment.insert(variable, value);
    process.setProcessEnvironment(environment);
    if (limit_bytes > 0)
      process.setChildProcessModifier([limit_bytes] {
        // ctest takes the stack's limit away, and without one addresses are given out in another way.
        const rlimit stack{8 << 20, RLIM_INFINITY};
        ::setrlimit(RLIMIT_STACK, &stack);
        const rlimit limit{limit_bytes, limit_bytes};
        ::setrlimit(RLIMIT_AS, &limit);
      });
    process.start(cliPath(), arguments);
    process.closeWriteChannel();
    return finished(process, 300000);
  }

 private slots:
  void initTestCase() {
    QVERIFY2(QFileInfo(cliPath()).isExecutable(), qPrintable(cliPath() + " is not built"));
    SyntheticOptions options;
    options.smooth_distortion_m = 0.02;
    options.counts = {8, 8, 7};
    FT_VERIFY_OK(writeNodeTable(std::filesystem::path(at("some.csv").toStdString()), syntheticTable(options)));
    options.counts = {4, 4, 3};
    options.orientations = 6;
    FT_VERIFY_OK(writeNodeTable(std::filesystem::path(at("turned.csv").toStdString()), syntheticTable(options)));
    options.orientations = 1;
    options.counts = {20, 20, 15};
    FT_VERIFY_OK(writeNodeTable(std::filesystem::path(at("many.csv").toStdString()), syntheticTable(options)));
  }

  void aFitBeyondMemoryIsRefused() {
    const CliRun run = runWith("FIELDTRUE_MEMORY_MIB", "1",
                               {"fit", "--nodes", at("some.csv"), "--position", "hmq", "--out", at("no.ftcal.json")});
    FT_VERIFY_STATUS(run, 1);
    QCOMPARE(run.out, QByteArray());
    QCOMPARE(run.err.count('\n'), qsizetype{1});
    FT_VERIFY_MATCH(holdsAll(run.err.toStdString(),
                             {"Hardy's multiquadric on 448 places needs about 14 MiB", "80 % of the 1 MiB"}));
    QVERIFY(!QFileInfo::exists(at("no.ftcal.json")));
  }

  void posesBeyondMemoryLeavePositionAlone() {
    const CliRun run = runWith(
        "FIELDTRUE_MEMORY_MIB", "1",
        {"fit", "--nodes", at("turned.csv"), "--position", "gaussian_process", "--out", at("position.ftcal.json")});
    FT_VERIFY_STATUS(run, 0);
    FT_VERIFY_MATCH(
        holdsAll(run.out.toStdString(),
                 {"Position alone: A Gaussian process over poses on 288 places needs about", "80 % of the 1 MiB"}));
  }

  void theComparisonSkipsIt() {
    const CliRun run = runWith("FIELDTRUE_MEMORY_MIB", "1",
                               {"compare", "--nodes", at("some.csv"), "--methods", "none,affine,hmq", "--json"});
    FT_VERIFY_STATUS(run, 0);
    const nlohmann::json position = run.json().at("position");
    QVERIFY(position.at(1).at("skipped").is_null());
    FT_VERIFY_MATCH(holdsAll(position.at(2).at("skipped").get<std::string>(), {"80 % of the 1 MiB"}));
  }

  void memoryThatIsNotThereIsOneSentence_data() {
    QTest::addColumn<qint64>("room_mib");
    // A matrix of 6,000 x 6,000 numbers takes 144 MB even in single precision.
#ifdef __SANITIZE_ADDRESS__
    QSKIP("Under the address sanitizer it is the sanitizer that runs out of memory.");
#else
    QTest::newRow("room for everything but the matrix") << qint64{100};
    // Idle, the program reserves more than it needs; a worker of the algebra library then finds no room for its buffer.
    QTest::newRow("no room for the algebra library's buffers either") << qint64{-50};
#endif
  }

  /// The system itself refuses: the estimate was told that there is plenty.
  void memoryThatIsNotThereIsOneSentence() {
    QFETCH(const qint64, room_mib);
    QProcess idle;
    idle.start(cliPath(), {"emulate", "fastrak", "--listen", "0"});
    QVERIFY(idle.waitForReadyRead(30000));
    const qint64 program_kb = sizeOfProgram_kb(idle.processId()).toLongLong();
    idle.terminate();
    QVERIFY(idle.waitForFinished(30000));
    QVERIFY(program_kb > 0);
    // What the idle program has reserved depends on how far its threads have come: where even its libraries find no
    // room, or OpenBLAS none for its threads, which ends the program before main, it did not begin, and gets more.
    constexpr int kDidNotBegin = 127;
    constexpr qint64 kStep_mib = 16, kMost_mib = 160;
    CliRun run;
    for (qint64 more_mib = 0; more_mib <= kMost_mib; more_mib += kStep_mib) {
      run = runWith("FIELDTRUE_MEMORY_MIB", "1000000",
                    {"fit", "--threads", "1", "--nodes", at("many.csv"), "--position", "hmq:r2_cm2=100", "--out",
                     at("none.ftcal.json")},
                    static_cast<rlim_t>(1024 * (program_kb + 1024 * (room_mib + more_mib))));
      if (run.status != kDidNotBegin && !run.err.contains("blas_thread_init")) break;
    }
    FT_VERIFY_STATUS(run, 1);
    QCOMPARE(run.err.count('\n'), qsizetype{1});
    FT_VERIFY_MATCH(holdsAll(run.err.toStdString(), {"not enough memory", "no file was left half written"}));
    QVERIFY(!QFileInfo::exists(at("none.ftcal.json")));
  }

  /// A name on this system need not be UTF-8; JSON must be.
  void aNameInAnotherEncodingIsNoEnd() {
    const CliRun run = runCli({"methods", "--json"});
    FT_VERIFY_STATUS(run, 0);
    QProcess shell;
    shell.start(
        "/bin/sh",
        {"-c", "exec \"$0\" fit --json --nodes \"$1\" --position affine --out \"$2/$(printf 'a\\351.ftcal.json')\"",
         cliPath(), at("some.csv"), folder_.path()});
    const CliRun named = finished(shell, 60000);
    FT_VERIFY_STATUS(named, 0);
    QVERIFY(named.json().is_object());
    // Qt cannot name it either, and so would leave the folder behind.
    QVERIFY(std::filesystem::remove(folder_.path().toStdString() + "/a\351.ftcal.json"));
  }
};

FIELDTRUE_TEST(CliBarrierTest)
#include "cli_barrier_test.moc"
