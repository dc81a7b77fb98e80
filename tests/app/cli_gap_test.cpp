#include <QTemporaryDir>
#include <QTest>

#include "calib/simulation/scene.h"
#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"
#include "tests/support/xml_tree.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;
using nlohmann::json;

namespace {

const char* const kPlan = "grid:5x5x4@0.3:origin=0.6,-0.6,-0.45:order=random:seed=3";

/// A metal sphere beside the grid, and a jig that is set to half a millimetre.
const QByteArray kMetalScene = R"({
  "schema": "fieldtrue.scene/1",
  "rig": {"tolerance_m": 0.0005, "tolerance_rad": 0.001},
  "effects": [{"id": "compact_metal", "parameters": {"center_m": [1.2, 0.0, -0.9], "radius_m": 0.15}}]
})";
const QByteArray kCleanScene =
    R"({"schema": "fieldtrue.scene/1", "rig": {"tolerance_m": 0.0005, "tolerance_rad": 0.001}})";

}  // namespace

class CliGapTest : public QObject {
  Q_OBJECT

 private slots:
  void initTestCase() {
    QVERIFY(folder_.isValid());
    QVERIFY(writeWhole(at("metal.scene.json"), kMetalScene));
    QVERIFY(writeWhole(at("clean.scene.json"), kCleanScene));
  }

  void metalIsFoundAddedAndGone() {
    FT_VERIFY_STATUS(simulated("metal.scene.json", "metal", 1), 0);
    QVERIFY(writeWhole(at("ideal.scene.json"), R"({"schema": "fieldtrue.scene/1"})"));
    const CliRun first = diagnosed("metal", "ideal.scene.json",
                                   {"--updated-scene", at("updated.scene.json"), "--html", at("metal.html")});
    FT_VERIFY_STATUS(first, 0);
    const json report = json::parse(readWhole(at("metal.gap.json")).toStdString());
    for (const char* key :
         {"schema", "software", "input", "alignment", "verdict", "text", "smallest_detectable", "gap", "where",
          "findings", "candidates", "selected", "remaining", "isolability", "next_measurement"}) {
      QVERIFY2(report.contains(key), key);
    }
    QCOMPARE(report["schema"].get<std::string>(), std::string("fieldtrue.gap/1"));
    QCOMPARE(report["input"]["places"].get<int>(), 100);
    QCOMPARE(report["verdict"].get<std::string>(), std::string("explained"));
    QCOMPARE(report["selected"].size(), std::size_t(1));
    QCOMPARE(report["selected"][0]["effect"].get<std::string>(), std::string("compact_metal"));
    const json& p_m = report["selected"][0]["location_m"];
    FT_VERIFY_MATCH(near(Eigen::Vector3d(p_m[0], p_m[1], p_m[2]), Eigen::Vector3d(1.2, 0.0, -0.9), 0.05));
    double probability = 0.0;
    bool has_none = false;
    for (const json& candidate : report["candidates"]) {
      probability += candidate["probability"].get<double>();
      has_none = has_none || candidate["effect"] == "none";
    }
    FT_VERIFY_MATCH(near(probability, 1.0, 1e-9));
    QVERIFY(has_none);
    QString error;
    const auto page = parseXml(readWhole(at("metal.html")), error);
    QVERIFY2(error.isEmpty(), qPrintable(error));
    QVERIFY(page->text.contains(QString::fromStdString(report["text"].get<std::string>())));
    QVERIFY(first.out.startsWith("explained: "));
    QVERIFY(first.out.contains("compact_metal"));

    const auto updated = simulation::readScene(at("updated.scene.json").toStdString());
    FT_VERIFY_OK(updated);
    QCOMPARE(updated->effects.size(), std::size_t(1));
    QCOMPARE(updated->rig.tolerance_m, 0.0005);  // As the recording states.
    QCOMPARE(updated->rig.tolerance_rad, 0.001);
    FT_VERIFY_STATUS(simulated("updated.scene.json", "again", 2), 0);
    FT_VERIFY_STATUS(diagnosed("again", "updated.scene.json", {}), 0);
    const json again = json::parse(readWhole(at("again.gap.json")).toStdString());
    QCOMPARE(again["verdict"].get<std::string>(), std::string("no_gap"));
  }

