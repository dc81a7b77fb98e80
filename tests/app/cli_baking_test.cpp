#include <QFileInfo>
#include <QTemporaryDir>
#include <QTest>

#include "calib/calibration/corrector.h"
#include "calib/tables/table_io.h"
#include "calib/tables/table_writer.h"
#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

/// Baking a calibration from the command line.
class CliBakingTest : public QObject {
  Q_OBJECT
 private slots:
  void initTestCase() {
    QVERIFY2(QFileInfo(cliPath()).isExecutable(), qPrintable(cliPath() + " is not built"));
    SyntheticOptions options;
    options.smooth_distortion_m = 0.03;
    table_ = syntheticTable(options, {.seed = 4, .position_sd_m = 0.0005});
    FT_VERIFY_OK(writeNodeTable(std::filesystem::path(at("a.nodes.csv").toStdString()), table_));
    FT_VERIFY_STATUS(runCli({"fit", "--nodes", at("a.nodes.csv"), "--position", "hmq", "--out", at("a.ftcal.json")}),
                     0);
  }

  void fitBakesWithinTheBound() {
    const CliRun run = runCli({"fit", "--nodes", at("a.nodes.csv"), "--position", "hmq", "--bake-um", "50", "--out",
                               at("baked.ftcal.json"), "--json"});
    FT_VERIFY_STATUS(run, 0);
    FT_VERIFY_MATCH(holdsAll(run.json().at("notes").dump(), {"Baked: lattice", "largest deviation"}));
    verifyNear("baked.ftcal.json", 50e-6);
  }

  void exportBakesWithinTheBound() {
    const CliRun run = runCli({"export", "--calibration", at("a.ftcal.json"), "--format", "ftcal", "--bake-um", "500",
                               "--out", at("exported.ftcal.json")});
    FT_VERIFY_STATUS(run, 0);
    verifyNear("exported.ftcal.json", 500e-6);
  }

  void whatCannotBeBakedIsToldInOneLine_data() {
    QTest::addColumn<QStringList>("arguments");
    QTest::addColumn<int>("status");
    QTest::addColumn<QList<QByteArray>>("fragments");
    const QStringList fit = {"fit", "--nodes", at("a.nodes.csv"), "--out", at("none.ftcal.json")};
    QTest::newRow("a method that jumps") << fit + QStringList{"--position", "local_linear", "--bake-um", "1"} << 1
                                         << QList<QByteArray>{"within 1 um", "larger deviation"};
    QTest::newRow("a bound below zero") << fit + QStringList{"--position", "hmq", "--bake-um", "-3"} << 2
                                        << QList<QByteArray>{"--bake-um", "0.01"};
    QTest::newRow("baked already") << QStringList{"export",   "--calibration", at("baked.ftcal.json"),
                                                  "--format", "ftcal",         "--bake-um",
                                                  "50",       "--out",         at("none.ftcal.json")}
                                   << 1 << QList<QByteArray>{"baked already"};
  }
  void whatCannotBeBakedIsToldInOneLine() {
    QFETCH(QStringList, arguments);
    QFETCH(int, status);
    QFETCH(QList<QByteArray>, fragments);
    const CliRun run = runCli(arguments);
    FT_VERIFY_STATUS(run, status);
    QCOMPARE(run.err.trimmed().count('\n'), 0);
    for (const QByteArray& fragment : fragments) QVERIFY2(run.err.contains(fragment), run.err.constData());
    QVERIFY(!QFileInfo::exists(at("none.ftcal.json")));
  }

 private:
  QString at(const char* name) const { return folder_.filePath(name); }

  void verifyNear(const char* name, double bound_m) {
    const auto original = calibration::Corrector::load(at("a.ftcal.json").toStdString());
    const auto baked = calibration::Corrector::load(at(name).toStdString());
    FT_VERIFY_OK(original);
    FT_VERIFY_OK(baked);
    QVERIFY(baked->isBaked() && !original->isBaked());
    for (std::size_t i = 0; i + 1 < table_.nodes.size(); ++i) {
      const Eigen::Vector3d middle_m =
          0.5 * (table_.nodes[i].tracker_from_sensor.position_m + table_.nodes[i + 1].tracker_from_sensor.position_m);
      FT_VERIFY_MATCH(near(baked->correctPosition_m(middle_m), original->correctPosition_m(middle_m), bound_m));
    }
  }

  QTemporaryDir folder_;
  CalibrationTable table_;
};

FIELDTRUE_TEST(CliBakingTest)
#include "cli_baking_test.moc"
