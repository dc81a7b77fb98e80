#include <Eigen/Geometry>
#include <QFileInfo>
#include <QTemporaryDir>
#include <QTest>
#include <cmath>
#include <map>
#include <set>

#include "calib/calibration/corrector.h"
#include "calib/correctors/method_label.h"
#include "calib/tables/table_io.h"
#include "calib/tables/table_writer.h"
#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"
#include "tests/support/xml_tree.h"

/// From a simulated room to a report, through files, as a script would do it.
using namespace fieldtrue;
using namespace fieldtrue::testing;
using nlohmann::json;

namespace {

const QString kScene = QStringLiteral(FIELDTRUE_RESOURCES "/scenes/steel_floor.scene.json");
const QStringList kScores = {"mean", "median", "rms", "p95", "max", "rms_low90", "rms_high90"};

/// Best rigid transform by the singular-value method, as Eigen has it.
Eigen::Matrix4d rigidFit(const std::vector<Node>& nodes, int left_out) {
  std::vector<const Node*> used;
  for (const Node& node : nodes) {
    if (node.node != left_out) used.push_back(&node);
  }
  Eigen::Matrix3Xd tracked(3, static_cast<Eigen::Index>(used.size())), truth(tracked);
  for (Eigen::Index i = 0; i < tracked.cols(); ++i) {
    tracked.col(i) = used[static_cast<std::size_t>(i)]->tracker_from_sensor.position_m;
    truth.col(i) = used[static_cast<std::size_t>(i)]->reference_from_sensor.position_m;
  }
  return Eigen::umeyama(tracked, truth, false);
}

/// RMS over places of a table with one row a place, each predicted by the rigid fit of the others [mm].
double leaveOneOutRigid_mm(const std::vector<Node>& nodes) {
  double sum_m2 = 0.0;
  for (const Node& node : nodes) {
    const Eigen::Matrix4d fit = rigidFit(nodes, node.node);
    const Eigen::Vector3d predicted_m =
        fit.topLeftCorner<3, 3>() * node.tracker_from_sensor.position_m + fit.topRightCorner<3, 1>();
    sum_m2 += (predicted_m - node.reference_from_sensor.position_m).squaredNorm();
  }
  return 1000.0 * std::sqrt(sum_m2 / static_cast<double>(nodes.size()));
}

const json& scoreOf(const json& comparison, const char* kind, const std::string& method) {
  static const json kNone;
  for (const json& score : comparison.at(kind)) {
    if (score.at("method") == method) return score;
  }
  return kNone;
}

/// Seconds and nanoseconds differ from run to run; nothing else may.
json withoutTimes(json comparison) {
  for (const char* kind : {"position", "orientation"}) {
    for (json& score : comparison.at(kind)) {
      score.erase("fit_s");
      score.erase("eval_ns");
    }
  }
  return comparison;
}

QList<QByteArrayList> csvRows(const QByteArray& text) {
  QList<QByteArrayList> rows;
  for (const QByteArray& line : text.split('\n')) {
    if (!line.isEmpty() && !line.startsWith('#')) rows.append(line.split(','));
  }
  return rows;
}

}  // namespace

class CliChainTest : public QObject {
  Q_OBJECT
 private slots:
  void initTestCase() {
    QVERIFY2(QFileInfo(cliPath()).isExecutable(), qPrintable(cliPath() + " is not built"));
    QVERIFY(folder_.isValid());
    const CliRun run = runCli({"simulate", "--scene", kScene, "--plan", "grid:4x4x3@0.2", "--seed", "5", "--nodes",
                               at("a.nodes.csv"), "--samples", at("a.samples.csv"), "--samples-per-node", "20"});
    FT_VERIFY_STATUS(run, 0);
    const auto reading = readNodeTable(std::filesystem::path(at("a.nodes.csv").toStdString()));
    FT_VERIFY_OK(reading);
    table_ = reading->table;
    QCOMPARE(table_.nodes.size(), std::size_t(48));
  }

