#include <QDir>
#include <QFileInfo>
#include <QSqlDatabase>
#include <QSqlQuery>
#include <QTemporaryDir>
#include <QTest>

#include "calib/core/json_text.h"
#include "calib/tables/line_reader.h"
#include "calib/tables/table_io.h"
#include "calib/tables/table_writer.h"
#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

/// Files that would end the program, or give a wrong answer without a word: each is refused in one sentence.
using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

CalibrationTable goodTable() {
  SyntheticOptions options;
  options.counts = {4, 4, 3};
  options.smooth_distortion_m = 0.02;
  SyntheticNoise noise;
  noise.position_sd_m = 0.0005;
  return syntheticTable(options, noise);
}

QByteArray nested(int depth) { return QByteArray("[").repeated(depth) + QByteArray("]").repeated(depth); }

}  // namespace

class CliRefusalsTest : public QObject {
  Q_OBJECT
 private slots:
  void initTestCase() {
    QVERIFY2(QFileInfo(cliPath()).isExecutable(), qPrintable(cliPath() + " is not built"));
    CalibrationTable table = goodTable();
    write("good.nodes.csv", table);
    FT_VERIFY_STATUS(
        runCli({"fit", "--nodes", at("good.nodes.csv"), "--position", "affine", "--out", at("good.ftcal.json")}), 0);
    makeSlips(table);
    makeFarReading(table);
    makeTwoSensors(table);
    makeReadings(table);
    makeDeepFiles();
    const QByteArray header = "node,x_true_m,y_true_m,z_true_m,x_m,y_m,z_m\n";
    const QByteArray longer(static_cast<qsizetype>(kLongestLine) + 1, '1');
    QVERIFY(writeWhole(at("long.nodes.csv"), header + "0,0,0,0,0,0,0\n1,0,0,0,0,0," + longer + "\n"));
    QVERIFY(writeWhole(at("long.csv"), "x_m,y_m,z_m\n0,0," + longer + "\n"));
    QVERIFY(writeWhole(at("long.traj"), longer));
  }

