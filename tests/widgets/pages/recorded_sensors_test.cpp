#include <QCheckBox>
#include <QComboBox>
#include <QLabel>
#include <QTest>
#include <set>

#include "calib/tables/table_writer.h"
#include "tests/support/matchers.h"
#include "tests/widgets/pages/window_driver.h"

/// Which sensors are recorded and which one leads, chosen on the page Connect in the real window.
using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

namespace {

constexpr int kJigRate_hz = 60;
constexpr int kOnJig = 3;
constexpr int kDying = 1;

/// Sensors that lie still; one dies.
SampleTable dying(double dies_s) {
  SampleTable table;
  for (int n = 0; n < 120 * kJigRate_hz; ++n) {
    const double t_s = n / static_cast<double>(kJigRate_hz);
    const double tremble_m = n % 2 == 0 ? 1e-4 : -1e-4;
    for (int sensor = 0; sensor < kOnJig; ++sensor) {
      if (sensor == kDying && t_s >= dies_s) continue;
      const Pose pose{{0.4, 0.04 * sensor, 0.1 + tremble_m}, Eigen::Quaterniond::Identity()};
      table.rows.push_back({-1, 0, {t_s, sensor, pose, {}}});
    }
  }
  return table;
}

}  // namespace

class RecordedSensorsTest : public WindowDriver {
  Q_OBJECT

 private slots:
  void initTestCase() { showWindow(); }
  void cleanupTestCase() { closeWindow(); }

  void theLeaderIsChosen() {
    begin("leader", 120.0);
    if (QTest::currentTestFailed()) return;
    auto* leader = find<QComboBox>("leadingSensor");
    QTRY_VERIFY(leader->isVisible() && leader->isEnabled());
    QCOMPARE(leader->currentText(), QString("Sensor 0"));
    leader->setFocus();
    QTest::keyClick(leader, Qt::Key_End);
    QTRY_COMPARE(recorded(), (std::vector<int>{2, 0, 1}));
    QTRY_VERIFY(find<QLabel>("recordedSensorsHint")->text().contains("Sensor 2 leads"));
    QCOMPARE(leader->currentText(), QString("Sensor 2"));
    picture("leader-connect");
    // It goes on leading when others are left out and taken in again.
    click("recordSensor0");
    QTRY_COMPARE(recorded(), (std::vector<int>{2, 1}));
    click("recordSensor0");
    QTRY_COMPARE(recorded(), (std::vector<int>{2, 0, 1}));

    Workbench& workbench = window_->workbench();
    QTRY_VERIFY(workbench.status().live && workbench.status().live->sensor == 2);
    workbench.take();
    QTRY_COMPARE_WITH_TIMEOUT(workbench.status().recorded->n_done, std::size_t{1}, 20000);
    QTRY_COMPARE(workbench.table().nodes.size(), std::size_t{3});
    QCOMPARE(workbench.status().of_session, (std::vector<int>{2, 0, 1}));
    QTRY_VERIFY2(!leader->isEnabled(), "the takes of a session were led by it");
  }

  void oneThatIsDeadIsUnticked() {
    begin("dying", 20.0);
    if (QTest::currentTestFailed()) return;
    Workbench& workbench = window_->workbench();
    workbench.take();
    QTRY_COMPARE_WITH_TIMEOUT(workbench.status().recorded->n_done, std::size_t{1}, 20000);
    auto* box = find<QCheckBox>("recordSensor1");
    QTRY_VERIFY2(!box->isEnabled(), "while it reports it is one of the session's");
    QTRY_COMPARE_WITH_TIMEOUT(box->text(), QString("Sensor 1, silent"), 30000);
    QTRY_VERIFY(box->isEnabled() && box->isChecked());
    QVERIFY(box->property("silent").toBool() && !find<QCheckBox>("recordSensor0")->property("silent").toBool());
    picture("dead-connect");
    click("recordSensor1");
    QTRY_COMPARE(recorded(), (std::vector<int>{0, 2}));
    QTRY_VERIFY2(!box->isChecked() && box->isEnabled(), "it may be taken in again");
    QVERIFY2(window_->workbench().status().of_session.size() == 3, "its rows stay");

    workbench.take();
    QTRY_COMPARE_WITH_TIMEOUT(workbench.status().recorded->n_done, std::size_t{2}, 20000);
    QTRY_COMPARE(workbench.table().nodes.size(), std::size_t{5});
    std::set<std::pair<int, int>> rows;
    for (const Node& node : workbench.table().nodes) rows.insert({node.node, node.sensor});
    const int second = workbench.status().session->places.at(1).node;
    QVERIFY(rows.contains({second, 0}) && rows.contains({second, 2}) && !rows.contains({second, kDying}));
  }

 private:
  std::vector<int> recorded() {
    std::vector<int> sensors;
    for (const acquisition::SensorProgress& one : window_->workbench().status().sensors) sensors.push_back(one.sensor);
    return sensors;
  }
  /// A tracker that plays three sensors of which one dies, a session of two places, and the page Connect.
  void begin(const QString& name, double dies_s) {
    const QString recording = folder_.filePath(name + ".samples.csv");
    FT_VERIFY_OK(writeSampleTable(std::filesystem::path(recording.toStdString()), dying(dies_s)));
    Workbench& workbench = window_->workbench();
    acquisition::Plan plan;
    plan.counts = {2, 1, 1};
    workbench.createSession(folder_.filePath(name + ".fieldtrue"), plan);
    workbench.connectDevice("trace:" + recording + ",rate=2", {});
    // Once it is heard, all are recorded as they are by themselves, whatever the session before had.
    QTRY_COMPARE_WITH_TIMEOUT(recorded(), (std::vector<int>{0, 1, 2}), 30000);
    click("step_connect");
  }
};

FIELDTRUE_WINDOW_TEST(RecordedSensorsTest)
#include "recorded_sensors_test.moc"
