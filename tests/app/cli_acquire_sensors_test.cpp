#include <QFileInfo>
#include <QTemporaryDir>
#include <QTest>
#include <algorithm>
#include <array>

#include "calib/tables/table_io.h"
#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

/// Headless recording of a tracker with two sensors: which of them are recorded, and what is said.
using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

const std::array<Eigen::Vector3d, 2> kJigStands_m{Eigen::Vector3d(0.4, -0.1, 0.1), Eigen::Vector3d(0.6, -0.1, 0.1)};

/// Both sensors at both places; each is off by its own place on the jig and trembles by its own amount.
Eigen::Vector3d seen_m(const Eigen::Vector3d& jig_m, int sensor, int n) {
  const double tremble_m = (sensor == 0 ? 1e-4 : 4e-4) * (n % 2 == 0 ? 1.0 : -1.0);
  return jig_m + Eigen::Vector3d(0.0, 0.04 * sensor, tremble_m);
}

/// A recording of a tracker whose jig stands at the first place, is carried to the second, and stands there.
struct Heard {
  double from_s = 0.0, until_s = 1e9;
};

/// @param heard when each sensor says something
QByteArray recording(const std::array<Heard, 2>& heard = {}, int rate_hz = 60) {
  QByteArray text = "node,sensor,visit,t_s,x_m,y_m,z_m,qw,qx,qy,qz,status\n";
  for (int n = 0; n < 30 * rate_hz; ++n) {
    const double t_s = n / static_cast<double>(rate_hz);
    const double way = std::clamp((t_s - 8.0) / 2.0, 0.0, 1.0);
    for (int sensor = 0; sensor < 2; ++sensor) {
      const Heard& of_sensor = heard[static_cast<std::size_t>(sensor)];
      if (t_s < of_sensor.from_s || t_s >= of_sensor.until_s) continue;
      const Eigen::Vector3d p_m = seen_m((1.0 - way) * kJigStands_m[0] + way * kJigStands_m[1], sensor, n);
      text += "-1," + QByteArray::number(sensor) + ",0," + QByteArray::number(t_s, 'f', 5);
      for (const double x : p_m) text += "," + QByteArray::number(x, 'g', 17);
      text += ",1,0,0,0,\n";
    }
  }
  return text;
}

}  // namespace

class CliAcquireSensorsTest : public QObject {
  Q_OBJECT

 private slots:
  void initTestCase() {
    QVERIFY(folder_.isValid());
    QVERIFY(writeWhole(at("two.samples.csv"), recording()));
    QVERIFY(writeWhole(at("falls.samples.csv"), recording({{{}, {0.0, 5.0}}})));
  }

  void bothAreRecorded() {
    const CliRun run = acquired("both", {"--json"});
    FT_VERIFY_STATUS(run, 0);
    QVERIFY(run.json().at("sensors") == nlohmann::json({0, 1}));
    QVERIFY2(run.err.contains("Recording sensors 0 and 1, led by sensor 0"), run.err.constData());
    const CalibrationTable table = tableOfSession("both");
    QCOMPARE(table.nodes.size(), std::size_t{4});
    for (std::size_t row = 0; row < 4; ++row) {
      const Node& node = table.nodes[row];
      QCOMPARE(node.node, static_cast<int>(row / 2));
      QCOMPARE(node.sensor, static_cast<int>(row % 2));
      QCOMPARE(node.n_used, 20);
      // Twenty readings, half of them up and half of them down.
      const Eigen::Vector3d expected_m = kJigStands_m[row / 2] + Eigen::Vector3d(0.0, 0.04 * node.sensor, 0.0);
      FT_VERIFY_MATCH(near(node.tracker_from_sensor.position_m, expected_m, 1e-9));
    }
    FT_VERIFY_STATUS(runCli({"tables", "--session", at("both.fieldtrue"), "--nodes", at("both.nodes.csv"), "--samples",
                             at("both.samples.csv")}),
                     0);
    const QByteArray samples = readWhole(at("both.samples.csv"));
    for (const char* row : {"\n0,0,0,", "\n0,1,0,", "\n1,0,0,", "\n1,1,0,"}) QCOMPARE(samples.count(row), 20);
  }

