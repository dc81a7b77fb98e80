#include <QTemporaryDir>
#include <QTest>

#include "calib/calibration/corrector.h"
#include "calib/tables/table_io.h"
#include "calib/tables/table_writer.h"
#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

/// Sensors that err differently, from a table to what other programs read.
using namespace fieldtrue;
using namespace fieldtrue::testing;
using nlohmann::json;

class CliSensorsTest : public QObject {
  Q_OBJECT

  QTemporaryDir folder_;
  QString at(const QString& name) const { return folder_.filePath(name); }

  CliRun fit(const QString& sensors, const QString& name) {
    return runCli({"fit", "--nodes", at("two.nodes.csv"), "--position", "polynomial:degree=2", "--sensors", sensors,
                   "--json", "--out", at(name)});
  }

 private slots:
  void initTestCase() {
    SyntheticOptions options;
    options.smooth_distortion_m = 0.02;
    CalibrationTable table = syntheticTable(options);
    std::vector<Node> second = table.nodes;
    for (Node& node : second) {
      node.sensor = 4;
      node.tracker_from_sensor.position_m *= 1.02;  // A gain that the first does not have.
    }
    table.nodes.insert(table.nodes.end(), second.begin(), second.end());
    FT_VERIFY_OK(writeNodeTable(std::filesystem::path(at("two.nodes.csv").toStdString()), table));
  }

  void theEvidenceDecides() {
    const CliRun by_itself = fit("auto", "auto.ftcal.json");
    FT_VERIFY_STATUS(by_itself, 0);
    QVERIFY(by_itself.json().at("sensors_apart") == json({0, 4}));
    FT_VERIFY_MATCH(holdsAll(by_itself.json().at("notes").dump(), {"The sensors err differently", "kfold:10"}));
    FT_VERIFY_STATUS(fit("separate", "separate.ftcal.json"), 0);
    FT_VERIFY_STATUS(fit("shared", "shared.ftcal.json"), 0);
    QVERIFY(json::parse(readWhole(at("auto.ftcal.json")).toStdString()).at("by_sensor") ==
            json::parse(readWhole(at("separate.ftcal.json")).toStdString()).at("by_sensor"));
    QVERIFY(!json::parse(readWhole(at("shared.ftcal.json")).toStdString()).contains("by_sensor"));
    FT_VERIFY_STATUS(fit("sometimes", "never.ftcal.json"), 2);
  }

  void applyGoesByTheRow() {
    FT_VERIFY_STATUS(
        runCli({"apply", "--calibration", at("auto.ftcal.json"), "--in", at("two.nodes.csv"), "--out", at("out.csv")}),
        0);
    const auto corrector = calibration::Corrector::load(at("auto.ftcal.json").toStdString());
    FT_VERIFY_OK(corrector);
    const auto table = readNodeTable(at("two.nodes.csv").toStdString());
    QList<QByteArray> lines = readWhole(at("out.csv")).split('\n');
    while (lines.first().startsWith('#')) lines.removeFirst();
    const QList<QByteArray> names = lines.takeFirst().split(',');
    for (std::size_t i = 0; i < table->table.nodes.size(); ++i) {
      const Node& node = table->table.nodes[i];
      const QList<QByteArray> fields = lines[static_cast<qsizetype>(i)].split(',');
      const auto value = [&](const char* name) { return fields[names.indexOf(name)].toDouble(); };
      const Eigen::Vector3d seen_m(value("x_corrected_m"), value("y_corrected_m"), value("z_corrected_m"));
      FT_VERIFY_MATCH(near(seen_m, corrector->correct(node.tracker_from_sensor, node.sensor).position_m, 1e-12));
      QCOMPARE(value("covered"), 1.0);
    }
  }

  void rowsOfNoSuchSensorAreTold() {
    QVERIFY(writeWhole(at("other.csv"), "sensor,x_m,y_m,z_m\n4,0.5,0.1,0.1\n7,0.5,0.1,0.1\n"));
    const CliRun run =
        runCli({"apply", "--calibration", at("auto.ftcal.json"), "--in", at("other.csv"), "--out", at("o.csv")});
    FT_VERIFY_STATUS(run, 0);
    FT_VERIFY_MATCH(holdsAll(run.err.toStdString(), {"1 of 2 rows", "sensors 0 and 4", "corrected as sensor 0"}));
  }

