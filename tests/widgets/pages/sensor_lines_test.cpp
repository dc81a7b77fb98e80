#include <QCheckBox>
#include <QLabel>
#include <QTableView>
#include <QTest>

#include "calib/tables/table_writer.h"
#include "tests/support/matchers.h"
#include "tests/widgets/pages/window_driver.h"

/// Several sensors on the page where places are taken, in the real window: one that says nothing for a while in the
/// middle of a take, and as many as any tracker has.
using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

namespace {

constexpr int kReadings = 400;
constexpr int kPlayedRate_hz = 60;
constexpr double kSilentFrom_s = 4.0, kSilentUntil_s = 9.0;

/// Sensors that lie still; the second is silent for a while.
SampleTable lying(int sensors) {
  SampleTable table;
  for (int n = 0; n < 60 * kPlayedRate_hz; ++n) {
    const double t_s = n / static_cast<double>(kPlayedRate_hz);
    const double tremble_m = n % 2 == 0 ? 1e-4 : -1e-4;
    for (int sensor = 0; sensor < sensors; ++sensor) {
      if (sensor == 1 && t_s >= kSilentFrom_s && t_s < kSilentUntil_s) continue;
      const Pose pose{{0.4, 0.04 * sensor, 0.1 + tremble_m}, Eigen::Quaterniond::Identity()};
      table.rows.push_back({-1, 0, {t_s, sensor, pose, {}}});
    }
  }
  return table;
}

}  // namespace

class SensorLinesTest : public WindowDriver {
  Q_OBJECT

 private slots:
  void initTestCase() { showWindow(); }
  void cleanupTestCase() { closeWindow(); }

  void isNamedInLargeLettersUntilItIsBack() {
    begin(2);
    if (QTest::currentTestFailed()) return;
    Workbench& workbench = window_->workbench();
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

  void sixteenLeaveRoomForTheList() {
    begin(16);
    if (QTest::currentTestFailed()) return;
    const auto* lines = find<QLabel>("sensorLines");
    window_->workbench().take();
    QTRY_VERIFY(lines->text().contains(QStringLiteral("/%1").arg(kReadings)));
    for (int sensor = 0; sensor < 16; ++sensor)
      QVERIFY(lines->text().contains(QStringLiteral("Sensor %1").arg(sensor)));
    picture("several-sixteen");
    QVERIFY2(lines->sizeHint().width() <= lines->width(), "nothing of a line is cut off");
    click("step_connect");
    QTRY_VERIFY(find<QCheckBox>("recordSensor15")->isVisible());
    QCOMPARE(window_->size(), QSize(1280, 800));
    picture("several-sixteen-connect");
    click("step_acquire");
    const auto* list = find<QTableView>("placeList");
    QVERIFY(list->viewport()->height() >= 2 * list->rowHeight(0));
  }

 private:
  /// A tracker that plays so many sensors, a session of two places, and the page where they are taken.
  void begin(int sensors) {
    const QString recording = folder_.filePath(QStringLiteral("lying-%1.samples.csv").arg(sensors));
    FT_VERIFY_OK(writeSampleTable(std::filesystem::path(recording.toStdString()), lying(sensors)));
    Workbench& workbench = window_->workbench();
    acquisition::Plan plan;
    plan.counts = {2, 1, 1};
    workbench.createSession(folder_.filePath(QStringLiteral("lying-%1.fieldtrue").arg(sensors)), plan,
                            {acquisition::TakeLength::Until::kSamples, kReadings});
    workbench.connectDevice("trace:" + recording, {});
    QTRY_COMPARE(workbench.status().sensors.size(), static_cast<std::size_t>(sensors));
    click("step_acquire");
  }
};

FIELDTRUE_WINDOW_TEST(SensorLinesTest)
#include "sensor_lines_test.moc"