  void simulateWritesWhatWasPlanned() {
    std::set<int> places;
    for (const Node& node : table_.nodes) {
      places.insert(node.node);
      QCOMPARE(node.n_used + node.n_rejected, 20);
      QVERIFY(node.has_orientation);
    }
    QCOMPARE(places.size(), std::size_t(48));
    const auto samples = readSampleTable(std::filesystem::path(at("a.samples.csv").toStdString()));
    FT_VERIFY_OK(samples);
    QCOMPARE(samples->table.rows.size(), std::size_t(48 * 20));
  }

  void simulateIsRepeatable() {
    const auto simulated = [this](const char* seed, const char* threads) {
      const CliRun run = runCli({"simulate", "--scene", kScene, "--plan", "grid:4x4x3@0.2", "--seed", seed, "--nodes",
                                 at("b.nodes.csv"), "--samples-per-node", "20", "--threads", threads});
      return run.status == 0 ? readWhole(at("b.nodes.csv")) : QByteArray();
    };
    const QByteArray first = readWhole(at("a.nodes.csv"));
    QVERIFY(!first.isEmpty());
    QCOMPARE(simulated("5", "1"), first);
    QCOMPARE(simulated("5", "2"), first);
    QVERIFY(simulated("6", "2") != first);
  }

  void compareHasEveryKeyOfTheContract() {
    const json& result = comparison();
    QCOMPARE(result.at("schema").get<std::string>(), std::string("fieldtrue.compare/1"));
    for (const char* key : {"software", "validate", "align", "places", "validation_places", "floor", "before",
                            "position", "orientation", "best", "verdict"}) {
      QVERIFY2(result.contains(key), key);
    }
    for (const char* key : {"position_mm", "orientation_deg", "from"}) QVERIFY2(result["floor"].contains(key), key);
    for (const char* key :
         {"apply_position", "apply_orientation", "gain_low90", "gain_high90", "gain_without_worst_place", "text"}) {
      QVERIFY2(result["verdict"].contains(key), key);
    }
    QVERIFY(result["best"].contains("position") && result["best"].contains("orientation"));
    // Tuned methods are among all of them.
    QCOMPARE(result["validate"].get<std::string>(), std::string("kfold:10"));
    QCOMPARE(result["places"].get<int>(), 48);
    for (const char* key :
         {"coverage", "fold_back", "orientation_cover", "position_dependence", "orientation_dependence", "trueness"})
      QVERIFY2(result.at(key).is_object(), key);
    for (const char* key :
         {"coverage", "fold_back", "orientation_cover", "position_dependence", "orientation_dependence"})
      QVERIFY2(!result.at(key).at("text").get<std::string>().empty(), key);
    verifyScores(result, "position", "position_mm", {"rms_common_mm"});
    verifyScores(result, "orientation", "orientation_deg", {});
  }

  void compareScoresEveryMethodOfTheRegistry() {
    const CliRun methods = runCli({"methods", "--json"});
    FT_VERIFY_STATUS(methods, 0);
    const json listed = methods.json();
    for (const char* kind : {"position", "orientation"}) {
      std::set<std::string> known, scored;
      for (const json& row : listed.at(kind)) known.insert(row.at("id"));
      for (const json& row : comparison().at(kind)) scored.insert(row.at("method"));
      QVERIFY(known.size() >= 4);
      QVERIFY(known == scored);
    }
  }

  void methodsTellHowUnclearSourcesAreRead() {
    const json listed = runCli({"methods", "--json"}).json();
    std::map<std::string, std::string> readings;
    for (const json& row : listed.at("position")) readings[row.at("id")] = row.at("reading");
    FT_VERIFY_MATCH(holdsAll(readings.at("trilinear"), {"mean of the level", "16 nearest", "largest pitch"}));
    QCOMPARE(readings.at("local_briggs"), readings.at("trilinear"));
    FT_VERIFY_MATCH(holdsAll(readings.at("hmq"), {"origin", "transmitter"}));
    QVERIFY(readings.at("polynomial").empty());
    QVERIFY(runCli({"methods"}).out.contains("Read as: "));
  }