  void isToldInOneLine_data() {
    QTest::addColumn<QString>("arguments");  // separated by blanks; @ stands for the folder
    QTest::addColumn<QList<QByteArray>>("fragments");
    const auto row = [](const char* name, const char* arguments, const QList<QByteArray>& fragments) {
      QTest::newRow(name) << arguments << fragments;
    };
    for (const char* deep : {"huge", "cut", "over"}) {
      const QByteArray d = deep;
      const QList<QByteArray> too_deep{"nested", QByteArray::number(kDeepestJson)};
      const auto deepRow = [&](const QByteArray& what, const QByteArray& arguments) {
        row((d + ": " + what).constData(), arguments.constData(), QList<QByteArray>{d} + too_deep);
      };
      deepRow("scene", "simulate --scene @/" + d + ".scene.json --plan grid:2x2x2@0.1 --nodes @/o.csv");
      deepRow("plan", "simulate --plan @/" + d + ".plan.json --nodes @/o.csv");
      deepRow("calibration", "apply --calibration @/" + d + ".ftcal.json --in @/good.nodes.csv --out @/o.csv");
      deepRow("calibration to export", "export --calibration @/" + d + ".ftcal.json --format csv --out @/o.csv");
      deepRow("session's plan", "tables --session @/" + d + ".fieldtrue --nodes @/o.csv");
      deepRow("session's plan, resumed", "acquire --device simulated --auto --session @/" + d + ".fieldtrue");
      deepRow("scene to believe",
              "diagnose --nodes @/good.nodes.csv --scene @/" + d + ".scene.json --out @/o.gap.json");
    }
    const QByteArray limit = QByteArray::number(kLongestLine);
    row("long line", "compare --nodes @/long.nodes.csv", {"long.nodes.csv", "line 3", limit});
    row("long line to apply to", "apply --calibration @/good.ftcal.json --in @/long.csv --out @/o.csv",
        {"long.csv", "line 2", limit});
    row("long line to import", "import --format columns:x=x_m,y=y_m,z=z_m --in @/long.csv --nodes @/o.csv",
        {"long.csv", limit});
    row("long trajectory", "import --format traj --in @/long.traj --samples @/o.csv", {"long.traj", limit});

    const char* const commands[] = {"fit --nodes @/%1 --position affine --out @/o.json",
                                    "compare --nodes @/%1 --methods rigid",
                                    "report --nodes @/%1 --methods rigid --html @/o.html",
                                    "diagnose --nodes @/%1 --out @/o.json",
                                    "resample --nodes @/%1 --method briggs --plan grid:2x2x2@0.1 --nodes-out @/o.csv",
                                    "plan-check --nodes @/%1"};
    for (const char* command : commands) {
      const QString name = QString(command).section(' ', 0, 0);
      const auto with = [&](const char* file) { return QString(command).arg(file).toUtf8(); };
      row(qPrintable(name + ", millimetres"), with("true-mm.nodes.csv"),
          {"true-mm.nodes.csv", "1000, millimetres for metres", "metres", "--force"});
      row(qPrintable(name + ", both in millimetres"), with("both-mm.nodes.csv"),
          {"both-mm.nodes.csv", "30 m", "--force"});
      if (!QStringList{"fit", "compare", "report", "diagnose"}.contains(name))
        row(qPrintable(name + ", two sensors"), with("two.nodes.csv"),
            {"two.nodes.csv", "sensors 0 and 4", "--sensor N"});
      row(qPrintable(name + ", a reading far out"), with("far.nodes.csv"),
          {"far.nodes.csv", line_of_far_, "column x_m", "1e+06 m", "30 m", "metres", "--force"});
      row(qPrintable(name + ", a sensor that is not there"), with("two.nodes.csv --sensor 1"),
          {"two.nodes.csv", "sensor 1", "sensors 0 and 4"});
    }
    row("earlier recording in millimetres",
        "diagnose --nodes @/good.nodes.csv --against @/true-mm.nodes.csv --out @/o.json",
        {"true-mm.nodes.csv", "--force"});
    row("millimetres to apply to", "apply --calibration @/good.ftcal.json --in @/mm.csv --out @/o.csv",
        {"mm.csv", "48", "divided by 1000", "millimetres", "--force"});
  }

  void isToldInOneLine() {
    QFETCH(QString, arguments);
    QFETCH(QList<QByteArray>, fragments);
    const CliRun run = runIn(arguments);
    FT_VERIFY_STATUS(run, 1);
    QCOMPARE(run.out, QByteArray());
    FT_VERIFY_MATCH(holdsAll(run.err.toStdString(), fragments));
    QVERIFY2(run.err.startsWith("fieldtrue-cli"), run.err.constData());
    QCOMPARE(run.err.count('\n'), qsizetype(1));
    for (const QString& file : QDir(folder_.path()).entryList(QDir::Files)) {
      QVERIFY2(!file.startsWith("o.") && !file.contains(".part-"), qPrintable(file + " was left behind"));
    }
  }

