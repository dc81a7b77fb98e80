#include <signal.h>

#include <QElapsedTimer>
#include <QFileInfo>
#include <QRegularExpression>
#include <QTemporaryDir>
#include <QTest>
#include <set>

#include "acquisition/session/session_store.h"
#include "calib/tables/table_io.h"
#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

/// Recording with the simulated tracker and with an emulated one over TCP and a pty.
using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

CalibrationTable tableOf(const QString& path) {
  const auto reading = readNodeTable(std::filesystem::path(path.toStdString()));
  return reading ? reading->table : CalibrationTable{};
}

}  // namespace

class CliAcquireTest : public QObject {
  Q_OBJECT
 private slots:
  void initTestCase() { QVERIFY2(QFileInfo(cliPath()).isExecutable(), qPrintable(cliPath() + " is not built")); }

  void aWholeSessionByItself() {
    const QString session = at("auto.fieldtrue");
    const CliRun run = runCli({"acquire", "--device", "simulated:speed=20", "--plan", "grid:3x3x2@0.15", "--auto",
                               "--samples-per-node", "20", "--session", session});
    FT_VERIFY_STATUS(run, 0);
    QVERIFY2(run.out.contains("done 18 of 18"), run.out.constData());
    QVERIFY(QRegularExpression(
                "^C3, pipe 2  \\(-?\\d+\\.\\d\\d m, -?\\d+\\.\\d\\d m, -?\\d+\\.\\d\\d m\\)  done \\d+ of 18, SD "
                "<?\\d+(\\.\\d+)? mm",
                QRegularExpression::MultilineOption)
                .match(QString::fromUtf8(run.out))
                .hasMatch());
    FT_VERIFY_STATUS(
        runCli({"tables", "--session", session, "--nodes", at("a.nodes.csv"), "--samples", at("a.samples.csv")}), 0);
    const CalibrationTable table = tableOf(at("a.nodes.csv"));
    QCOMPARE(table.nodes.size(), std::size_t(18));
    std::set<int> places;
    for (const Node& node : table.nodes) {
      places.insert(node.node);
      QVERIFY(node.n_used + node.n_rejected >= 20);
    }
    QCOMPARE(places.size(), std::size_t(18));
    const auto samples = readSampleTable(std::filesystem::path(at("a.samples.csv").toStdString()));
    FT_VERIFY_OK(samples);
    QVERIFY(samples->table.rows.size() >= 360);
    FT_VERIFY_STATUS(runCli({"report", "--session", session, "--methods", "rigid,affine", "--html", at("a.html")}), 0);
    QVERIFY(readWhole(at("a.html")).contains("auto.fieldtrue"));
  }

  void anInterruptedSessionIsResumed() {
    const QString session = at("stopped.fieldtrue");
    const QStringList arguments = {"acquire",         "--device", "simulated:speed=10", "--plan",
                                   "grid:3x3x3@0.15", "--auto",   "--samples-per-node", "20",
                                   "--session",       session};
    QProcess process;
    process.start(cliPath(), arguments);
    QVERIFY(waitForLine(process, "done 3 of 27").hasMatch());
    QCOMPARE(::kill(static_cast<pid_t>(process.processId()), SIGINT), 0);
    const CliRun stopped = finished(process, 20000);
    FT_VERIFY_STATUS(stopped, 0);
    FT_VERIFY_STATUS(runCli({"tables", "--session", session, "--nodes", at("s.nodes.csv")}), 0);
    const CalibrationTable before = tableOf(at("s.nodes.csv"));
    QVERIFY(before.nodes.size() >= 3 && before.nodes.size() < 27);
    const CliRun resumed = runCli(arguments);
    FT_VERIFY_STATUS(resumed, 0);
    QVERIFY2(resumed.out.contains("Resuming: " + QByteArray::number(before.nodes.size()) + " of 27 done"),
             resumed.out.constData());
    FT_VERIFY_STATUS(runCli({"tables", "--session", session, "--nodes", at("s.nodes.csv")}), 0);
    const CalibrationTable after = tableOf(at("s.nodes.csv"));
    QCOMPARE(after.nodes.size(), std::size_t(27));
    for (const Node& kept : before.nodes) {
      const auto same = std::find_if(after.nodes.begin(), after.nodes.end(),
                                     [&](const Node& node) { return node.node == kept.node; });
      QVERIFY(same != after.nodes.end());
      FT_VERIFY_MATCH(sameBits(same->tracker_from_sensor, kept.tracker_from_sensor));
    }
  }

