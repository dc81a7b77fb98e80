#include <QDir>
#include <QFileInfo>
#include <QTemporaryDir>
#include <QTest>
#include <QThreadPool>
#include <algorithm>

#include "tests/app/cli_program.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"
#include "tests/widgets/session_fixture.h"
#include "widgets/pages/export_targets.h"
#include "widgets/workbench/workbench.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;
using namespace fieldtrue::widgets;

/// Window and command line make the same calibration of the same session.
class SameCalibrationTest : public QObject {
  Q_OBJECT

  QTemporaryDir folder_;
  QString at(const char* name) const { return folder_.filePath(QLatin1String(name)); }

 private slots:
  void initTestCase() {
    keepIn(folder_);
    FT_VERIFY_STATUS(runCli({"acquire", "--device", "simulated:speed=50,travel_s=0.5", "--plan",
                             "grid:4x3x3@0.2:orientations=2", "--auto", "--samples-per-node", "12", "--session",
                             at("s.fieldtrue"), "--setup", "transmitter_serial=TX 17"}),
                     0);
    FT_VERIFY_STATUS(runCli({"tables", "--session", at("s.fieldtrue"), "--nodes", at("n.csv")}), 0);
  }
  void cleanupTestCase() { QThreadPool::globalInstance()->waitForDone(); }

  void bytesAreTheSame_data() {
    QTest::addColumn<QString>("position");
    QTest::addColumn<QString>("orientation");
    QTest::newRow("polynomial") << "polynomial:degree=2"
                                << "none";
    QTest::newRow("splines") << "bspline"
                             << "polynomial_quaternion:degree=2";
    QTest::newRow("kriging") << "gaussian_process"
                             << "none";
    QTest::newRow("network") << "neural_network"
                             << "none";
  }
  void bytesAreTheSame() {
    QFETCH(QString, position);
    QFETCH(QString, orientation);
    FT_VERIFY_STATUS(runCli({"fit", "--nodes", at("n.csv"), "--position", position, "--orientation", orientation,
                             "--out", at("command.ftcal.json")}),
                     0);
    Workbench workbench;
    workbench.openSession(at("s.fieldtrue"));
    QTRY_COMPARE_WITH_TIMEOUT(workbench.recordedTable().nodes.size(), std::size_t{72}, 60000);
    const auto choice = calibration::parseCorrectorChoice(position.toStdString(), orientation.toStdString());
    FT_VERIFY_OK(choice);
    workbench.fit(*choice, calibration::defaultAlignMode(workbench.table().metadata));
    QTRY_VERIFY_WITH_TIMEOUT(workbench.correctorCorrects() && !workbench.isFitting(), 120000);
    FT_VERIFY_OK(workbench.corrector()->save(at("window.ftcal.json").toStdString()));
    QCOMPARE(readWhole(at("window.ftcal.json")), readWhole(at("command.ftcal.json")));
    QVERIFY(readWhole(at("window.ftcal.json")).contains("TX 17"));
  }

  /// Of one calibration, for other programs: every file, and every file of a folder.
  void filesForOtherProgramsAreTheSame() {
    FT_VERIFY_STATUS(runCli({"fit", "--nodes", at("n.csv"), "--position", "polynomial:degree=2", "--orientation",
                             "polynomial_quaternion:degree=2", "--out", at("s.ftcal.json")}),
                     0);
    Workbench workbench;
    workbench.openSession(at("s.fieldtrue"));
    QTRY_COMPARE_WITH_TIMEOUT(workbench.recordedTable().nodes.size(), std::size_t{72}, 60000);
    workbench.fit(calibration::parseCorrectorChoice("polynomial:degree=2", "polynomial_quaternion:degree=2").value(),
                  calibration::defaultAlignMode(workbench.table().metadata));
    QTRY_VERIFY_WITH_TIMEOUT(workbench.correctorCorrects() && !workbench.isFitting(), 120000);
    ExportChoices as_offered;
    as_offered.deviation_m = 0.05 / 1000.0;
    int n_formats = 0;
    for (const ExportTarget& target : exportTargets(workbench)) {
      if (target.exporter == nullptr) continue;
      const QString from_window = at("window_file") + target.extension;
      const QString from_command = at("command_file") + target.extension;
      const auto in_window = target.prepare(as_offered)(from_window.toStdString(), {});
      const CliRun on_command =
          runCli({"export", "--calibration", at("s.ftcal.json"), "--format", target.id, "--out", from_command});
      QCOMPARE(on_command.status == 0, in_window.has_value());
      if (!in_window) continue;
      ++n_formats;
      QVERIFY2(sameContent(from_window, from_command), qPrintable(target.id));
      for (const QString& path : {from_window, from_command})
        QVERIFY(QFileInfo(path).isDir() ? QDir(path).removeRecursively() : QFile::remove(path));
    }
    QVERIFY(n_formats > 20);
  }

 private:
  static bool sameContent(const QString& a, const QString& b) {
    if (!QFileInfo(a).isDir()) return !readWhole(a).isEmpty() && readWhole(a) == readWhole(b);
    const QStringList names = QDir(a).entryList(QDir::Files);
    return !names.isEmpty() && names == QDir(b).entryList(QDir::Files) &&
           std::all_of(names.begin(), names.end(), [&](const QString& name) {
             return readWhole(QDir(a).filePath(name)) == readWhole(QDir(b).filePath(name));
           });
  }
};

FIELDTRUE_TEST(SameCalibrationTest)
#include "same_calibration_test.moc"