  void goesOnWhereAsked_data() {
    QTest::addColumn<QString>("arguments");
    QTest::addColumn<QList<QByteArray>>("remarks");
    const auto row = [](const char* name, const char* arguments, const QList<QByteArray>& remarks) {
      QTest::newRow(name) << arguments << remarks;
    };
    const QList<QByteArray> forced{"true-mm.nodes.csv", "1000", "all the same"};
    row("fit", "fit --nodes @/true-mm.nodes.csv --position affine --force --out @/w.json", forced);
    row("fit a reading far out", "fit --nodes @/far.nodes.csv --position affine --force --out @/w.json",
        {line_of_far_, "all the same"});
    row("fit beside a reading far out that is skipped",
        "fit --nodes @/far-skipped.nodes.csv --position affine --out @/w.json", {});
    row("compare", "compare --nodes @/true-mm.nodes.csv --methods rigid --force", forced);
    row("report", "report --nodes @/true-mm.nodes.csv --methods rigid --force --html @/w.html", forced);
    row("apply", "apply --calibration @/good.ftcal.json --in @/mm.csv --out @/w.csv --force", {"mm.csv", "1000"});
    row("apply to metres", "apply --calibration @/good.ftcal.json --in @/m.csv --out @/w.csv", {});
    row("apply to one reading near and the rest elsewhere",
        "apply --calibration @/good.ftcal.json --in @/one-near.csv --out @/w.csv", {});
    const QList<QByteArray> chosen{"two.nodes.csv", "48 of 96 rows", "sensor 4"};
    row("fit all sensors", "fit --nodes @/two.nodes.csv --position affine --out @/w.json", {});
    row("report all sensors", "report --nodes @/two.nodes.csv --methods rigid --html @/w.html", {});
    row("fit one sensor", "fit --nodes @/two.nodes.csv --position affine --sensor 4 --out @/w.json", chosen);
    row("compare one sensor", "compare --nodes @/two.nodes.csv --methods rigid --sensor 4", chosen);
    row("plan-check one sensor", "plan-check --nodes @/two.nodes.csv --sensor 4", {});
    row("the only sensor", "fit --nodes @/good.nodes.csv --position affine --sensor 0 --out @/w.json", {});
  }
  void goesOnWhereAsked() {
    QFETCH(QString, arguments);
    QFETCH(QList<QByteArray>, remarks);
    const CliRun run = runIn(arguments);
    FT_VERIFY_STATUS(run, 0);
    FT_VERIFY_MATCH(holdsAll(run.err.toStdString(), remarks));
  }

  /// Each sensor by itself is perfect; with one mounting for both they would look 90 degrees wrong.
  void sensorsAreToldApart() {
    for (const QStringList& sensor : {QStringList{"--sensor", "0"}, {"--sensor", "4"}, {}}) {
      const CliRun run =
          runCli(QStringList{"compare", "--nodes", at("two.nodes.csv"), "--methods", "rigid", "--json"} + sensor);
      FT_VERIFY_STATUS(run, 0);
      QCOMPARE(run.json().at("places").get<int>(), 48);
      const double median_deg = run.json().at("before").at("orientation_deg").at("median").get<double>();
      QVERIFY2(median_deg < 1.0, qPrintable(QString::number(median_deg)));
    }
    const CliRun run = runCli({"diagnose", "--nodes", at("two.nodes.csv"), "--out", at("two.gap.json"), "--json"});
    FT_VERIFY_STATUS(run, 0);
    const auto mounts = run.json().at("alignment").at("sensor_mounts");
    QCOMPARE(mounts.size(), std::size_t{2});
    QCOMPARE(mounts.at(1).at("sensor").get<int>(), 4);
  }

  void aDeepButAllowedFileIsReadWhole() {
    // At the limit the JSON itself is fine, and what is said is about its content.
    const CliRun run = runIn("simulate --scene @/limit.scene.json --plan grid:2x2x2@0.1 --nodes @/o.csv");
    FT_VERIFY_STATUS(run, 1);
    QVERIFY2(!run.err.contains("nested"), run.err.constData());
    QCOMPARE(run.err.count('\n'), qsizetype(1));
  }

  void metadataBelowTheHeadIsNoted() {
    QByteArray text = readWhole(at("good.nodes.csv"));
    text += "# alignment: known\n";
    QVERIFY(writeWhole(at("late.nodes.csv"), text));
    const CliRun run = runIn("compare --nodes @/late.nodes.csv --methods rigid --json");
    FT_VERIFY_STATUS(run, 0);
    QCOMPARE(QString::fromStdString(run.json().at("align").get<std::string>()), QString("rigid"));
    FT_VERIFY_MATCH(holdsAll(run.err.toStdString(), {"late.nodes.csv", "# alignment: known", "comment"}));
  }

 private:
  QString at(const QString& name) const { return folder_.filePath(name); }
  void write(const QString& name, const CalibrationTable& table) {
    FT_VERIFY_OK(writeNodeTable(std::filesystem::path(at(name).toStdString()), table));
  }
  CliRun runIn(const QString& arguments) {
    QStringList list = arguments.split(' ', Qt::SkipEmptyParts);
    return runCli(list.replaceInStrings("@/", folder_.path() + "/"));
  }