  void anotherPlanIsNotMixedIn() {
    const QString session = at("plan.fieldtrue");
    const QStringList start = {
        "acquire", "--device", "simulated:speed=20", "--auto", "--samples-per-node", "5", "--session",
        session,   "--plan"};
    FT_VERIFY_STATUS(runCli(start + QStringList{"grid:2x1x1@0.2"}), 0);
    const CliRun other = runCli(start + QStringList{"grid:2x2x1@0.2"});
    FT_VERIFY_STATUS(other, 1);
    FT_VERIFY_MATCH(holdsAll(other.err.toStdString(), {"another plan"}));
    FT_VERIFY_STATUS(runCli(start + QStringList{"grid:2x1x1@0.2"}), 0);
  }

  void theOperatorTakesSkipsAndTakesBack() {
    const QString session = at("hand.fieldtrue");
    QProcess process;
    process.start(cliPath(), {"acquire", "--device", "simulated:speed=20", "--plan", "grid:3x1x1@0.2",
                              "--samples-per-node", "10", "--session", session});
    QVERIFY(waitForLine(process, "^Next: A1").hasMatch());
    process.write("\n");
    QVERIFY(waitForLine(process, "^A1.*done 1 of 3").hasMatch());
    process.write("u\n");
    QVERIFY(waitForLine(process, "^Next: A1").hasMatch());
    process.write("s\n");
    QVERIFY(waitForLine(process, "^Next: B1").hasMatch());
    process.write("x\n");
    QVERIFY(waitForLine(process, "'x' is not known").hasMatch());
    process.write("\n");
    QVERIFY(waitForLine(process, "^B1.*done 1 of 3").hasMatch());
    process.write("q\n");
    const CliRun run = finished(process, 20000);
    FT_VERIFY_STATUS(run, 0);
    QVERIFY2(run.out.contains("1 of 3 places done, 1 skipped"), run.out.constData());
  }

  void enterBeforeTheTrackerRunsIsKept() {
    QProcess process;
    process.start(cliPath(), {"acquire", "--device", "simulated:speed=20", "--plan", "grid:1x1x1@0.2",
                              "--samples-per-node", "10", "--session", at("early.fieldtrue")});
    process.write("\n");
    QVERIFY(waitForLine(process, "^A1.*done 1 of 1").hasMatch());
    FT_VERIFY_STATUS(finished(process, 20000), 0);
  }

  void anEmulatedTrackerOverTcp() {
    QProcess emulator;
    emulator.start(cliPath(), {"emulate", "fastrak", "--listen", "0", "--duration", "120"});
    const auto line = waitForLine(emulator, "device (fastrak:tcp:\\S+:\\d+)");
    QVERIFY(line.hasMatch());
    const QString session = at("tcp.fieldtrue");
    recordByHand(line.captured(1), session);
    QCOMPARE(::kill(static_cast<pid_t>(emulator.processId()), SIGTERM), 0);
    const CliRun run = finished(emulator, 20000);
    FT_VERIFY_STATUS(run, 0);
    QVERIFY2(run.out.contains("records sent"), run.out.constData());
    FT_VERIFY_STATUS(runCli({"tables", "--session", session, "--nodes", at("tcp.nodes.csv")}), 0);
    QCOMPARE(tableOf(at("tcp.nodes.csv")).nodes.size(), std::size_t(1));
  }

  void aRecordingIsPlayedOverAPty() {
    // A sensor that stands at one exactly known pose.
    QByteArray recording = "node,sensor,visit,t_s,x_m,y_m,z_m,qw,qx,qy,qz,status\n";
    for (int i = 0; i < 3000; ++i) {
      recording += "-1,0,0," + QByteArray::number(i * 0.01, 'f', 2) + ",0.4,-0.127,0.0635,1,0,0,0,\n";
    }
    QVERIFY(writeWhole(at("still.samples.csv"), recording));
    QProcess emulator;
    const QString link = at("fastrak");
    emulator.start(cliPath(), {"emulate", "fastrak", "--pty", link, "--replay", at("still.samples.csv")});
    QVERIFY(waitForLine(emulator, "emulator at").hasMatch());
    QVERIFY(QFileInfo(link).isSymLink());
    const QString session = at("pty.fieldtrue");
    recordByHand("fastrak:" + link, session);
    QCOMPARE(::kill(static_cast<pid_t>(emulator.processId()), SIGINT), 0);
    FT_VERIFY_STATUS(finished(emulator, 20000), 0);
    QVERIFY(!QFileInfo(link).isSymLink());
    FT_VERIFY_STATUS(runCli({"tables", "--session", session, "--nodes", at("pty.nodes.csv")}), 0);
    const CalibrationTable table = tableOf(at("pty.nodes.csv"));
    QCOMPARE(table.nodes.size(), std::size_t(1));
    FT_VERIFY_MATCH(
        near(table.nodes.front().tracker_from_sensor.position_m, Eigen::Vector3d(0.4, -0.127, 0.0635), 1e-6));
  }

