#include <QComboBox>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QPushButton>
#include <QTest>

#include "acquisition/session/imported_session.h"
#include "acquisition/session/session_store.h"
#include "calib/evaluation/sensor_splits.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/widgets/pages/window_driver.h"
#include "widgets/pages/export_page.h"

/// A session of two sensors that err differently: what is fitted in the window holds a correction for each, and a
/// format that holds one is written for the sensor that is chosen.
using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

class ExportSensorsTest : public WindowDriver {
  Q_OBJECT

 private slots:
  void initTestCase() {
    showWindow();
    const QString path = folder_.filePath("bar.fieldtrue");
    QVERIFY(acquisition::makeSession(path, table(), {}, "bar.csv").has_value());
    window_->workbench().openSession(path);
    QTRY_COMPARE_WITH_TIMEOUT(window_->workbench().recordedTable().nodes.size(), table().nodes.size(), kWaitMs);
  }

  void cleanupTestCase() { closeWindow(); }

  void aFitInTheWindowIsThatOfTheCommandLine() {
    const auto choice = calibration::parseCorrectorChoice("polynomial:degree=2", "none").value();
    Workbench& workbench = window_->workbench();
    workbench.fit(choice, calibration::AlignMode::kRigid);
    QTRY_VERIFY_WITH_TIMEOUT(workbench.corrector().has_value(), kWaitMs);
    QCOMPARE(workbench.corrector()->sensorsApart(), (std::vector<int>{0, 1}));
    const auto same = evaluation::fitByEvidence(workbench.table(), choice, calibration::AlignMode::kRigid, {});
    FT_VERIFY_OK(same);
    QCOMPARE(workbench.corrector()->toText(), same->toText());
  }

  void formatsThatHoldOneAskForTheSensor() {
    click("step_export");
    choose("(.npz)");
    auto* sensor = find<QComboBox>("exportSensor");
    QVERIFY(sensor->isVisible());
    QCOMPARE(sensor->count(), 2);
    picture("6-export-sensors");
    sensor->setCurrentIndex(1);
    auto* path = find<QLineEdit>("exportPath");
    QVERIFY2(path->text().endsWith("bar_measured-to-true_sensor-1.npz"), qPrintable(path->text()));
    click("exportWrite");
    QTRY_VERIFY_WITH_TIMEOUT(QFile::exists(path->text()), kWaitMs);
    QTRY_VERIFY_WITH_TIMEOUT(find<QPushButton>("exportWrite")->isEnabled(), kWaitMs);
  }

  void aCalibrationHoldsBoth() {
    choose(".ftcal.json");
    QVERIFY(!find<QComboBox>("exportSensor")->isVisible());
    const QString path = find<QLineEdit>("exportPath")->text();
    click("exportWrite");
    QTRY_VERIFY_WITH_TIMEOUT(QFile::exists(path), kWaitMs);
    const auto written = calibration::Corrector::load(path.toStdString());
    FT_VERIFY_OK(written);
    QCOMPARE(written->sensorsApart().size(), std::size_t{2});
  }

  void aFitIsHeldAgainstThePlacesOfItsSensors_data() {
    QTest::addColumn<int>("fitted");
    QTest::newRow("fitted to one") << 1;
    QTest::newRow("fitted to both") << -1;
  }
  /// Whichever sensor is shown later, the places have not changed; once they have, that is said whichever is shown.
  void aFitIsHeldAgainstThePlacesOfItsSensors() {
    QFETCH(int, fitted);
    click("step_export");
    Workbench& workbench = window_->workbench();
    const auto show = [&](int sensor) {
      workbench.chooseSensor(sensor < 0 ? std::nullopt : std::optional(sensor));
      return find<QLabel>("calibrationSummary")->text().contains(QStringLiteral("before the session's places changed"));
    };
    show(fitted);
    workbench.fit(calibration::parseCorrectorChoice("polynomial:degree=1", "none").value(),
                  calibration::AlignMode::kRigid);
    QVERIFY(workbench.isFitting());
    QTRY_VERIFY_WITH_TIMEOUT(!workbench.isFitting(), kWaitMs);
    QCOMPARE(workbench.corrector()->table().nodes.size(), table().nodes.size() / (fitted < 0 ? 1 : 2));
    for (const int shown : {-1, 0, 1}) QVERIFY2(!show(shown), qPrintable(QString::number(shown)));

    workbench.undo();
    QTRY_COMPARE_WITH_TIMEOUT(workbench.recordedTable().nodes.size(), table().nodes.size() - 2, kWaitMs);
    for (const int shown : {-1, 0, 1}) QVERIFY2(show(shown), qPrintable(QString::number(shown)));
    workbench.redo();
    QTRY_COMPARE_WITH_TIMEOUT(workbench.recordedTable().nodes.size(), table().nodes.size(), kWaitMs);
    for (const int shown : {0, 1, -1}) QVERIFY2(!show(shown), qPrintable(QString::number(shown)));
  }

 private:
  static CalibrationTable table() {
    SyntheticOptions options;
    options.counts = {5, 4, 3};
    options.smooth_distortion_m = 0.01;
    CalibrationTable table = syntheticTable(options, {.seed = 3});
    std::vector<Node> second = table.nodes;
    for (Node& node : second) {
      node.sensor = 1;
      node.tracker_from_sensor.position_m *= 1.02;
    }
    table.nodes.insert(table.nodes.end(), second.begin(), second.end());
    return table;
  }

  void choose(const char* words) {
    auto* list = find<QListWidget>("exportList");
    for (int row = 0; row < list->count(); ++row)
      if (list->item(row)->text().contains(QLatin1String(words))) return list->setCurrentRow(row);
    QFAIL(words);
  }
};

FIELDTRUE_WINDOW_TEST(ExportSensorsTest)
#include "export_sensors_test.moc"
