#include <QTemporaryDir>
#include <QTest>

#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/real_data.h"
#include "tests/support/test_main.h"

/// Recordings of other people's trackers, from their files to figures that others published.
using namespace fieldtrue::testing;
using nlohmann::json;

namespace {

QString data(const std::string& relative) { return QString::fromStdString(realData(relative).value_or("").string()); }

}  // namespace

class CliImportTest : public QObject {
  Q_OBJECT
 private slots:
  void anserConditionsReproduceTheirFigures_data() {
    QTest::addColumn<QString>("condition");
    QTest::addColumn<double>("in_sample_mm");
    QTest::addColumn<double>("held_out_mm");
    QTest::newRow("standard") << "standard_data_grid" << 2.26 << 2.34;
    QTest::newRow("interpolate") << "interpolate_data_grid" << 2.08 << 2.16;
    QTest::newRow("probe calibrate") << "interpolate_data_grid_probe_calibrate" << 2.40 << 2.50;
    QTest::newRow("finer points") << "finer_mesh_points" << 4.53 << 4.72;
    QTest::newRow("finer 3 axis") << "finer_mesh_3axis" << 2.46 << 2.57;
    QTest::newRow("steel shield") << "steel_shield" << 5.21 << 5.39;
  }

  void anserConditionsReproduceTheirFigures() {
    FT_REQUIRE_REAL_DATA();
    QFETCH(QString, condition);
    QFETCH(double, in_sample_mm);
    QFETCH(double, held_out_mm);
    const QString nodes = folder_.filePath(condition + ".nodes.csv");
    FT_VERIFY_STATUS(runCli({"import", "--format", "anser:condition=" + condition, "--in",
                             data("anser_duplo/nodes.csv"), "--nodes", nodes}),
                     0);
    const CliRun fit =
        runCli({"fit", "--nodes", nodes, "--position", "rigid", "--out", folder_.filePath("f.ftcal.json"), "--json"});
    FT_VERIFY_STATUS(fit, 0);
    FT_VERIFY_MATCH(near(fit.json().at("in_sample").at("rms_mm").get<double>(), in_sample_mm, 0.01));
    const CliRun compared = runCli({"compare", "--nodes", nodes, "--validate", "loo", "--json"});
    FT_VERIFY_STATUS(compared, 0);
    const json result = compared.json();
    QCOMPARE(result.at("places").get<int>(), 41);
    FT_VERIFY_MATCH(near(result.at("before").at("position_mm").at("rms").get<double>(), held_out_mm, 0.01));
    int n_rigid = 0;
    for (const json& score : result.at("position")) {
      if (score.at("method") != "rigid") continue;
      ++n_rigid;
      FT_VERIFY_MATCH(near(score.at("position_mm").at("rms").get<double>(), held_out_mm, 0.01));
    }
    QCOMPARE(n_rigid, 1);
    // Positions only: nothing can be said about orientation.
    QVERIFY(result.at("before").at("orientation_deg").is_null());
    QVERIFY(!result.at("verdict").at("apply_orientation").get<bool>());
  }

  void plusSamplesBecomeNodes() {
    FT_REQUIRE_REAL_DATA();
    const QString nodes = folder_.filePath("plus.nodes.csv"), samples = folder_.filePath("plus.samples.csv");
    const CliRun run = runCli({"import", "--format", "plus", "--in", data("pluslib_fcal/samples.csv"), "--nodes", nodes,
                               "--samples", samples, "--json"});
    FT_VERIFY_STATUS(run, 0);
    QCOMPARE(run.json().at("nodes").at("places").get<int>(), 8);
    QCOMPARE(run.json().at("samples").at("rows").get<int>(), 1000);
    FT_VERIFY_STATUS(runCli({"compare", "--nodes", nodes, "--json"}), 0);
  }

  void trajectoriesHaveSamplesOnly() {
    FT_REQUIRE_REAL_DATA();
    const QString in = data("polhemus_hand/user1_cup0.traj");
    const CliRun refused =
        runCli({"import", "--format", "traj", "--in", in, "--nodes", folder_.filePath("t.nodes.csv")});
    FT_VERIFY_STATUS(refused, 1);
    FT_VERIFY_MATCH(holdsAll(refused.err.toStdString(), {"no true positions", "--samples"}));
    QVERIFY(!QFile::exists(folder_.filePath("t.nodes.csv")));
    const CliRun run =
        runCli({"import", "--format", "traj", "--in", in, "--samples", folder_.filePath("t.samples.csv"), "--json"});
    FT_VERIFY_STATUS(run, 0);
    QVERIFY(run.json().at("samples").at("rows").get<int>() > 100);
  }

  void realRecordingsAreRecognised_data() {
    QTest::addColumn<QString>("file");
    QTest::addColumn<QString>("format");
    QTest::newRow("anser") << "anser_duplo/nodes.csv"
                           << "anser";
    QTest::newRow("lighthouse") << "lighthouse/20200917_Exp1.nodes.csv"
                                << "nodes";
    QTest::newRow("PLUS samples") << "pluslib_fcal/samples.csv"
                                  << "plus";
    QTest::newRow("trajectory") << "polhemus_hand/user1_cup0.traj"
                                << "traj";
    QTest::newRow("means by their columns")
        << "pluslib_fcal/nodes.csv"
        << "columns:x=tip_mean_x_mm,y=tip_mean_y_mm,z=tip_mean_z_mm,x_true=true_x_mm,y_true=true_y_mm,"
           "z_true=true_z_mm,node=landmark";
  }
  void realRecordingsAreRecognised() {
    FT_REQUIRE_REAL_DATA();
    QFETCH(QString, file);
    QFETCH(QString, format);
    const CliRun run = runCli({"import", "--guess", "--in", data(file.toStdString()), "--json"});
    FT_VERIFY_STATUS(run, 0);
    QCOMPARE(QString::fromStdString(run.json().at("format").get<std::string>()), format);
  }

