#include <QTemporaryDir>
#include <QTest>

#include "calib/tables/table_io.h"
#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

/// Scattered places brought to a grid in tracked space.
using namespace fieldtrue;
using namespace fieldtrue::testing;
using nlohmann::json;

namespace {

const QString kScene = QStringLiteral(FIELDTRUE_RESOURCES "/scenes/steel_floor.scene.json");
const QString kInside = QStringLiteral("grid:3x3x3@0.2:origin=0.5,-0.2,-0.2");

}  // namespace

class CliResampleTest : public QObject {
  Q_OBJECT
 private slots:
  void initTestCase() {
    FT_VERIFY_STATUS(runCli({"simulate", "--scene", kScene, "--plan", "grid:5x5x5@0.2:origin=0.3,-0.4,-0.4", "--seed",
                             "3", "--nodes", measured_}),
                     0);
  }

  void bringsATableToAGrid_data() {
    QTest::addColumn<QString>("method");
    for (const char* method : {"briggs", "livingston", "czernuszenko"}) QTest::newRow(method) << method;
  }
  void bringsATableToAGrid() {
    QFETCH(QString, method);
    const QString out = folder_.filePath(method + ".nodes.csv");
    const CliRun run =
        runCli({"resample", "--nodes", measured_, "--method", method, "--plan", kInside, "--nodes-out", out, "--json"});
    FT_VERIFY_STATUS(run, 0);
    const json answer = run.json();
    QCOMPARE(answer.at("nodes").get<int>(), 27);
    QCOMPARE(answer.at("without_support").get<int>(), 0);
    QVERIFY(answer.at("held_out").at("rms_mm").get<double>() > 0.0);
    QVERIFY(answer.at("held_out").at("places").get<int>() >= 27);  // The inner 3x3x3 at least.
    QCOMPARE(answer.at("held_out").at("places").get<int>() + answer.at("held_out").at("without_support").get<int>(),
             125);
    QVERIFY(answer.at("floor_mm").get<double>() > 0.0);
    const auto table = readNodeTable(std::filesystem::path(out.toStdString()));
    FT_VERIFY_OK(table);
    const auto source = readNodeTable(std::filesystem::path(measured_.toStdString()));
    FT_VERIFY_OK(source);
    QCOMPARE(table->table.metadata.frame, source->table.metadata.frame);
    QCOMPARE(QString::fromStdString(table->table.metadata.other.at("resampled")), method);
    for (const Node& node : table->table.nodes) {
      QVERIFY(node.index.has_value() && node.role == NodeRole::kFit);
      const Eigen::Vector3d expected_m(0.5 + 0.2 * (*node.index)[0], -0.2 + 0.2 * (*node.index)[1],
                                       -0.2 + 0.2 * (*node.index)[2]);
      FT_VERIFY_MATCH(near(node.tracker_from_sensor.position_m, expected_m, 1e-12));
    }
    // The floor of steel bends by centimetres at most: the truth stays near what was tracked.
    FT_VERIFY_STATUS(runCli({"fit", "--nodes", out, "--position", "rigid", "--out", folder_.filePath("r.ftcal.json")}),
                     0);
  }

  void tellsItsOwnErrorBesideTheFloor() {
    const CliRun run = runCli({"resample", "--nodes", measured_, "--method", "czernuszenko", "--plan", kInside,
                               "--nodes-out", folder_.filePath("told.nodes.csv")});
    FT_VERIFY_STATUS(run, 0);
    FT_VERIFY_MATCH(holdsAll(run.out.toStdString(), {"27 of 27 grid nodes", "Error of the resampling", "mm RMS over",
                                                     "Noise floor of the table", "mm ("}));
  }

  void nodesWithoutSupportAreSkippedAndSaid() {
    const QString out = folder_.filePath("wide.nodes.csv");
    const CliRun run = runCli({"resample", "--nodes", measured_, "--method", "livingston", "--plan",
                               "grid:3x3x6@0.2:origin=0.5,-0.2,-0.2", "--nodes-out", out, "--width-pitches", "0.7"});
    FT_VERIFY_STATUS(run, 0);
    FT_VERIFY_MATCH(holdsAll(run.err.toStdString(), {"of 54 grid nodes lie outside", "skipped", "extrapolated"}));
    const auto table = readNodeTable(std::filesystem::path(out.toStdString()));
    FT_VERIFY_OK(table);
    QCOMPARE(table->table.metadata.other.at("resampled_width_pitches"), std::string("0.7"));
    for (const Node& node : table->table.nodes) {
      if ((*node.index)[2] <= 2) QVERIFY(node.role == NodeRole::kFit);
      if ((*node.index)[2] >= 4) QVERIFY(node.role == NodeRole::kSkipped);  // 0.2 m above the highest level.
    }
  }

  void wrongRequestsAreSaid_data() {
    QTest::addColumn<QStringList>("arguments");
    QTest::addColumn<int>("status");
    QTest::addColumn<QList<QByteArray>>("says");
    const auto row = [](const char* name, const QString& method, const QString& plan, int status,
                        const QList<QByteArray>& says) {
      QTest::newRow(name) << QStringList{"--method", method, "--plan", plan} << status << says;
    };
    row("unknown method", "kriging", kInside, 2, {"kriging", "briggs, livingston, czernuszenko"});
    row("orientations", "briggs", kInside + ":orientations=3", 2, {"orientations"});
    row("bad plan", "briggs", "grid:3x3@0.2", 2, {"3x3@0.2"});
    row("grid elsewhere", "briggs", "grid:3x3x3@0.2:origin=5,5,5", 1, {"None of the 27 grid nodes"});
  }
  void wrongRequestsAreSaid() {
    QFETCH(QStringList, arguments);
    QFETCH(int, status);
    QFETCH(QList<QByteArray>, says);
    const QString out = folder_.filePath("wrong.nodes.csv");
    const CliRun run = runCli(QStringList{"resample", "--nodes", measured_, "--nodes-out", out} + arguments);
    FT_VERIFY_STATUS(run, status);
    FT_VERIFY_MATCH(holdsAll(run.err.toStdString(), says));
    QVERIFY(!QFile::exists(out));
  }

  void aPlanOfSinglePlacesIsNoGrid() {
    const QString plan = folder_.filePath("single.plan.json");
    QVERIFY(
        writeWhole(plan, R"({"schema": "fieldtrue.plan/1", "nodes": [{"node": 1, "x_m": 0.5, "y_m": 0, "z_m": 0}]})"));
    const CliRun run = runCli({"resample", "--nodes", measured_, "--method", "briggs", "--plan", plan, "--nodes-out",
                               folder_.filePath("single.nodes.csv")});
    FT_VERIFY_STATUS(run, 2);
    FT_VERIFY_MATCH(holdsAll(run.err.toStdString(), {"grid in tracked space"}));
  }

 private:
  QTemporaryDir folder_;
  const QString measured_ = folder_.filePath("measured.nodes.csv");
};

FIELDTRUE_TEST(CliResampleTest)
#include "cli_resample_test.moc"