  void slowTrackersAreTakenByThemselves_data() {
    QTest::addColumn<int>("rate_hz");
    for (const int rate_hz : {2, 5, 8}) QTest::addRow("%d Hz", rate_hz) << rate_hz;
  }
  void slowTrackersAreTakenByThemselves() {
    QFETCH(int, rate_hz);
    QVERIFY(writeWhole(at("slow.samples.csv"), recording({}, rate_hz)));
    const QString session = QStringLiteral("slow-%1").arg(rate_hz);
    const CliRun run =
        runCli({"acquire", "--device", "trace:" + at("slow.samples.csv") + ",rate=10", "--plan", "grid:2x1x1@0.2",
                "--auto", "--samples-per-node", "4", "--session", at(session + ".fieldtrue")});
    FT_VERIFY_STATUS(run, 0);
    QCOMPARE(tableOfSession(session).nodes.size(), std::size_t{4});
  }

  void someAreChosen_data() {
    QTest::addColumn<QString>("choice");
    QTest::addColumn<QList<int>>("sensors");
    QTest::addColumn<QByteArray>("said");
    QTest::newRow("the first") << "0" << QList<int>{0} << QByteArray("Recording sensor 0 of 2");
    QTest::newRow("the second") << "1" << QList<int>{1} << QByteArray("Recording sensor 1 of 2");
    QTest::newRow("both, the second leads") << "1+0" << QList<int>{0, 1} << QByteArray("led by sensor 1 of 2");
    QTest::newRow("all") << "all" << QList<int>{0, 1} << QByteArray("led by sensor 0 of 2");
  }
  void someAreChosen() {
    QFETCH(QString, choice);
    QFETCH(QList<int>, sensors);
    QFETCH(QByteArray, said);
    const CliRun run = acquired("chosen-" + choice, {"--sensor", choice, "--json"});
    FT_VERIFY_STATUS(run, 0);
    QVERIFY2(run.err.contains(said), run.err.constData());
    QVERIFY(run.json().at("sensors") == nlohmann::json(std::vector<int>(sensors.begin(), sensors.end())));
    QCOMPARE(tableOfSession("chosen-" + choice).nodes.size(), static_cast<std::size_t>(2 * sensors.size()));
  }

  void refusals_data() {
    QTest::addColumn<QString>("choice");
    QTest::addColumn<int>("status");
    QTest::addColumn<QByteArray>("sentence");
    QTest::newRow("nothing") << "" << 2 << QByteArray("--sensor: '' names no sensors: all, 0 or 0+2");
    QTest::newRow("no number") << "x" << 2 << QByteArray("--sensor: 'x' names no sensors");
    QTest::newRow("half a list") << "0+" << 2 << QByteArray("--sensor: '0+' names no sensors");
    QTest::newRow("twice") << "1+1" << 2 << QByteArray("names sensor 1 twice");
    QTest::newRow("not there") << "5" << 1 << QByteArray("--sensor 5: the tracker sends only sensors 0 and 1");
    QTest::newRow("one not there") << "0+5" << 1 << QByteArray("--sensor 0+5: the tracker sends only sensors 0 and 1");
  }
  void refusals() {
    QFETCH(QString, choice);
    QFETCH(int, status);
    QFETCH(QByteArray, sentence);
    const CliRun run = acquired("refused", {"--sensor", choice});
    FT_VERIFY_STATUS(run, status);
    QVERIFY2(run.err.contains(sentence), run.err.constData());
    QCOMPARE(run.err.trimmed().count('\n'), 0);
    if (status == 2) QVERIFY(!QFileInfo::exists(at("refused.fieldtrue")));
    QFile::remove(at("refused.fieldtrue"));
  }