  void threadsNeverChangeTheReport() {
    FT_VERIFY_STATUS(simulated("metal.scene.json", "threads", 4), 0);
    FT_VERIFY_STATUS(diagnosed("threads", "clean.scene.json", {"--threads", "1"}), 0);
    const QByteArray one = readWhole(at("threads.gap.json"));
    const CliRun run = diagnosed("threads", "clean.scene.json", {"--threads", "2", "--json"});
    FT_VERIFY_STATUS(run, 0);
    QCOMPARE(readWhole(at("threads.gap.json")), one);
    QVERIFY(run.json() == json::parse(one.toStdString()));
  }

  /// Before all places are looked at, and without a word in the report of them.
  void someOfThePlacesAreToldFirst() {
    FT_VERIFY_STATUS(runCli({"simulate", "--scene", at("metal.scene.json"), "--plan",
                             "grid:6x6x5@0.24:origin=0.6,-0.6,-0.45", "--seed", "5", "--nodes", at("many.nodes.csv")}),
                     0);
    const auto diagnosedTo = [&](const char* name, const QStringList& more) {
      return runCli(QStringList{"diagnose", "--nodes", at("many.nodes.csv"), "--out", at(name)} + more);
    };
    const CliRun plain = diagnosedTo("plain.gap.json", {});
    FT_VERIFY_STATUS(plain, 0);
    QVERIFY(!plain.err.contains("Provisional"));
    const CliRun run = diagnosedTo("many.gap.json", {"--first"});
    FT_VERIFY_STATUS(run, 0);
    QVERIFY2(run.err.startsWith("Provisional, by 60 of the places: The gap "), run.err.constData());
    QVERIFY2(run.err.contains("etal"), run.err.constData());
    QCOMPARE(readWhole(at("many.gap.json")), readWhole(at("plain.gap.json")));
  }

  /// Metal carried in between two recordings of other places: told, and in the document as the contract has it.
  void whatChangedIsTold() {
    const QString other = "grid:4x4x4@0.33:origin=0.55,-0.45,-0.5";
    FT_VERIFY_STATUS(simulated("clean.scene.json", "before", 1), 0);
    FT_VERIFY_STATUS(runCli({"simulate", "--scene", at("metal.scene.json"), "--plan", other, "--seed", "2", "--nodes",
                             at("after.nodes.csv")}),
                     0);
    const CliRun run = runCli({"diagnose", "--nodes", at("after.nodes.csv"), "--against", at("before.nodes.csv"),
                               "--out", at("change.gap.json")});
    FT_VERIFY_STATUS(run, 0);
    const json against = json::parse(readWhole(at("change.gap.json")).toStdString())["against"];
    QVERIFY2(against["changed"] == true && against["p_value"] < 0.01, against.dump().c_str());
    QVERIFY(against["rms_mm"].get<double>() > 0.0 && against["location_m"].size() == 3);
    QCOMPARE(against["effect"].get<std::string>(), std::string("compact_metal"));
    QVERIFY(run.out.contains("The field changed since the earlier recording"));
  }

