#include "widgets/pages/connect_page.h"

#include <QComboBox>
#include <QDoubleSpinBox>
#include <QLineEdit>
#include <QTest>

#include "calib/tables/table_writer.h"
#include "tests/support/matchers.h"
#include "tests/widgets/pages/window_driver.h"

/// What is chosen on the page is what is connected: a setting belongs to the tracker, not to the name of its line.
using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

class ConnectPageTest : public WindowDriver {
  Q_OBJECT

 private slots:
  void initTestCase() {
    SampleTable samples;
    for (int i = 0; i < 200; ++i)
      samples.rows.push_back({0, 0, {0.1 * i, 0, {{0.5, 0.1, 0.2}, Eigen::Quaterniond::Identity()}, {}}});
    FT_VERIFY_OK(writeSampleTable(std::filesystem::path(folder_.filePath("room.samples.csv").toStdString()), samples));
    showWindow();
    click("step_connect");
  }

  void cleanupTestCase() { closeWindow(); }

  void settingsFollowTheAddress() {
    auto* kind = find<QComboBox>("deviceKind");
    const int index = kind->findData(QStringLiteral("trace"));
    QVERIFY(index > 0);
    kind->setCurrentIndex(index);
    find<QComboBox>("deviceAddress")->setCurrentText(folder_.filePath("room.samples.csv"));
    find<QDoubleSpinBox>("setting_rate")->setValue(4.0);
    click("connectButton");
    const auto told = [&] { return window_->workbench().status().device_text; };
    QTRY_VERIFY2_WITH_TIMEOUT(told().startsWith("Playing " + folder_.filePath("room.samples.csv")), qPrintable(told()),
                              kWaitMs);
    picture("2-connect-trace");
  }

  void theSimulatedTrackerTakesNothingBackThatWasStated() {
    Workbench& workbench = window_->workbench();
    workbench.disconnectDevice();
    QTRY_VERIFY_WITH_TIMEOUT(find<QComboBox>("deviceKind")->isEnabled(), kWaitMs);
    workbench.createSession(folder_.filePath("stated.fieldtrue"), acquisition::Plan());
    QTRY_VERIFY_WITH_TIMEOUT(workbench.sessionIsOpen(), kWaitMs);
    click("step_connect");
    auto* kind = find<QComboBox>("deviceKind");
    kind->setCurrentIndex(kind->findData(QStringLiteral("fastrak")));
    auto* serial = find<QLineEdit>("setup.sensor_serial");
    serial->setFocus();
    QTest::keyClicks(serial, QStringLiteral("S7"));
    QTest::keyClick(serial, Qt::Key_Return);
    const auto stated = [&](const char* key) {
      return QString::fromStdString(factOf(workbench.recordedTable().metadata.setup, key).value_or("nothing"));
    };
    QTRY_COMPARE_WITH_TIMEOUT(stated("sensor_serial"), QStringLiteral("S7"), kWaitMs);
    kind->setCurrentIndex(0);
    click("connectButton");
    QTRY_COMPARE_WITH_TIMEOUT(stated("tracker_kind"), QStringLiteral("simulated"), kWaitMs);
    QCOMPARE(stated("sensor_serial"), QStringLiteral("S7"));
  }
};

FIELDTRUE_WINDOW_TEST(ConnectPageTest)
#include "connect_page_test.moc"