  void heldOutRigidErrorIsReproduced() {
    const double expected_mm = leaveOneOutRigid_mm(table_.nodes);
    QVERIFY(expected_mm > 0.1);
    const CliRun baselines = runCli({"compare", "--nodes", at("a.nodes.csv"), "--methods", "none,rigid", "--json"});
    FT_VERIFY_STATUS(baselines, 0);
    const json one_by_one = baselines.json();
    QVERIFY(one_by_one.at("validate") == "loo" && one_by_one.at("align") == "rigid");
    const json& score = scoreOf(one_by_one, "position", "rigid");
    FT_VERIFY_MATCH(near(score.at("position_mm").at("rms").get<double>(), expected_mm, 1e-6 * expected_mm));
    const double before_mm = one_by_one.at("before").at("position_mm").at("rms");
    FT_VERIFY_MATCH(near(before_mm, expected_mm, 1e-6 * expected_mm));
    const CliRun run =
        runCli({"compare", "--nodes", at("a.nodes.csv"), "--methods", "rigid", "--align", "none", "--json"});
    FT_VERIFY_STATUS(run, 0);
    const json result = run.json();
    const double rigid_mm = scoreOf(result, "position", "rigid").at("position_mm").at("rms");
    FT_VERIFY_MATCH(near(rigid_mm, expected_mm, 1e-6 * expected_mm));
    double raw_m2 = 0.0;
    for (const Node& node : table_.nodes) {
      raw_m2 += (node.tracker_from_sensor.position_m - node.reference_from_sensor.position_m).squaredNorm();
    }
    const double raw_mm = 1000.0 * std::sqrt(raw_m2 / static_cast<double>(table_.nodes.size()));
    FT_VERIFY_MATCH(near(result["before"]["position_mm"]["rms"].get<double>(), raw_mm, 1e-6 * raw_mm));
  }

  void methodListsMeanBothKinds_data() {
    QTest::addColumn<QString>("methods");
    QTest::addColumn<QStringList>("position");
    QTest::addColumn<QStringList>("orientation");
    QTest::newRow("position only") << "affine,polynomial:degree=2" << QStringList{"affine", "polynomial"}
                                   << QStringList{"none"};
    QTest::newRow("both kinds") << "rigid" << QStringList{"rigid"} << QStringList{"rigid"};
    QTest::newRow("orientation only") << "hmq_matrix" << QStringList{"none"} << QStringList{"hmq_matrix"};
    QTest::newRow("settings with a comma") << "affine,rbf:kernel=cubic,smoothing=0,polynomial:degree=2"
                                           << QStringList{"affine", "rbf", "polynomial"} << QStringList{"none"};
    QTest::newRow("same method twice") << "polynomial:degree=1,polynomial:degree=2"
                                       << QStringList{"polynomial", "polynomial"} << QStringList{"none"};
  }

  void methodListsMeanBothKinds() {
    QFETCH(QString, methods);
    QFETCH(QStringList, position);
    QFETCH(QStringList, orientation);
    const CliRun run =
        runCli({"compare", "--nodes", at("a.nodes.csv"), "--validate", "kfold:4", "--methods", methods, "--json"});
    FT_VERIFY_STATUS(run, 0);
    const json result = run.json();
    QCOMPARE(result.at("validate").get<std::string>(), std::string("kfold:4"));
    QCOMPARE(methodIds(result, "position"), position);
    QCOMPARE(methodIds(result, "orientation"), orientation);
  }

  void threadsNeverChangeAResult() {
    const auto compared = [this](const char* threads) {
      return withoutTimes(
          runCli({"compare", "--nodes", at("a.nodes.csv"), "--validate", "kfold:5", "--json", "--threads", threads})
              .json());
    };
    QVERIFY(compared("1") == compared("2"));
    const auto fitted = [this](const char* threads) {
      const CliRun run = runCli({"fit", "--nodes", at("a.nodes.csv"), "--position", "hmq", "--orientation",
                                 "hmq_matrix", "--out", at("t.ftcal.json"), "--threads", threads});
      return run.status == 0 ? readWhole(at("t.ftcal.json")) : QByteArray();
    };
    const QByteArray one = fitted("1");
    QVERIFY(!one.isEmpty());
    QCOMPARE(fitted("2"), one);
  }