  void badInputIsOneSentence_data() {
    QTest::addColumn<QStringList>("arguments");
    QTest::addColumn<int>("status");
    QTest::addColumn<QByteArray>("fragment");
    QTest::newRow("no nodes") << QStringList{"diagnose", "--out", at("x.gap.json")} << 2 << QByteArray("--nodes");
    QTest::newRow("no such file") << QStringList{"diagnose", "--nodes", at("none.csv"), "--out", at("x.gap.json")} << 1
                                  << QByteArray("none.csv");
    QTest::newRow("too few places") << QStringList{"diagnose", "--nodes", at("few.nodes.csv"), "--out",
                                                   at("x.gap.json")}
                                    << 1 << QByteArray("8 places");
    const QString few = at("few.nodes.csv");
    QTest::newRow("samples of what changed")
        << QStringList{"diagnose", "--nodes", few, "--against", few, "--samples", few, "--out", at("x.gap.json")} << 2
        << QByteArray("--samples tells nothing");
    QTest::newRow("a first look at what changed")
        << QStringList{"diagnose", "--nodes", few, "--against", few, "--first", "--out", at("x.gap.json")} << 2
        << QByteArray("--first");
    QTest::newRow("no plan") << QStringList{"plan-check"} << 2 << QByteArray("--plan");
    QTest::newRow("bad plan") << QStringList{"plan-check", "--plan", "grid:5x5"} << 2 << QByteArray("5x5");
  }

  void badInputIsOneSentence() {
    QFETCH(QStringList, arguments);
    QFETCH(int, status);
    QFETCH(QByteArray, fragment);
    QVERIFY(
        writeWhole(at("few.nodes.csv"), "node,x_true_m,y_true_m,z_true_m,x_m,y_m,z_m\n0,1,0,0,1,0,0\n1,0,1,0,0,1,0\n"));
    const CliRun run = runCli(arguments);
    FT_VERIFY_STATUS(run, status);
    QCOMPARE(run.err.count('\n'), 1);
    QVERIFY2(run.err.contains(fragment), run.err.constData());
    QVERIFY(!QFile::exists(at("x.gap.json")));
  }

  void aPlansBlindSpotsAreTold() {
    const CliRun run = runCli({"plan-check", "--plan", kPlan, "--json"});
    FT_VERIFY_STATUS(run, 0);
    const json result = run.json();
    QVERIFY(result["pairs"].size() > 10);
    double scales = 0.0;
    for (const json& pair : result["pairs"]) {
      const double r2 = pair["r2"];
      QVERIFY(r2 >= 0.0 && r2 <= 1.0 + 1e-9);
      const std::string a = pair["a"], b = pair["b"];
      if ((a == "grid_scale" && b == "global_gain") || (b == "grid_scale" && a == "global_gain")) scales = r2;
    }
    // A unit error of the jig and of the tracker are the same thing.
    FT_VERIFY_MATCH(near(scales, 1.0, 1e-3));
    QCOMPARE(result["orientations"]["count"].get<int>(), 1);
    QCOMPARE(result["orientations"]["coil_ways_told"].get<int>(), 0);
    const CliRun text = runCli({"plan-check", "--plan", kPlan});
    FT_VERIFY_STATUS(text, 0);
    QVERIFY(text.out.contains("cannot be told apart"));
    QVERIFY(text.out.contains("One orientation: a correction holds"));
  }

  void theBlindProgramIsStartedOrMissed() {
    const CliRun run = runCli({"blind", "generate", "--help"});
    if (run.status == 1) {
      QVERIFY2(run.err.contains("fieldtrue-blind is not beside"), run.err.constData());
      QCOMPARE(run.err.count('\n'), 1);
    } else {
      FT_VERIFY_STATUS(run, 0);
      QVERIFY(!run.out.isEmpty());
    }
  }

 private:
  QString at(const QString& name) const { return folder_.filePath(name); }

  CliRun simulated(const QString& scene, const QString& name, int seed) const {
    return runCli({"simulate", "--scene", at(scene), "--plan", kPlan, "--seed", QString::number(seed), "--nodes",
                   at(name + ".nodes.csv"), "--samples", at(name + ".samples.csv")});
  }

  CliRun diagnosed(const QString& name, const QString& scene, const QStringList& more) const {
    return runCli(QStringList{"diagnose", "--nodes", at(name + ".nodes.csv"), "--samples", at(name + ".samples.csv"),
                              "--scene", at(scene), "--out", at(name + ".gap.json")} +
                  more);
  }

  QTemporaryDir folder_;
};

FIELDTRUE_TEST(CliGapTest)
#include "cli_gap_test.moc"