  /// As it stands, the command that a guess prints reads the file.
  void printedCommandReadsTheFile_data() {
    QTest::addColumn<QString>("file");
    QTest::addColumn<QString>("written");
    QTest::newRow("node table") << "a.csv"
                                << "a.csv.nodes.csv";
    QTest::newRow("columns") << "columns.csv"
                             << "columns.csv.nodes.csv";
    QTest::newRow("columns without truth") << "readings.csv"
                                           << "readings.csv.samples.csv";
    QTest::newRow("trajectory") << "a.traj"
                                << "a.traj.samples.csv";
    QTest::newRow("calibration") << "a.nrrd"
                                 << "a.nrrd.ftcal.json";
  }
  void printedCommandReadsTheFile() {
    QFETCH(QString, file);
    QFETCH(QString, written);
    makeFilesToGuess();
    const CliRun guess = runCli({"import", "--guess", "--in", folder_.filePath(file)});
    FT_VERIFY_STATUS(guess, 0);
    QVERIFY(!QFile::exists(folder_.filePath(written)));
    const QString command = QString::fromUtf8(guess.out).split('\n', Qt::SkipEmptyParts).last().replace('\'', '"');
    FT_VERIFY_STATUS(runCli(QProcess::splitCommand(command).mid(1)), 0);
    QVERIFY(QFile::exists(folder_.filePath(written)));
  }

  /// To the byte: what a session gives back is what was in the table.
  void recordingsComeBackFromTheirSession() {
    FT_REQUIRE_REAL_DATA();
    const QString before = folder_.filePath("before.csv"), after = folder_.filePath("after.csv");
    for (const char* file : {"lighthouse/20200917_Exp1.nodes.csv", "lighthouse/20201002_Exp2.nodes.csv"}) {
      const QString session = folder_.filePath("s.fieldtrue");
      FT_VERIFY_STATUS(
          runCli({"import", "--format", "nodes", "--in", data(file), "--nodes", before, "--session", session}), 0);
      FT_VERIFY_STATUS(runCli({"tables", "--session", session, "--nodes", after}), 0);
      QFile first(before), second(after);
      QVERIFY(first.open(QIODevice::ReadOnly) && second.open(QIODevice::ReadOnly));
      QCOMPARE(second.readAll(), first.readAll());
      // What is there is not replaced.
      FT_VERIFY_STATUS(runCli({"import", "--format", "nodes", "--in", data(file), "--session", session}), 1);
      QVERIFY(QFile::remove(session));
    }
  }

  void formatsAreListedWithTheirSettings() {
    const CliRun run = runCli({"formats", "--json"});
    FT_VERIFY_STATUS(run, 0);
    const json listed = run.json();
    bool found = false;
    for (const json& row : listed.at("import")) {
      for (const char* key : {"id", "label", "settings", "needs_truth"}) QVERIFY2(row.contains(key), key);
      for (const json& setting : row.at("settings")) {
        for (const char* key : {"key", "label", "type", "unit", "default"}) QVERIFY2(setting.contains(key), key);
      }
      found = found || row.at("id") == "anser";
    }
    QVERIFY(found);
    QVERIFY(listed.at("export").size() >= 2);
  }

 private:
  void makeFilesToGuess() {
    const auto at = [this](const char* name) { return folder_.filePath(name); };
    QVERIFY(writeWhole(at("columns.csv"),
                       "x_mm;y_mm;z_mm;x_true_mm;y_true_mm;z_true_mm\n1;2;3;1;2;3\n100;200;300;100;200;300\n"
                       "400;5;6;400;5;6\n70;8;9;70;8;9\n"));
    QVERIFY(writeWhole(at("readings.csv"), "x_mm,y_mm,z_mm\n1,2,3\n100,200,300\n400,5,6\n70,8,9\n"));
    QVERIFY(writeWhole(at("a.traj"),
                       "1 0 0 0.1\n0 1 0 0.2\n0 0 1 0.3\n0 0 0 1\n\n1 0 0 0.2\n0 1 0 0.2\n0 0 1 0.3\n0 0 0 1\n"));
    FT_VERIFY_STATUS(runCli({"simulate", "--plan", "grid:3x3x3@0.2", "--seed", "1", "--samples-per-node", "5",
                             "--nodes", at("a.csv")}),
                     0);
    FT_VERIFY_STATUS(runCli({"fit", "--nodes", at("a.csv"), "--position", "affine", "--out", at("a.ftcal.json")}), 0);
    FT_VERIFY_STATUS(runCli({"export", "--calibration", at("a.ftcal.json"), "--format", "itk_nrrd",
                             "--max-deviation-um", "1000", "--force", "--out", at("a.nrrd")}),
                     0);
  }

  QTemporaryDir folder_;
};

FIELDTRUE_TEST(CliImportTest)
#include "cli_import_test.moc"