  void makeSlips(CalibrationTable table) {
    for (Node& node : table.nodes) node.reference_from_sensor.position_m *= 1000.0;
    write("true-mm.nodes.csv", table);
    for (Node& node : table.nodes) node.tracker_from_sensor.position_m *= 1000.0;
    write("both-mm.nodes.csv", table);
  }

  /// The reading of the last row.
  void makeFarReading(CalibrationTable table) {
    table.nodes.back().tracker_from_sensor.position_m.x() = 1e6;
    write("far.nodes.csv", table);
    line_of_far_ = "line " + QByteArray::number(readWhole(at("far.nodes.csv")).count('\n'));
    table.nodes.back().role = NodeRole::kSkipped;
    write("far-skipped.nodes.csv", table);
  }

  /// A second sensor at every place, turned by 90 degrees in its holder.
  void makeTwoSensors(CalibrationTable table) {
    const Eigen::Quaterniond quarter = rotationFromVector(Eigen::Vector3d(0, 0, 1.5707963267948966));
    for (std::size_t i = 0, n = table.nodes.size(); i < n; ++i) {
      Node other = table.nodes[i];
      other.sensor = 4;
      other.tracker_from_sensor.orientation = other.tracker_from_sensor.orientation * quarter;
      table.nodes.push_back(other);
    }
    write("two.nodes.csv", table);
  }

  void makeReadings(const CalibrationTable& table) {
    QByteArray metres = "x_m,y_m,z_m\n", millimetres = metres, one_near = metres;
    const auto line = [](const Eigen::Vector3d& p) {
      return QByteArray::number(p.x()) + "," + QByteArray::number(p.y()) + "," + QByteArray::number(p.z()) + "\n";
    };
    for (const Node& node : table.nodes) {
      metres += line(node.tracker_from_sensor.position_m);
      millimetres += line(1000.0 * node.tracker_from_sensor.position_m);
    }
    one_near += millimetres.mid(one_near.size()) + line(table.nodes.front().tracker_from_sensor.position_m);
    QVERIFY(writeWhole(at("m.csv"), metres));
    QVERIFY(writeWhole(at("mm.csv"), millimetres));
    QVERIFY(writeWhole(at("one-near.csv"), one_near));
  }

  void makeDeepFiles() {
    const std::pair<QString, QByteArray> contents[] = {
        {"huge", nested(200000)}, {"cut", QByteArray(200000, '[')}, {"over", nested(kDeepestJson + 1)}};
    for (const auto& [name, content] : contents) {
      for (const char* kind : {".scene.json", ".plan.json", ".ftcal.json"})
        QVERIFY(writeWhole(at(name + kind), content));
      makeSession(name, content);
    }
    QVERIFY(writeWhole(at("limit.scene.json"), nested(kDeepestJson)));
  }

  /// A session whose plan is the text given.
  void makeSession(const QString& name, const QByteArray& plan) {
    const QString session = at(name + ".fieldtrue");
    FT_VERIFY_STATUS(runCli({"acquire", "--device", "simulated:speed=20", "--plan", "grid:1x1x1@0.1",
                             "--samples-per-node", "2", "--auto", "--session", session}),
                     0);
    {
      QSqlDatabase database = QSqlDatabase::addDatabase("QSQLITE", name);
      database.setDatabaseName(session);
      QVERIFY(database.open());
      QSqlQuery query(database);
      QVERIFY(query.prepare("UPDATE meta SET value = ? WHERE key = 'plan'"));
      query.addBindValue(QString::fromUtf8(plan));
      QVERIFY(query.exec() && query.numRowsAffected() == 1);
      query.finish();
      database.close();
    }
    QSqlDatabase::removeDatabase(name);
  }

  QTemporaryDir folder_;
  QByteArray line_of_far_;
};

FIELDTRUE_TEST(CliRefusalsTest)
#include "cli_refusals_test.moc"