  void aLineIsPlayedAgain() {
    const QString trace = at("line.trace.zip");
    const CliRun first = runCli({"acquire", "--device", "simulated:speed=20", "--plan", "grid:2x1x1@0.2", "--auto",
                                 "--samples-per-node", "20", "--session", at("first.fieldtrue"), "--trace", trace});
    FT_VERIFY_STATUS(first, 0);
    QVERIFY2(first.out.contains("bytes are in " + trace.toUtf8()), first.out.constData());
    // The same line, the same readings at the same two places: the same takes.
    const CliRun again = runCli({"acquire", "--device", "trace:" + trace + ",rate=20", "--plan", "grid:2x1x1@0.2",
                                 "--auto", "--samples-per-node", "20", "--session", at("again.fieldtrue")});
    FT_VERIFY_STATUS(again, 0);
    QVERIFY2(again.out.contains("done 2 of 2"), again.out.constData());
    // It ends with the recording.
    const CliRun over = runCli({"acquire", "--device", "trace:" + trace + ",rate=1000", "--plan", "grid:4x4x4@0.2",
                                "--auto", "--samples-per-node", "2000", "--session", at("over.fieldtrue")});
    FT_VERIFY_STATUS(over, 1);
    QVERIFY2(over.err.contains("at its end"), over.err.constData());
    // Cut off.
    QVERIFY(writeWhole(at("cut.trace.zip"), readWhole(trace).chopped(100)));
    const CliRun cut = runCli({"acquire", "--device", "trace:" + at("cut.trace.zip"), "--plan", "grid:2x1x1@0.2",
                               "--auto", "--session", at("cut.fieldtrue")});
    FT_VERIFY_STATUS(cut, 1);
    QCOMPARE(cut.err.trimmed().count('\n'), 0);
    QVERIFY2(cut.err.contains("cut.trace.zip"), cut.err.constData());
    QVERIFY(!QFileInfo::exists(at("cut.fieldtrue")));
  }

  void aLineThatFailsIsWritten() {
    QProcess emulator;
    emulator.start(cliPath(),
                   {"emulate", "fastrak", "--listen", "0", "--faults", "unplug_after=100", "--duration", "120"});
    const auto line = waitForLine(emulator, "device (fastrak:tcp:\\S+:\\d+)");
    QVERIFY(line.hasMatch());
    const CliRun run = runCli({"acquire", "--device", line.captured(1), "--plan", "grid:4x4x4@0.2", "--auto",
                               "--session", at("lost.fieldtrue"), "--trace", at("lost.trace.zip"), "--reconnect", "2"});
    FT_VERIFY_STATUS(run, 1);
    QVERIFY2(run.err.contains("Tracker lost - reconnecting"), run.err.constData());
    QVERIFY2(run.err.contains("did not come back within 2 s"), run.err.constData());
    QVERIFY(QFileInfo(at("lost.trace.zip")).size() > 1000);
    QCOMPARE(::kill(static_cast<pid_t>(emulator.processId()), SIGTERM), 0);
    FT_VERIFY_STATUS(finished(emulator, 20000), 0);
  }

  void takesByTimeAndByError() {
    const QStringList command = {"acquire", "--device", "simulated:speed=20", "--plan", "grid:2x1x1@0.2", "--auto"};
    const auto run = [&](const QStringList& more) { return runCli(command + more); };
    // A second of the simulated tracker, at 120 readings a second, both ends; a busy machine moves arrivals.
    const CliRun timed = run({"--until", "1s", "--session", at("timed.fieldtrue")});
    FT_VERIFY_STATUS(timed, 0);
    const int samples =
        QRegularExpression("(\\d+) samples worth ").match(QString::fromUtf8(timed.out)).captured(1).toInt();
    QVERIFY2(std::abs(samples - 121) <= 6, timed.out.constData());
    const CliRun known = run({"--until", "0.5mm", "--session", at("known.fieldtrue")});
    FT_VERIFY_STATUS(known, 0);
    QVERIFY2(known.out.contains("30 samples worth "), known.out.constData());
    const CliRun wrong = run({"--until", "5kg", "--session", at("none.fieldtrue")});
    FT_VERIFY_STATUS(wrong, 2);
    QVERIFY2(wrong.err.contains("'5kg' is no length of a take"), wrong.err.constData());
    FT_VERIFY_STATUS(run({"--until", "1s", "--samples-per-node", "20", "--session", at("none.fieldtrue")}), 2);
    QVERIFY(!QFileInfo::exists(at("none.fieldtrue")));
  }