  void oneThatComesLateIsWaitedFor() {
    QVERIFY(writeWhole(at("late.samples.csv"), recording({{{}, {4.0, 1e9}}})));
    const CliRun refused = acquired("late", {"--sensor", "1"}, "late.samples.csv");
    FT_VERIFY_STATUS(refused, 1);
    QVERIFY2(refused.err.contains("--sensor 1: the tracker sends only sensor 0"), refused.err.constData());
    const CliRun waited = acquired("late", {"--sensor", "1", "--reconnect", "20"}, "late.samples.csv");
    FT_VERIFY_STATUS(waited, 0);
    QVERIFY2(waited.err.contains("note: sensor 1 does not report"), waited.err.constData());
    for (const Node& node : tableOfSession("late").nodes) QCOMPARE(node.sensor, 1);
    const CliRun in_vain = acquired("vain", {"--sensor", "0+5", "--reconnect", "1"});
    FT_VERIFY_STATUS(in_vain, 1);
    const QByteArray why = "--sensor 0+5: the tracker sends only sensors 0 and 1 within 1 s (--reconnect)";
    QVERIFY2(in_vain.err.contains(why), in_vain.err.constData());
  }

  void aSessionGoesOnWithoutADeadOne_data() {
    QTest::addColumn<int>("dead");
    QTest::newRow("another") << 1;
    QTest::newRow("the leading one") << 0;
  }
  void aSessionGoesOnWithoutADeadOne() {
    QFETCH(int, dead);
    const QString name = QStringLiteral("dead-%1").arg(dead), left = QString::number(1 - dead);
    FT_VERIFY_STATUS(acquired(name, {"--reconnect", "0"}, "falls.samples.csv"), 1);
    QCOMPARE(tableOfSession(name).nodes.size(), std::size_t{2});
    std::array<Heard, 2> heard;
    heard[static_cast<std::size_t>(dead)].until_s = -1.0;
    QVERIFY(writeWhole(at("left.samples.csv"), recording(heard)));
    const CliRun run = acquired(name, {"--sensor", left}, "left.samples.csv");
    FT_VERIFY_STATUS(run, 0);
    const QByteArray told = "note: Sensor " + QByteArray::number(dead) + " is left out of this session from here on";
    QVERIFY2(run.err.contains(told), run.err.constData());
    const CalibrationTable table = tableOfSession(name);
    QCOMPARE(table.nodes.size(), std::size_t{3});
    QVERIFY(table.nodes[2].node == 1 && table.nodes[2].sensor == 1 - dead);
  }

  void aSessionGoesOnWithItsOwn() {
    FT_VERIFY_STATUS(acquired("own", {}), 0);
    const CliRun other = acquired("own", {"--sensor", "1"});
    FT_VERIFY_STATUS(other, 1);
    QVERIFY2(other.err.contains("its places were taken by sensors 0 and 1, not by sensor 1"), other.err.constData());
    QCOMPARE(other.err.trimmed().count('\n'), 0);
    FT_VERIFY_STATUS(acquired("own", {"--sensor", "1+0"}), 0);
    FT_VERIFY_STATUS(acquired("own", {}), 0);
  }

  void oneThatFallsSilentIsToldAndNothingIsTaken() {
    const CliRun run = acquired("falls", {"--reconnect", "0"}, "falls.samples.csv");
    FT_VERIFY_STATUS(run, 1);
    QVERIFY2(run.err.contains("note: sensor 1 does not report: plug it in again"), run.err.constData());
    QVERIFY2(run.err.contains("nothing came within 0 s (--reconnect)"), run.err.constData());
    const CalibrationTable table = tableOfSession("falls");
    QCOMPARE(table.nodes.size(), std::size_t{2});
  }

 private:
  QString at(const QString& name) const { return folder_.filePath(name); }

  CliRun acquired(const QString& name, const QStringList& more, const QString& played = "two.samples.csv") {
    return runCli(QStringList{"acquire", "--device", "trace:" + at(played) + ",rate=10", "--plan", "grid:2x1x1@0.2",
                              "--auto", "--samples-per-node", "20", "--session", at(name + ".fieldtrue")} +
                  more);
  }

  CalibrationTable tableOfSession(const QString& name) {
    const QString path = at(name + ".nodes.csv");
    const CliRun run = runCli({"tables", "--session", at(name + ".fieldtrue"), "--nodes", path});
    if (run.status != 0) qFatal("%s", run.err.constData());
    return readNodeTable(path.toStdString()).value().table;
  }

  QTemporaryDir folder_;
};

FIELDTRUE_TEST(CliAcquireSensorsTest)
#include "cli_acquire_sensors_test.moc"
