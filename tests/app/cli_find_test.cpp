#include <QElapsedTimer>
#include <QProcess>
#include <QTemporaryDir>
#include <QTest>
#include <csignal>
#include <nlohmann/json.hpp>

#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue::testing;

/// Which tracker is on which line, asked of emulators.
class CliFindTest : public QObject {
  Q_OBJECT
 private slots:
  void findsWhatIsThere();
  void saysWhyNot();
  void canBeStopped();

 private:
  QTemporaryDir folder_;
};

void CliFindTest::findsWhatIsThere() {
  QProcess fastrak, server;
  const QString link = folder_.filePath("fastrak");
  fastrak.start(cliPath(), {"emulate", "fastrak", "--pty", link, "--sensors", "2", "--duration", "120"});
  QVERIFY(waitForLine(fastrak, "emulator at").hasMatch());
  server.start(cliPath(), {"emulate", "openigtlink", "--listen", "0", "--duration", "120"});
  const auto listening = waitForLine(server, "emulator at (tcp:\\S+:\\d+)");
  QVERIFY(listening.hasMatch());
  const QString port = listening.captured(1);
  const CliRun run = runCli({"find", "--line", link, "--line", port, "--line", "/dev/ttyUSB77", "--json"});
  FT_VERIFY_STATUS(run, 0);
  const auto answer = nlohmann::json::parse(run.out.toStdString());
  QVERIFY(answer["schema"] == "fieldtrue.find/1");
  const auto& lines = answer["lines"];
  QCOMPARE(lines.size(), std::size_t{3});
  QVERIFY2(lines[0]["tracker"]["device"] == "fastrak:" + link.toStdString(), lines.dump().c_str());
  QVERIFY2(lines[0]["tracker"]["firmware"] == "G1.02", lines.dump().c_str());
  QVERIFY2(lines[0]["tracker"]["sensors"] == nlohmann::json({1, 2}), lines.dump().c_str());
  QVERIFY2(lines[1]["tracker"]["device"] == "openigtlink:" + port.mid(4).toStdString(), lines.dump().c_str());
  QVERIFY2(lines[1]["tracker"]["sensor_names"] == nlohmann::json::array({"Sensor1"}), lines.dump().c_str());
  QVERIFY(lines[2]["tracker"].is_null());
  FT_VERIFY_MATCH(holdsAll(lines[2]["text"].get<std::string>(), {"/dev/ttyUSB77", "does not exist"}));
  // What was found can be recorded with, so it is written as a device.
  const CliRun in_words = runCli({"find", "--line", link});
  FT_VERIFY_STATUS(in_words, 0);
  FT_VERIFY_MATCH(holdsAll(in_words.out.toStdString(),
                           {"fastrak:" + link.toUtf8(), "Polhemus Fastrak", "firmware G1.02", "1 of 1 lines"}));
  for (QProcess* emulator : {&fastrak, &server}) {
    QCOMPARE(::kill(static_cast<pid_t>(emulator->processId()), SIGTERM), 0);
    FT_VERIFY_STATUS(finished(*emulator, 20000), 0);
  }
}

void CliFindTest::saysWhyNot() {
  const CliRun run = runCli({"find", "--line", "tcp:localhost:1"});
  FT_VERIFY_STATUS(run, 0);
  FT_VERIFY_MATCH(holdsAll(run.out.toStdString(), {"Nothing listens at localhost:1", "0 of 1 lines"}));
}

void CliFindTest::canBeStopped() {
  QProcess silent, search;
  const QString link = folder_.filePath("silent");
  silent.start(cliPath(), {"emulate", "fastrak", "--pty", link, "--faults", "silence,slow_reply", "--duration", "120"});
  QVERIFY(waitForLine(silent, "emulator at").hasMatch());
  search.start(cliPath(), {"find", "--line", link});
  QVERIFY(search.waitForStarted());
  QTest::qWait(300);
  QCOMPARE(::kill(static_cast<pid_t>(search.processId()), SIGINT), 0);
  const CliRun run = finished(search, 20000);
  FT_VERIFY_STATUS(run, 0);
  QVERIFY2(run.out.contains("Stopped") || run.out.contains("0 of 1 lines"), run.out.constData());
  QCOMPARE(::kill(static_cast<pid_t>(silent.processId()), SIGTERM), 0);
  FT_VERIFY_STATUS(finished(silent, 20000), 0);
}

FIELDTRUE_TEST(CliFindTest)
#include "cli_find_test.moc"
