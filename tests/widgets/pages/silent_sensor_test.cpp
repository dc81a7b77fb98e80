#include <QCheckBox>
#include <QLabel>
#include <QTest>

#include "calib/tables/table_writer.h"
#include "tests/support/matchers.h"
#include "tests/widgets/pages/window_driver.h"

/// A tracker whose second sensor says nothing for a while, in the middle of a take, in the real window.
using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

namespace {

constexpr int kReadings = 400;
constexpr int kPlayedRate_hz = 60;
constexpr double kSilentFrom_s = 4.0, kSilentUntil_s = 9.0;

/// Two sensors that lie still.
SampleTable lying() {
  SampleTable table;
  for (int n = 0; n < 60 * kPlayedRate_hz; ++n) {
    const double t_s = n / static_cast<double>(kPlayedRate_hz);
    const double tremble_m = n % 2 == 0 ? 1e-4 : -1e-4;
    for (int sensor = 0; sensor < 2; ++sensor) {
      if (sensor == 1 && t_s >= kSilentFrom_s && t_s < kSilentUntil_s) continue;
      const Pose pose{{0.4, 0.04 * sensor, 0.1 + tremble_m}, Eigen::Quaterniond::Identity()};
      table.rows.push_back({-1, 0, {t_s, sensor, pose, {}}});
    }
  }
  return table;
}

}  // namespace

class SilentSensorTest : public WindowDriver {
  Q_OBJECT

 private slots:
  void initTestCase() { showWindow(); }
  void cleanupTestCase() { closeWindow(); }

  void isNamedInLargeLettersUntilItIsBack() {
    const QString recording = folder_.filePath("lying.samples.csv");
    FT_VERIFY_OK(writeSampleTable(std::filesystem::path(recording.toStdString()), lying()));
    Workbench& workbench = window_->workbench();
    acquisition::Plan plan;
    plan.counts = {2, 1, 1};
    workbench.createSession(folder_.filePath("silent.fieldtrue"), plan,
                            {acquisition::TakeLength::Until::kSamples, kReadings});
    workbench.connectDevice("trace:" + recording, {});
    QTRY_COMPARE(workbench.status().sensors.size(), std::size_t{2});
    click("step_acquire");
    const auto* lines = find<QLabel>("sensorLines");
    QTRY_VERIFY(lines->isVisible() && lines->text().contains("ready"));
    workbench.take();
    QTRY_VERIFY(lines->text().contains(QStringLiteral("of %1").arg(kReadings)));
    picture("several-collecting");

    const auto* reason = find<QLabel>("bannerReason");
    QTRY_COMPARE_WITH_TIMEOUT(reason->text(), QString("sensor 1 does not report: plug it in again"), 20000);
    QVERIFY(find<QWidget>("banner")->property("state") == "attention");
    QVERIFY2(lines->text().contains("silent"), qPrintable(lines->text()));
    QCOMPARE(lines->text().count("silent"), 1);
    picture("several-silent");
    click("step_connect");
    QTRY_COMPARE(find<QCheckBox>("recordSensor1")->text(), QString("Sensor 1, silent"));
    QCOMPARE(find<QCheckBox>("recordSensor0")->text(), QString("Sensor 0"));
    picture("several-connect");
    click("step_acquire");

    QTRY_VERIFY_WITH_TIMEOUT(!lines->text().contains("silent"), 20000);
    QTRY_COMPARE_WITH_TIMEOUT(workbench.status().recorded->n_done, std::size_t{1}, 20000);
    QTRY_COMPARE(workbench.table().nodes.size(), std::size_t{2});
    for (const Node& node : workbench.table().nodes) QCOMPARE(node.n_used, kReadings);
    // From now on its own sensors go on, and the boxes say so.
    QTRY_VERIFY(!find<QCheckBox>("recordSensor1")->isEnabled());
    QVERIFY(find<QLabel>("recordedSensorsHint")->text().contains("were taken by these"));
  }
};

FIELDTRUE_WINDOW_TEST(SilentSensorTest)
#include "silent_sensor_test.moc"
