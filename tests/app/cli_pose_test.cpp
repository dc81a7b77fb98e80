#include <QTemporaryDir>
#include <QTest>
#include <cmath>

#include "calib/calibration/corrector.h"
#include "calib/tables/table_io.h"
#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

/// A correction whose input is the whole pose, through files: a sensor whose coils differ errs with how it is turned.
using namespace fieldtrue;
using namespace fieldtrue::testing;
using nlohmann::json;

namespace {

const QByteArray kUnequalCoils = R"({ "schema": "fieldtrue.scene/1",
  "rig": { "tolerance_m": 0.0005, "tolerance_rad": 0.002 },
  "effects": [
    { "id": "coil_gain", "parameters": { "receiver_gain": [0.01, -0.01, 0.005] } },
    { "id": "coil_nonorthogonality", "parameters": { "receiver_rad": [0.005, -0.01, 0.005] } } ] })";

double rmsOf(const json& comparison, const std::string& inputs) {
  for (const json& score : comparison.at("position"))
    if (score.at("settings").value("inputs", "") == inputs) return score.at("position_mm").at("rms").get<double>();
  return NAN;
}

}  // namespace

class CliPoseTest : public QObject {
  Q_OBJECT

  QTemporaryDir folder_;
  QString at(const QString& name) const { return folder_.filePath(name); }

  void simulate(const QString& plan, const QString& name) {
    FT_VERIFY_STATUS(
        runCli({"simulate", "--scene", at("coils.scene.json"), "--plan", plan, "--seed", "3", "--nodes", at(name)}), 0);
  }

 private slots:
  void initTestCase() {
    QVERIFY(writeWhole(at("coils.scene.json"), kUnequalCoils));
    simulate("grid:4x4x3@0.2:orientations=3", "three.csv");
    simulate("grid:4x4x3@0.2", "one.csv");
    FT_VERIFY_STATUS(
        runCli({"fit", "--nodes", at("three.csv"), "--position", "gaussian_process", "--out", at("pose.ftcal.json")}),
        0);
  }

  void orientationTakesMoreThanAQuarterOfTheExcessAway() {
    const CliRun run = runCli({"compare", "--nodes", at("three.csv"), "--json", "--methods",
                               "none,gaussian_process:inputs=position,gaussian_process"});
    FT_VERIFY_STATUS(run, 0);
    const json comparison = run.json();
    const double floor2 = std::pow(comparison.at("floor").at("position_mm").get<double>(), 2);
    const double position2 = std::pow(rmsOf(comparison, "position"), 2) - floor2;
    const double pose2 = std::pow(rmsOf(comparison, "auto"), 2) - floor2;
    QVERIFY2(pose2 < 0.75 * position2, qPrintable(QString("%1 of %2 mm2").arg(pose2).arg(position2)));
  }

  void inOneOrientationItIsTheSameCorrection() {
    for (const QString& inputs : QStringList{"auto", "position"})
      FT_VERIFY_STATUS(runCli({"fit", "--nodes", at("one.csv"), "--position", "gaussian_process:inputs=" + inputs,
                               "--out", at(inputs + ".ftcal.json")}),
                       0);
    const json with_auto = json::parse(readWhole(at("auto.ftcal.json")).toStdString());
    const json position = json::parse(readWhole(at("position.ftcal.json")).toStdString());
    QVERIFY(with_auto.at("position").at("parameters") == position.at("position").at("parameters"));
    QCOMPARE(with_auto.at("inputs").get<std::string>(), "position");
    QCOMPARE(with_auto.at("schema").get<std::string>(), "fieldtrue.ftcal/1");
    QCOMPARE(with_auto.at("orientations_seen").size(), std::size_t{1});
  }

  void theFileTellsItsInputsAndOrientations() {
    const json file = json::parse(readWhole(at("pose.ftcal.json")).toStdString());
    QCOMPARE(file.at("schema").get<std::string>(), "fieldtrue.ftcal/2");
    QCOMPARE(file.at("inputs").get<std::string>(), "pose");
    QCOMPARE(file.at("orientations_seen").size(), std::size_t{3});
  }