  void theTableForPeopleEndsWithTheVerdict() {
    const CliRun run =
        runCli({"compare", "--nodes", at("a.nodes.csv"), "--validate", "kfold:4", "--methods", "none,rigid"});
    FT_VERIFY_STATUS(run, 0);
    const json same =
        runCli({"compare", "--nodes", at("a.nodes.csv"), "--validate", "kfold:4", "--methods", "none,rigid", "--json"})
            .json();
    QCOMPARE(run.out.trimmed().split('\n').last().toStdString(), same.at("verdict").at("text").get<std::string>());
  }

  void methodsAreNamedAsInTheWindow() {
    const CliRun run = runCli({"compare", "--nodes", at("a.nodes.csv"), "--validate", "kfold:4", "--methods",
                               "none,affine,hmq,polynomial:degree=2", "--learning-curve"});
    FT_VERIFY_STATUS(run, 0);
    for (const std::string& label :
         {correctors::positionLabel("affine"), correctors::positionLabel("hmq"), correctors::positionLabel("none"),
          correctors::positionLabel("polynomial", {{"degree", 2.0}})})
      QVERIFY2(run.out.contains(label.c_str()), label.c_str());
    for (const char* id : {"hmq", "polynomial:"}) QVERIFY2(!run.out.contains(id), id);
    const CliRun fit = runCli({"fit", "--nodes", at("a.nodes.csv"), "--position", "hmq", "--out", at("n.ftcal.json")});
    FT_VERIFY_STATUS(fit, 0);
    QVERIFY2(fit.out.startsWith(("Fitted " + correctors::positionLabel("hmq") + " (position)").c_str()),
             qPrintable(fit.out));
  }

  void learningCurvesAreAddedWhenAskedFor() {
    const CliRun run = runCli({"compare", "--nodes", at("a.nodes.csv"), "--validate", "kfold:4", "--methods",
                               "rigid,affine", "--learning-curve", "--html", at("curves.html"), "--json"});
    FT_VERIFY_STATUS(run, 0);
    const json curves = run.json().at("learning_curves");
    QCOMPARE(curves.size(), std::size_t(2));
    QCOMPARE(curves[1].at("method").get<std::string>(), std::string("affine"));
    // A fifth of 48 places is held out.
    QCOMPARE(curves[1].at("points").back().at("places").get<int>(), 39);
    QVERIFY(readWhole(at("curves.html")).contains("<polyline"));
    QVERIFY(!comparison().contains("learning_curves"));
  }

  void fitPrintsItsInSampleFigures() {
    const CliRun run = runCli({"fit", "--nodes", at("a.nodes.csv"), "--position", "rigid", "--align", "none", "--out",
                               at("rigid.ftcal.json"), "--json"});
    FT_VERIFY_STATUS(run, 0);
    const Eigen::Matrix4d fit = rigidFit(table_.nodes, -1);
    double sum_m2 = 0.0, max_m = 0.0;
    for (const Node& node : table_.nodes) {
      const Eigen::Vector3d p_m =
          fit.topLeftCorner<3, 3>() * node.tracker_from_sensor.position_m + fit.topRightCorner<3, 1>();
      const double error_m = (p_m - node.reference_from_sensor.position_m).norm();
      sum_m2 += error_m * error_m;
      max_m = std::max(max_m, error_m);
    }
    const json in_sample = run.json().at("in_sample");
    const double rms_mm = 1000.0 * std::sqrt(sum_m2 / 48.0);
    FT_VERIFY_MATCH(near(in_sample.at("rms_mm").get<double>(), rms_mm, 1e-6 * rms_mm));
    FT_VERIFY_MATCH(near(in_sample.at("max_mm").get<double>(), 1000.0 * max_m, 1e-6 * rms_mm));
  }