  void aResumedSessionGoesOnWithItsOwnLength() {
    const QString session = at("length.fieldtrue");
    const auto run = [&](const QStringList& more) {
      const CliRun done = runCli(QStringList{"acquire", "--device", "simulated:speed=20", "--plan", "grid:1x1x1@0.2",
                                             "--auto", "--session", session} +
                                 more);
      const auto store = acquisition::SessionStore::open(session);
      return done.status == 0 && store ? store->state("take_length").value_or("unread") : "failed";
    };
    QCOMPARE(run({"--until", "0.5s"}), std::string("0.5s"));
    QCOMPARE(run({}), std::string("0.5s"));
    QCOMPARE(run({"--samples-per-node", "20"}), std::string("20"));
  }

  void aTrackerThatComesBackGoesOn() {
    const QString link = at("returning");
    const auto plugIn = [&link](QProcess& emulator, const QStringList& faults) {
      emulator.start(cliPath(), QStringList{"emulate", "fastrak", "--pty", link, "--duration", "120"} + faults);
      QVERIFY(waitForLine(emulator, "device fastrak").hasMatch());
    };
    QProcess first, second, acquire;
    plugIn(first, {"--faults", "unplug_after=400"});
    acquire.setProcessChannelMode(QProcess::MergedChannels);
    acquire.start(cliPath(), {"acquire", "--device", "fastrak:" + link, "--plan", "grid:2x1x1@0.2", "--auto",
                              "--samples-per-node", "100", "--session", at("returned.fieldtrue")});
    QVERIFY(waitForLine(acquire, "Tracker lost - reconnecting: (.*)").hasMatch());
    QCOMPARE(::kill(static_cast<pid_t>(first.processId()), SIGTERM), 0);
    FT_VERIFY_STATUS(finished(first, 20000), 0);
    plugIn(second, {});
    QVERIFY(waitForLine(acquire, "Tracker is back: .*Fastrak").hasMatch());
    FT_VERIFY_STATUS(finished(acquire, 120000), 0);
    QCOMPARE(::kill(static_cast<pid_t>(second.processId()), SIGTERM), 0);
    FT_VERIFY_STATUS(finished(second, 20000), 0);
  }

  void listsAreMachineReadable_data() {
    QTest::addColumn<QString>("command");
    QTest::addColumn<QString>("list");
    QTest::addColumn<QString>("id");
    QTest::newRow("methods") << "methods"
                             << "position"
                             << "hmq";
    QTest::newRow("orientation") << "methods"
                                 << "orientation"
                                 << "hmq_matrix";
    QTest::newRow("effects") << "effects"
                             << "effects"
                             << "metal_plane";
    QTest::newRow("devices") << "devices"
                             << "devices"
                             << "simulated";
  }

  void listsAreMachineReadable() {
    QFETCH(QString, command);
    QFETCH(QString, list);
    QFETCH(QString, id);
    const CliRun run = runCli({command, "--json"});
    FT_VERIFY_STATUS(run, 0);
    const auto rows = run.json().at(list.toStdString());
    const bool found =
        std::any_of(rows.begin(), rows.end(), [&](const auto& row) { return row.at("id") == id.toStdString(); });
    QVERIFY(found);
    const CliRun people = runCli({command});
    FT_VERIFY_STATUS(people, 0);
    QVERIFY(people.out.contains(id.toUtf8()));
  }

 private:
  QString at(const QString& name) const { return folder_.filePath(name); }

  /// Records the only place of a plan by pressing Enter.
  void recordByHand(const QString& device, const QString& session) {
    QProcess process;
    process.start(cliPath(), {"acquire", "--device", device, "--plan", "grid:1x1x1@0.2", "--samples-per-node", "20",
                              "--session", session});
    QVERIFY2(waitForLine(process, "^Next: A1").hasMatch(), process.readAllStandardError().constData());
    process.write("\n");
    const CliRun run = finished(process, 60000);
    FT_VERIFY_STATUS(run, 0);
    QVERIFY2(run.out.contains("done 1 of 1"), run.out.constData());
  }

  QTemporaryDir folder_;
};

FIELDTRUE_TEST(CliAcquireTest)
#include "cli_acquire_test.moc"
