#include <QTemporaryDir>
#include <QTest>

#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

/// Whose calibration is it: stated, kept, checked, compared.
using namespace fieldtrue;
using namespace fieldtrue::testing;
using nlohmann::json;

class CliSetupTest : public QObject {
  Q_OBJECT

  QTemporaryDir folder_;
  QString at(const QString& name) const { return folder_.filePath(name); }

  QList<QByteArray> lastColumn(const QString& name) const {
    QList<QByteArray> values;
    for (const QByteArray& line : readWhole(at(name)).split('\n'))
      if (!line.isEmpty() && !line.startsWith('#')) values << line.mid(line.lastIndexOf(',') + 1);
    return values;
  }

 private slots:
  void initTestCase() {
    FT_VERIFY_STATUS(runCli({"simulate", "--plan", "grid:4x4x3@0.2", "--seed", "3", "--nodes", at("plain.csv")}), 0);
    FT_VERIFY_STATUS(runCli({"fit", "--nodes", at("plain.csv"), "--position", "polynomial:degree=1", "--setup",
                             "room=Lab 2", "--setup", "filter=off", "--out", at("a.ftcal.json")}),
                     0);
    const QByteArray rows = readWhole(at("plain.csv"));
    QVERIFY(writeWhole(at("same.csv"), "# setup.room: lab 2\n# setup.filter: off\n" + rows));
    QVERIFY(writeWhole(at("other.csv"), "# setup.room: Lab 3\n# setup.filter: off\n" + rows));
  }

  void theFileHoldsEveryFact() {
    const json setup = json::parse(readWhole(at("a.ftcal.json")).toStdString()).at("setup");
    const json expected = {
        {"tracker_kind", nullptr}, {"tracker_serial", nullptr},       {"transmitter_serial", nullptr},
        {"sensor", "0"},           {"sensor_serial", nullptr},        {"filter", "off"},
        {"units", nullptr},        {"factory_compensation", nullptr}, {"room", "Lab 2"},
        {"date", nullptr}};
    QCOMPARE(QString::fromStdString(setup.dump()), QString::fromStdString(expected.dump()));
  }

  void applyTellsWhoseRowsTheyAre_data() {
    QTest::addColumn<QString>("table");
    QTest::addColumn<QStringList>("stated");
    QTest::addColumn<QByteArray>("expected");
    QTest::newRow("not stated") << "plain.csv" << QStringList() << QByteArray("unknown");
    QTest::newRow("stated by the table") << "same.csv" << QStringList() << QByteArray("yes");
    QTest::newRow("another room") << "other.csv" << QStringList() << QByteArray("no");
    QTest::newRow("a person knows better") << "other.csv" << QStringList{"--setup", "room=Lab 2"} << QByteArray("yes");
    QTest::newRow("another filter") << "same.csv" << QStringList{"--setup", "filter=low"} << QByteArray("no");
  }
  void applyTellsWhoseRowsTheyAre() {
    QFETCH(QString, table);
    QFETCH(QStringList, stated);
    QFETCH(QByteArray, expected);
    const CliRun run = runCli(
        QStringList{"apply", "--calibration", at("a.ftcal.json"), "--in", at(table), "--out", at("out.csv"), "--json"} +
        stated);
    FT_VERIFY_STATUS(run, 0);
    const QList<QByteArray> column = lastColumn("out.csv");
    QCOMPARE(column.size(), 49);
    QCOMPARE(column.front(), QByteArray("setup_matches"));
    for (const QByteArray& value : column.mid(1)) QCOMPARE(value, expected);
    QCOMPARE(run.json().at("other_setup").get<int>(), expected == "no" ? 48 : 0);
    QCOMPARE(run.err.contains("another set-up"), expected == "no");
  }

  /// Every tracker has a sensor 0.
  void theSensorsNumberAloneTellsNothing() {
    FT_VERIFY_STATUS(
        runCli({"fit", "--nodes", at("plain.csv"), "--position", "affine", "--out", at("unstated.ftcal.json")}), 0);
    FT_VERIFY_STATUS(runCli({"apply", "--calibration", at("unstated.ftcal.json"), "--in", at("plain.csv"), "--out",
                             at("unstated.csv")}),
                     0);
    QCOMPARE(lastColumn("unstated.csv").last(), QByteArray("unknown"));
  }