  void validationRowsAreNotFitted() {
    QByteArray text = readWhole(at("a.nodes.csv"));
    CalibrationTable table = table_;
    for (std::size_t i = 0; i < 8; ++i) table.nodes[i].role = NodeRole::kValidation;
    FT_VERIFY_OK(writeNodeTable(std::filesystem::path(at("v.nodes.csv").toStdString()), table));
    const CliRun run =
        runCli({"fit", "--nodes", at("v.nodes.csv"), "--position", "affine", "--out", at("v.ftcal.json"), "--json"});
    FT_VERIFY_STATUS(run, 0);
    QCOMPARE(run.json().at("n_nodes").get<int>(), 40);
    QCOMPARE(run.json().at("n_not_used").get<int>(), 8);
  }

  void applyAppendsWhatTheCalibrationSays() {
    FT_VERIFY_STATUS(runCli({"fit", "--nodes", at("a.nodes.csv"), "--position", "rigid", "--align", "none", "--out",
                             at("rigid.ftcal.json")}),
                     0);
    const QByteArray input =
        "# frame: jig\nnote,z_m,y_m,x_m,qw,qx,qy,qz\n"
        "\"a, b\",0.1,0.2,0.5,1,0,0,0\n"
        "# between the rows\n"
        "far away,1,2,30,0.5,0.5,0.5,0.5\r\n";
    QVERIFY(writeWhole(at("in.csv"), input));
    FT_VERIFY_STATUS(
        runCli({"apply", "--calibration", at("rigid.ftcal.json"), "--in", at("in.csv"), "--out", at("out.csv")}), 0);
    const QList<QByteArray> lines = readWhole(at("out.csv")).split('\n');
    QCOMPARE(lines.size(), qsizetype(6));
    QCOMPARE(lines[0], QByteArray("# frame: jig"));
    QCOMPARE(lines[1],
             QByteArray(
                 "note,z_m,y_m,x_m,qw,qx,qy,qz,x_corrected_m,y_corrected_m,z_corrected_m,qw_corrected,"
                 "qx_corrected,qy_corrected,qz_corrected,uncertainty_m,covered,nearest_orientation_deg,setup_matches"));
    QVERIFY(lines[2].startsWith("\"a, b\",0.1,0.2,0.5,1,0,0,0,"));
    QCOMPARE(lines[3], QByteArray("# between the rows"));
    const Eigen::Matrix4d fit = rigidFit(table_.nodes, -1);
    verifyCorrected(lines[2].mid(7), fit * Eigen::Vector4d(0.5, 0.2, 0.1, 1.0));
    verifyCorrected(lines[4], fit * Eigen::Vector4d(30, 2, 1, 1.0));
    const QList<QByteArray> far = lines[4].split(',');
    QCOMPARE(far[far.size() - 3], QByteArray("0"));
    // Fitted in one orientation only, and this row is turned by 120 degrees.
    const double turned_deg =
        180.0 / M_PI *
        angleBetween_rad(table_.nodes.front().tracker_from_sensor.orientation, Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5));
    FT_VERIFY_MATCH(near(far[far.size() - 2].toDouble(), turned_deg, 5.0));
    // Neither side states a set-up.
    QCOMPARE(far.last().trimmed(), QByteArray("unknown"));
  }

  void applyKeepsReadingsTheTrackerMarked() {
    FT_VERIFY_STATUS(runCli({"fit", "--nodes", at("a.nodes.csv"), "--position", "rigid", "--align", "none", "--out",
                             at("rigid.ftcal.json")}),
                     0);
    QVERIFY(writeWhole(at("in.csv"), "x_m,y_m,z_m,status\nnan,nan,nan,k\n0.4,0.1,0.1,\n"));
    FT_VERIFY_STATUS(
        runCli({"apply", "--calibration", at("rigid.ftcal.json"), "--in", at("in.csv"), "--out", at("out.csv")}), 0);
    const auto rows = csvRows(readWhole(at("out.csv")));
    QCOMPARE(rows.at(1),
             (QByteArrayList{"nan", "nan", "nan", "k", "", "", "", "", "", "", "", "", "0", "", "unknown"}));
    QVERIFY(!rows.at(2).at(4).isEmpty());
    QCOMPARE(rows.at(2).at(7), QByteArray());  // no orientation in, none out
  }

  void applyTakesWhatARowHolds() {
    FT_VERIFY_STATUS(runCli({"fit", "--nodes", at("a.nodes.csv"), "--position", "rigid", "--orientation", "rigid",
                             "--align", "none", "--out", at("rigid.ftcal.json")}),
                     0);
    // A whole row, the mark of a missing reading in the position, in the orientation, an orientation left blank, and a
    // number that no tracker reads.
    QVERIFY(writeWhole(at("in.csv"),
                       "x_m,y_m,z_m,qw,qx,qy,qz\n0.5,0.2,0.1,1,0,0,0\n-3.7e28,-3.7e28,-3.7e28,1,0,0,0\n"
                       "0.5,0.2,0.1,-3.7e28,0,0,0\n0.5,0.2,0.1,,,,\n1e100,0,0,1,0,0,0\n"));
    const CliRun run =
        runCli({"apply", "--calibration", at("rigid.ftcal.json"), "--in", at("in.csv"), "--out", at("out.csv")});
    FT_VERIFY_STATUS(run, 0);
    FT_VERIFY_MATCH(holdsAll(run.out.toStdString(), {"5 rows written", "3 without a pose"}));
    FT_VERIFY_MATCH(holdsAll(run.err.toStdString(), {"1 of 5 rows", "have no orientation"}));
    const auto rows = csvRows(readWhole(at("out.csv")));
    const auto corrected = [&](qsizetype row) { return rows.at(row).mid(7, 7); };
    QVERIFY(!corrected(1).contains(QByteArray()));
    for (const qsizetype row : {2, 3, 5}) QCOMPARE(corrected(row), QByteArrayList(7, QByteArray()));
    QCOMPARE(corrected(4).first(3), corrected(1).first(3));
    QCOMPARE(corrected(4).mid(3), QByteArrayList(4, QByteArray()));
    // Three of four numbers are a mistake, as before.
    QVERIFY(writeWhole(at("in.csv"), "x_m,y_m,z_m,qw,qx,qy,qz\n0.5,0.2,0.1,1,0,,0\n"));
    const CliRun refused =
        runCli({"apply", "--calibration", at("rigid.ftcal.json"), "--in", at("in.csv"), "--out", at("out.csv")});
    QCOMPARE(refused.status, 1);
    FT_VERIFY_MATCH(holdsAll(refused.err.toStdString(), {"line 2", "qy"}));
  }

  void applyCorrectsWholeTables_data() {
    QTest::addColumn<QString>("in");
    QTest::newRow("nodes") << "a.nodes.csv";
    QTest::newRow("samples") << "a.samples.csv";
  }

  void applyCorrectsWholeTables() {
    QFETCH(QString, in);
    FT_VERIFY_STATUS(runCli({"fit", "--nodes", at("a.nodes.csv"), "--position", "hmq", "--orientation", "rigid",
                             "--out", at("hmq.ftcal.json")}),
                     0);
    FT_VERIFY_STATUS(runCli({"apply", "--calibration", at("hmq.ftcal.json"), "--in", at(in), "--out", at("whole.csv")}),
                     0);
    const auto corrector = calibration::Corrector::load(at("hmq.ftcal.json").toStdString());
    FT_VERIFY_OK(corrector);
    const auto before = csvRows(readWhole(at(in)));
    const auto after = csvRows(readWhole(at("whole.csv")));
    QCOMPARE(after.size(), before.size());
    const auto column = [&](const char* name) { return after.front().indexOf(name); };
    for (qsizetype i = 0; i < after.size(); ++i) QCOMPARE(after[i].first(before[i].size()), before[i]);
    for (qsizetype i = 1; i < after.size(); i += 7) {
      const auto value = [&](const char* name) { return after[i][column(name)].toDouble(); };
      const Eigen::Vector3d p_m(value("x_m"), value("y_m"), value("z_m"));
      const Eigen::Vector3d expected_m = corrector->correctPosition_m(p_m);
      const Eigen::Vector3d seen_m(value("x_corrected_m"), value("y_corrected_m"), value("z_corrected_m"));
      FT_VERIFY_MATCH(near(seen_m, expected_m, 1e-12));
      QCOMPARE(value("covered") == 1.0, corrector->covers(p_m));
    }
  }

  void exportsKeepTheCalibration() {
    FT_VERIFY_STATUS(
        runCli({"fit", "--nodes", at("a.nodes.csv"), "--position", "polynomial:degree=2", "--out", at("p.ftcal.json")}),
        0);
    FT_VERIFY_STATUS(
        runCli({"export", "--calibration", at("p.ftcal.json"), "--format", "ftcal", "--out", at("q.ftcal.json")}), 0);
    QCOMPARE(readWhole(at("q.ftcal.json")), readWhole(at("p.ftcal.json")));
    FT_VERIFY_STATUS(runCli({"export", "--calibration", at("p.ftcal.json"), "--format", "csv", "--out", at("p.csv")}),
                     0);
    QVERIFY(csvRows(readWhole(at("p.csv"))).size() > 10);
  }

  void reportIsOneWellFormedPage() {
    const CliRun run = runCli({"report", "--nodes", at("a.nodes.csv"), "--methods", "affine,rigid", "--validate",
                               "kfold:4", "--html", at("r.html"), "--json"});
    FT_VERIFY_STATUS(run, 0);
    QString error;
    const auto page = parseXml(readWhole(at("r.html")), error);
    QVERIFY2(error.isEmpty(), qPrintable(error));
    QCOMPARE(page->all("p").front()->text.toStdString(), run.json().at("verdict").get<std::string>());
    QVERIFY(page->text.contains("a.nodes.csv"));
    QVERIFY(!page->all("img").empty() || page->text.contains("Pictures could not be drawn"));
    const CliRun compared = runCli({"compare", "--nodes", at("a.nodes.csv"), "--methods", "affine,rigid", "--validate",
                                    "kfold:4", "--html", at("c.html")});
    FT_VERIFY_STATUS(compared, 0);
    QVERIFY(readWhole(at("c.html")).contains("</html>"));
  }

 private:
  QString at(const QString& name) const { return folder_.filePath(name); }

  const json& comparison() {
    if (comparison_.is_null()) comparison_ = runCli({"compare", "--nodes", at("a.nodes.csv"), "--json"}).json();
    return comparison_;
  }

  static QStringList methodIds(const json& result, const char* kind) {
    QStringList ids;
    for (const json& row : result.at(kind)) ids.append(QString::fromStdString(row.at("method")));
    return ids;
  }

  static void verifyScores(const json& result, const char* kind, const char* stats, const QStringList& more) {
    QVERIFY(!result.at(kind).empty());
    for (const json& score : result.at(kind)) {
      for (const QString& key :
           QStringList{"method", "settings", stats, "n_uncovered", "fit_s", "eval_ns", "skipped"} + more) {
        QVERIFY2(score.contains(key.toStdString()), qPrintable(QString(kind) + ": " + key));
      }
      if (!score.at("skipped").is_null()) continue;
      for (const QString& key : kScores) QVERIFY2(score.at(stats).contains(key.toStdString()), qPrintable(key));
      const json& e = score.at(stats);
      QVERIFY(e["median"] <= e["p95"] && e["p95"] <= e["max"] && e["mean"] <= e["rms"] && e["rms"] <= e["max"]);
    }
  }

  static void verifyCorrected(const QByteArray& line, const Eigen::Vector4d& expected_m) {
    const QByteArrayList cells = line.split(',');
    for (int axis = 0; axis < 3; ++axis) {
      FT_VERIFY_MATCH(near(cells.at(cells.size() - 11 + axis).toDouble(), expected_m[axis], 1e-9));
    }
  }

  QTemporaryDir folder_;
  CalibrationTable table_;
  json comparison_;
};

FIELDTRUE_TEST(CliChainTest)
#include "cli_chain_test.moc"