  void applyCorrectsTheWholePose() {
    FT_VERIFY_STATUS(
        runCli({"apply", "--calibration", at("pose.ftcal.json"), "--in", at("three.csv"), "--out", at("out.csv")}), 0);
    const auto corrector = calibration::Corrector::load(at("pose.ftcal.json").toStdString());
    FT_VERIFY_OK(corrector);
    const auto table = readNodeTable(at("three.csv").toStdString());
    FT_VERIFY_OK(table);
    QList<QByteArray> lines = readWhole(at("out.csv")).split('\n');
    while (lines.first().startsWith('#')) lines.removeFirst();
    const QList<QByteArray> names = lines.takeFirst().split(',');
    double squares_m2 = 0.0;
    for (std::size_t i = 0; i < table->table.nodes.size(); ++i) {
      const Node& node = table->table.nodes[i];
      const QList<QByteArray> fields = lines[static_cast<qsizetype>(i)].split(',');
      const auto value = [&](const char* name) { return fields[names.indexOf(name)].toDouble(); };
      const Eigen::Vector3d seen_m(value("x_corrected_m"), value("y_corrected_m"), value("z_corrected_m"));
      FT_VERIFY_MATCH(near(seen_m, corrector->correct(node.tracker_from_sensor).position_m, 1e-12));
      FT_VERIFY_MATCH(near(value("uncertainty_m"), *corrector->uncertaintyAt_m(node.tracker_from_sensor), 1e-9));
      QVERIFY(value("nearest_orientation_deg") < 5.0);
      squares_m2 += (seen_m - node.reference_from_sensor.position_m).squaredNorm();
    }
    const double rms_m = std::sqrt(squares_m2 / static_cast<double>(table->table.nodes.size()));
    FT_VERIFY_MATCH(near(rms_m, corrector->report().rms_m, 1e-9));
  }

  void withoutOrientationsItSaysWhatItDid() {
    QVERIFY(writeWhole(at("positions.csv"), "x_m,y_m,z_m\n0.5,0.1,0.1\n"));
    const CliRun run =
        runCli({"apply", "--calibration", at("pose.ftcal.json"), "--in", at("positions.csv"), "--out", at("p.csv")});
    FT_VERIFY_STATUS(run, 0);
    FT_VERIFY_MATCH(holdsAll(run.err.toStdString(), {"no orientations", "the mean of the 3 orientations"}));
    const auto corrector = calibration::Corrector::load(at("pose.ftcal.json").toStdString());
    const QList<QByteArray> fields = readWhole(at("p.csv")).split('\n')[1].split(',');
    const Eigen::Vector3d seen_m(fields[3].toDouble(), fields[4].toDouble(), fields[5].toDouble());
    FT_VERIFY_MATCH(near(seen_m, corrector->correctPosition_m({0.5, 0.1, 0.1}), 1e-12));
  }

  void latticesTakeTheOrientationToo() {
    const CliRun run = runCli({"fit", "--nodes", at("three.csv"), "--position", "gaussian_process", "--bake-um", "50",
                               "--out", at("baked.ftcal.json")});
    FT_VERIFY_STATUS(run, 0);
    FT_VERIFY_MATCH(holdsAll(run.out.toStdString(), {"Baked with the sensor's orientation"}));
    QCOMPARE(json::parse(readWhole(at("baked.ftcal.json")).toStdString()).at("inputs").get<std::string>(), "pose");
    const auto baked = calibration::Corrector::load(at("baked.ftcal.json").toStdString());
    const auto exact = calibration::Corrector::load(at("pose.ftcal.json").toStdString());
    const auto table = readNodeTable(at("three.csv").toStdString());
    for (const Node& node : table->table.nodes)
      FT_VERIFY_MATCH(near(baked->correct(node.tracker_from_sensor).position_m,
                           exact->correct(node.tracker_from_sensor).position_m, 50e-6));
  }
};

FIELDTRUE_TEST(CliPoseTest)
#include "cli_pose_test.moc"