  void anotherSensorIsAnother() {
    QByteArray rows = readWhole(at("same.csv"));
    const int sensor = static_cast<int>(QString(rows.split('\n').at(headerLine(rows))).split(',').indexOf("sensor"));
    QVERIFY(sensor >= 0);
    QList<QByteArray> lines = rows.split('\n');
    QList<QByteArray> fields = lines.at(headerLine(rows) + 1).split(',');
    fields[sensor] = "7";
    lines[headerLine(rows) + 1] = fields.join(',');
    QVERIFY(writeWhole(at("sensors.csv"), lines.join('\n')));
    const CliRun run =
        runCli({"apply", "--calibration", at("a.ftcal.json"), "--in", at("sensors.csv"), "--out", at("out.csv")});
    FT_VERIFY_STATUS(run, 0);
    QCOMPARE(lastColumn("out.csv").at(1), QByteArray("no"));
    QCOMPARE(lastColumn("out.csv").at(2), QByteArray("yes"));
    QVERIFY2(run.err.contains("sensor '7' instead of '0'"), run.err.constData());
  }

  void whatIsNoFactIsRefused() {
    const CliRun run = runCli({"apply", "--calibration", at("a.ftcal.json"), "--in", at("same.csv"), "--out",
                               at("x.csv"), "--setup", "colour=red"});
    FT_VERIFY_STATUS(run, 2);
    QVERIFY2(run.err.contains("factory_compensation"), run.err.constData());
    FT_VERIFY_STATUS(
        runCli({"fit", "--nodes", at("plain.csv"), "--position", "none", "--out", at("x.json"), "--setup", "room"}), 2);
  }

  void aSessionKeepsWhatItWasToldAndWhatTheTrackerSays() {
    FT_VERIFY_STATUS(
        runCli({"acquire", "--device", "simulated:speed=50,travel_s=0.5", "--plan", "grid:2x2x2@0.3", "--auto",
                "--samples-per-node", "10", "--session", at("s.fieldtrue"), "--setup", "transmitter_serial=TX 17"}),
        0);
    FT_VERIFY_STATUS(runCli({"tables", "--session", at("s.fieldtrue"), "--nodes", at("s.csv")}), 0);
    const QByteArray rows = readWhole(at("s.csv"));
    for (const char* line : {"# setup.transmitter_serial: TX 17\n", "# setup.tracker_kind: simulated\n"})
      QVERIFY2(rows.contains(line), rows.left(2000).constData());
  }

  void aSessionIsNotGoneOnWithInAnotherRoomUnsaid() {
    const CliRun run = runCli({"acquire", "--device", "simulated:speed=50,travel_s=0.5", "--auto", "--session",
                               at("s.fieldtrue"), "--setup", "transmitter_serial=TX 18"});
    FT_VERIFY_STATUS(run, 0);
    QVERIFY2(run.err.contains("'TX 18' instead of 'TX 17'"), run.err.constData());
  }

  void differenceOfACalibrationToItselfIsNothing() {
    const CliRun run = runCli({"difference", at("a.ftcal.json"), at("a.ftcal.json"), "--json"});
    FT_VERIFY_STATUS(run, 0);
    const json difference = run.json();
    QCOMPARE(difference.at("schema").get<std::string>(), std::string("fieldtrue.difference/1"));
    QCOMPARE(difference.at("field").at("max_mm").get<double>(), 0.0);
    QCOMPARE(difference.at("verdict").get<std::string>(), std::string("not_shown"));
    QCOMPARE(difference.at("setup_matches").get<std::string>(), std::string("yes"));
    const CliRun words = runCli({"difference", at("a.ftcal.json"), at("a.ftcal.json")});
    FT_VERIFY_STATUS(words, 0);
    QVERIFY2(words.out.contains("No change is shown"), words.out.constData());
    FT_VERIFY_STATUS(runCli({"difference", at("a.ftcal.json")}), 2);
    FT_VERIFY_STATUS(runCli({"difference", at("a.ftcal.json"), at("plain.csv")}), 1);
  }

 private:
  static int headerLine(const QByteArray& table) {
    const QList<QByteArray> lines = table.split('\n');
    int line = 0;
    while (lines.at(line).startsWith('#')) ++line;
    return line;
  }
};

FIELDTRUE_TEST(CliSetupTest)
#include "cli_setup_test.moc"
