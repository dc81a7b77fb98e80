#include <QDir>
#include <QFileInfo>
#include <QTemporaryDir>
#include <QTest>

#include "calib/tables/table_io.h"
#include "calib/tables/table_writer.h"
#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

/// Exporting from the command line: names, directions, refusals. What the files hold is checked by other programs, in
/// tests/exporters.
class CliExportTest : public QObject {
  Q_OBJECT

  QTemporaryDir folder_;
  QString at(const QString& name) const { return folder_.filePath(name); }
  QStringList base(const QString& format, const QString& out, const QString& calibration = "room.ftcal.json") const {
    return {"export", "--calibration", at(calibration), "--format", format, "--out", at(out)};
  }
  QByteArray content(const QString& name) const {
    QFile file(at(name));
    return file.open(QIODevice::ReadOnly) ? file.readAll() : QByteArray();
  }

 private slots:
  void initTestCase() {
    SyntheticOptions options;
    options.smooth_distortion_m = 0.03;
    FT_VERIFY_OK(writeNodeTable(std::filesystem::path(at("room.nodes.csv").toStdString()),
                                syntheticTable(options, {.seed = 4, .position_sd_m = 0.0005})));
    for (const auto& [method, name] : {std::pair{"rbf", "room"}, std::pair{"local_linear", "jumps"}})
      FT_VERIFY_STATUS(runCli({"fit", "--nodes", at("room.nodes.csv"), "--position", method, "--out",
                               at(QString(name) + ".ftcal.json")}),
                       0);
    QVERIFY(writeWhole(at("coils.scene.json"), R"({ "schema": "fieldtrue.scene/1", "effects": [
      { "id": "coil_gain", "parameters": { "receiver_gain": [0.01, -0.01, 0.005] } } ] })"));
    FT_VERIFY_STATUS(runCli({"simulate", "--scene", at("coils.scene.json"), "--plan", "grid:4x4x3@0.2:orientations=3",
                             "--nodes", at("coils.nodes.csv")}),
                     0);
    FT_VERIFY_STATUS(runCli({"fit", "--nodes", at("coils.nodes.csv"), "--position", "gaussian_process", "--out",
                             at("coils.ftcal.json")}),
                     0);
  }

  void aFolderGetsANameThatSaysTheDirection() {
    QVERIFY(QDir(folder_.path()).mkdir("files"));
    FT_VERIFY_STATUS(runCli(base("itk_mha", "files")), 0);
    QVERIFY(QFileInfo::exists(at("files/room_measured-to-true.mha")));
    FT_VERIFY_STATUS(runCli(base("vtk_vti", "files") + QStringList{"--direction", "true-to-measured"}), 0);
    QVERIFY(QFileInfo::exists(at("files/room_true-to-measured.vti")));
    QCOMPARE(QDir(at("files")).entryList(QDir::Files).size(), 2);
  }

  void theAnswerTellsWhatIsInTheFile() {
    const CliRun run = runCli(base("numpy", "a.npz") + QStringList{"--json", "--max-deviation-um", "200"});
    FT_VERIFY_STATUS(run, 0);
    const nlohmann::json told = run.json();
    QVERIFY(told.at("deviation").at("worst_um").get<double>() <= 200.0);
    QCOMPARE(told.at("deviation").at("points").get<int>(), 10000);
    QVERIFY(told.at("held_out_rms_mm").get<double>() > 0.0);
    QCOMPARE(told.at("direction").get<std::string>(), std::string("measured-to-true"));
    // A field for 3D Slicer says so itself.
    FT_VERIFY_STATUS(runCli(base("itk_nrrd", "a.nrrd")), 0);
    const QByteArray head = content("a.nrrd").left(4000);
    for (const char* fact :
         {"displacement field type:=modeling", "fieldtrue.unit:=millimetres", "fieldtrue.direction:=measured-to-true",
          "fieldtrue.handedness:=right-handed", "fieldtrue.position_method:=rbf",
          "fieldtrue.held_out_rms_mm:=", "fieldtrue.places:=", "fieldtrue.software:=Fieldtrue"})
      QVERIFY2(head.contains(fact), fact);
  }

  void nothingIsWrittenOverUnasked() {
    QVERIFY(writeWhole(at("theirs.mha"), "theirs"));
    const CliRun refused = runCli(base("itk_mha", "theirs.mha"));
    FT_VERIFY_STATUS(refused, 1);
    FT_VERIFY_MATCH(holdsAll(refused.err.toStdString(), {"exists already", "--force"}));
    QCOMPARE(content("theirs.mha"), QByteArray("theirs"));
    FT_VERIFY_STATUS(runCli(base("itk_mha", "theirs.mha") + QStringList{"--force"}), 0);
    QVERIFY(content("theirs.mha").startsWith("ObjectType = Image"));
    // Its own source least of all.
    const QByteArray before = content("room.ftcal.json");
    FT_VERIFY_STATUS(runCli(base("ftcal", "room.ftcal.json") + QStringList{"--force"}), 2);
    QCOMPARE(content("room.ftcal.json"), before);
  }

  void whatCannotBeWrittenIsToldInOneLine_data() {
    QTest::addColumn<QStringList>("arguments");
    QTest::addColumn<int>("status");
    QTest::addColumn<QList<QByteArray>>("fragments");
    QTest::newRow("a method that jumps") << base("numpy", "none.out", "jumps.ftcal.json") +
                                                QStringList{"--max-size-mib", "4"}
                                         << 1
                                         << QList<QByteArray>{"A lattice of", "mm is off by up to", "50 um", "4 MiB"};
    QTest::newRow("a fixed form beyond what is allowed")
        << base("cave_table", "none.out") + QStringList{"--max-deviation-um", "1"} << 1
        << QList<QByteArray>{"CAVE table", "off by up to", "1 um"};
    QTest::newRow("another method's coefficients")
        << base("polynomial_c", "none.out") << 1 << QList<QByteArray>{"polynomial only", "rbf"};
    QTest::newRow("no way back") << base("vrui_grid", "none.out") + QStringList{"--direction", "true-to-measured"} << 1
                                 << QList<QByteArray>{"vrui_grid", "measured-to-true only"};
    QTest::newRow("no such way") << base("vtk_vti", "none.out") + QStringList{"--direction", "backwards"} << 2
                                 << QList<QByteArray>{"backwards", "true-to-measured"};
    QTest::newRow("orientation that counts") << base("vtk_vti", "none.out", "coils.ftcal.json") << 1
                                             << QList<QByteArray>{"how the sensor is turned", "--orientation mean"};
    QTest::newRow("no quaternion") << base("vtk_vti", "none.out", "coils.ftcal.json") +
                                          QStringList{"--orientation", "1,2"}
                                   << 2 << QList<QByteArray>{"'1,2'", "qw,qx,qy,qz"};
    QTest::newRow("no such format") << base("punched_cards", "none.out") << 2
                                    << QList<QByteArray>{"punched_cards", "itk_nrrd"};
    QTest::newRow("no such folder") << base("matlab", "nowhere/none.out") << 1
                                    << QList<QByteArray>{"Cannot write", "nowhere"};
  }
  void whatCannotBeWrittenIsToldInOneLine() {
    QFETCH(QStringList, arguments);
    QFETCH(int, status);
    QFETCH(QList<QByteArray>, fragments);
    const CliRun run = runCli(arguments);
    FT_VERIFY_STATUS(run, status);
    QCOMPARE(run.err.trimmed().count('\n'), 0);
    for (const QByteArray& fragment : fragments) QVERIFY2(run.err.contains(fragment), run.err.constData());
    QVERIFY(QDir(folder_.path()).entryList({"none*"}).isEmpty());
  }

  void aCorrectionOfPosesIsWrittenAtAnOrientation() {
    const auto written = [&](const QString& name, const QString& orientation) {
      const CliRun run = runCli(base("lattice_csv", name, "coils.ftcal.json") +
                                QStringList{"--orientation", orientation, "--max-deviation-um", "500"});
      return run.status == 0 ? content(name) : QByteArray();
    };
    const QByteArray mean = written("mean.csv", "mean"), at_one = written("one.csv", "1,0,0,0");
    QVERIFY(mean.contains("at_orientation: mean over the orientations fitted"));
    QVERIFY(at_one.contains("at_orientation: at w x y z = 1 0 0 0"));
    QVERIFY(mean.contains("largest_change_with_orientation_mm: "));
    QVERIFY(mean.split('\n').last() != at_one.split('\n').last() || mean != at_one);
  }
};

FIELDTRUE_TEST(CliExportTest)
#include "cli_export_test.moc"