  void formatsThatHoldOneAskForTheSensor() {
    const auto exported = [&](const QString& format, const QString& out, const QStringList& more) {
      return runCli(
          QStringList{"export", "--calibration", at("auto.ftcal.json"), "--format", format, "--out", at(out)} + more);
    };
    const CliRun unsaid = exported("polynomial_json", "p.json", {});
    FT_VERIFY_STATUS(unsaid, 1);
    FT_VERIFY_MATCH(holdsAll(unsaid.err.toStdString(), {"sensors 0 and 4", "--sensor"}));
    QVERIFY(!QFile::exists(at("p.json")));
    FT_VERIFY_STATUS(exported("polynomial_json", "0.json", {"--sensor", "0"}), 0);
    FT_VERIFY_STATUS(exported("polynomial_json", "4.json", {"--sensor", "4"}), 0);
    QVERIFY(readWhole(at("0.json")) != readWhole(at("4.json")));
    FT_VERIFY_STATUS(exported("polynomial_json", "5.json", {"--sensor", "5"}), 1);
    FT_VERIFY_STATUS(exported("csv", "all.csv", {}), 0);
    FT_VERIFY_STATUS(exported("ftcal", "baked.ftcal.json", {"--bake-um", "50"}), 0);
    QVERIFY(json::parse(readWhole(at("baked.ftcal.json")).toStdString())
                .at("by_sensor")
                .at("4")
                .at("position")
                .contains("baked"));
  }

  void aSensorThatWasNotFittedIsNotMadeUp() {
    FT_VERIFY_STATUS(runCli({"fit", "--nodes", at("two.nodes.csv"), "--position", "affine", "--sensor", "4", "--out",
                             at("four.ftcal.json")}),
                     0);
    const CliRun run = runCli({"export", "--calibration", at("four.ftcal.json"), "--format", "ftcal", "--sensor", "0",
                               "--out", at("zero.ftcal.json")});
    FT_VERIFY_STATUS(run, 1);
    FT_VERIFY_MATCH(holdsAll(run.err.toStdString(), {"fitted on sensor 4", "nothing of sensor 0"}));
    FT_VERIFY_STATUS(runCli({"export", "--calibration", at("four.ftcal.json"), "--format", "ftcal", "--sensor", "4",
                             "--out", at("same.ftcal.json")}),
                     0);
    QCOMPARE(readWhole(at("same.ftcal.json")), readWhole(at("four.ftcal.json")));
  }

  void numbersThatPassedThroughOtherProgramsAreKnown() {
    QVERIFY(writeWhole(at("float.csv"), "sensor,x_m,y_m,z_m\n4.0,0.5,0.1,0.1\n"));
    QVERIFY(writeWhole(at("whole.csv"), "sensor,x_m,y_m,z_m\n4,0.5,0.1,0.1\n"));
    const auto applied = [&](const QString& in) {
      const QString out = at("applied_" + in);
      FT_VERIFY_STATUS(runCli({"apply", "--calibration", at("auto.ftcal.json"), "--in", at(in), "--out", out}), 0);
    };
    applied("float.csv");
    applied("whole.csv");
    QCOMPARE(readWhole(at("applied_float.csv")).replace("\n4.0,", "\n4,"), readWhole(at("applied_whole.csv")));
  }

  /// Corrected by itself such a sensor looks splendid, held out too.
  void aSensorWithExchangedAxesIsNotCorrectedInSilence() {
    auto exchanged = readNodeTable(at("two.nodes.csv").toStdString());
    FT_VERIFY_OK(exchanged);
    for (Node& node : exchanged->table.nodes) {
      Eigen::Vector3d& p_m = node.tracker_from_sensor.position_m;
      if (node.sensor == 4) std::swap(p_m.y(), p_m.z());
    }
    FT_VERIFY_OK(writeNodeTable(std::filesystem::path(at("exchanged.nodes.csv").toStdString()), exchanged->table));
    const CliRun fitted = runCli({"fit", "--nodes", at("exchanged.nodes.csv"), "--position", "polynomial:degree=2",
                                  "--json", "--out", at("exchanged.ftcal.json")});
    FT_VERIFY_STATUS(fitted, 0);
    FT_VERIFY_MATCH(holdsAll(fitted.json().at("notes").dump(), {"readings of sensor 4 are a mirror image"}));
    const CliRun compared = runCli({"compare", "--nodes", at("exchanged.nodes.csv"), "--methods", "affine", "--json"});
    FT_VERIFY_STATUS(compared, 0);
    const json verdict = compared.json().at("verdict");
    QVERIFY(verdict.at("apply_position") == false && verdict.at("apply_orientation") == false);
    FT_VERIFY_MATCH(holdsAll(verdict.at("text").dump(), {"Do not apply", "readings of sensor 4 are a mirror image"}));
    FT_VERIFY_MATCH(holdsAll(verdict.at("mirrored").dump(), {"sensor 4"}));
  }

  void changesAreToldOfOneSensor() {
    const CliRun unsaid = runCli({"difference", at("auto.ftcal.json"), at("separate.ftcal.json")});
    FT_VERIFY_STATUS(unsaid, 1);
    FT_VERIFY_MATCH(holdsAll(unsaid.err.toStdString(), {"sensors 0 and 4", "--sensor N"}));
    FT_VERIFY_STATUS(runCli({"difference", at("auto.ftcal.json"), at("separate.ftcal.json"), "--sensor", "4"}), 0);
  }
};

FIELDTRUE_TEST(CliSensorsTest)
#include "cli_sensors_test.moc"
