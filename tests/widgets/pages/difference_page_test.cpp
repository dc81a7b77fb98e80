#include "widgets/pages/difference_page.h"

#include <QComboBox>
#include <QDir>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QTest>
#include <QThreadPool>
#include <cmath>

#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/widgets/pages/window_driver.h"
#include "widgets/pages/connect_page.h"
#include "widgets/style/theme.h"
#include "widgets/views/field/field_view.h"

/// Whose calibration it is, asked for on Connect; and what changed between two.
using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

namespace {

const Eigen::Vector3d kBump_m(0.6, 0.2, 0.1);

/// A grid with 1 mm of placing error, and metal near one place of it where asked for: 30 mm, falling off over 0.3 m.
CalibrationTable recorded(std::uint64_t seed, double bump_m) {
  SyntheticOptions options;
  options.counts = {6, 6, 5};
  options.smooth_distortion_m = 0.01;
  CalibrationTable table = syntheticTable(options, {.seed = seed, .placing_sd_m = 0.001});
  table.metadata.alignment_known = true;
  table.metadata.setup = {{"room", "Lab 2"}, {"tracker_kind", "fastrak"}};
  for (Node& node : table.nodes) {
    const double off_m = (node.reference_from_sensor.position_m - kBump_m).norm();
    node.tracker_from_sensor.position_m.z() += bump_m * std::exp(-off_m * off_m / (0.3 * 0.3));
  }
  return table;
}

/// Sensors 0 and 3 at the same places; only the second meets the metal.
CalibrationTable ofTwoSensors(std::uint64_t seed, double bump_m) {
  CalibrationTable table = recorded(seed, 0.0);
  for (Node node : recorded(seed + 1, bump_m).nodes) {
    node.sensor = 3;
    table.nodes.push_back(node);
  }
  return table;
}

}  // namespace

class DifferencePageTest : public WindowDriver {
  Q_OBJECT

 private slots:
  void initTestCase() {
    write("before.ftcal.json", recorded(1, 0.0), "2026-03-02");
    write("after.ftcal.json", recorded(2, 0.03), "2026-09-14");
    showWindow();
  }

  void cleanupTestCase() { closeWindow(); }

  void connectAsksWhatNoTrackerTells() {
    click("step_connect");
    auto* kind = find<QComboBox>("deviceKind");
    kind->setCurrentIndex(0);
    QVERIFY(!find<QLineEdit>("setup.room")->isVisible());
    kind->setCurrentIndex(1);
    auto* room = find<QLineEdit>("setup.room");
    QVERIFY(room->isVisible());
    room->setFocus();
    QTest::keyClicks(room, QStringLiteral("Lab 9"));
    QTest::keyClick(room, Qt::Key_Return);
    picture("2-connect-setup");
    // The next window asks again with what is known.
    Workbench workbench;
    ConnectPage page(workbench);
    QCOMPARE(testing::find<QLineEdit>(page, "setup.room")->text(), QStringLiteral("Lab 9"));
  }

  void aSessionKeepsIt() {
    Workbench workbench;
    workbench.setSetup({{"room", "Lab 9"}});
    workbench.createSession(folder_.filePath("s.fieldtrue"), acquisition::Plan());
    QTRY_VERIFY_WITH_TIMEOUT(workbench.sessionIsOpen(), kWaitMs);
    QTRY_COMPARE_WITH_TIMEOUT(workbench.recordedTable().metadata.setup.count("room"), std::size_t{1}, kWaitMs);
    QCOMPARE(workbench.recordedTable().metadata.setup.at("room"), std::string("Lab 9"));
    // A slip of the hand is mended in the session too.
    workbench.setSetup({{"room", "Lab 8"}});
    QTRY_COMPARE_WITH_TIMEOUT(workbench.recordedTable().metadata.setup.at("room"), std::string("Lab 8"), kWaitMs);
  }

  void tellsWhatChangedAndWhere() {
    click("step_difference");
    QVERIFY(!find<QPushButton>("differenceRun")->isEnabled());
    compare("before.ftcal.json", "after.ftcal.json");
    QTRY_COMPARE_WITH_TIMEOUT(find<QLabel>("differenceHeadline")->text(), QStringLiteral("The field changed"), kWaitMs);
    FT_VERIFY_MATCH(
        holdsAll(find<QLabel>("differenceSentence")->text().toStdString(), {"between 2026-03-02 and 2026-09-14"}));
    const ErrorField& field = find<FieldView>("differenceField")->field();
    QVERIFY(field.arrows.size() > 100 && field.arrows.size() <= 301);
    const auto largest = std::max_element(field.arrows.begin(), field.arrows.end(), [](const auto& a, const auto& b) {
      return a.error_m.norm() < b.error_m.norm();
    });
    QVERIFY((largest->from_m - kBump_m).norm() < 0.2);
    picture("7-changes");
  }

  void sameFieldShowsNoChange() {
    compare("before.ftcal.json", "before.ftcal.json");
    QTRY_COMPARE_WITH_TIMEOUT(find<QLabel>("differenceHeadline")->text(), QStringLiteral("No change is shown"),
                              kWaitMs);
  }

  void anotherFileLeavesNothingOfTheOld() {
    auto* second = find<QLineEdit>("differenceSecond");
    compare("before.ftcal.json", "after.ftcal.json");
    QTRY_COMPARE_WITH_TIMEOUT(find<QLabel>("differenceHeadline")->text(), QStringLiteral("The field changed"), kWaitMs);
    second->setText(folder_.filePath("before.ftcal.json"));
    QCOMPARE(find<QLabel>("differenceHeadline")->text(), QStringLiteral("What changed?"));
    QVERIFY(find<FieldView>("differenceField")->field().arrows.empty());
    // Nor does what was asked of the old answer beside the new.
    compare("before.ftcal.json", "after.ftcal.json");
    second->setText(folder_.filePath("before.ftcal.json"));
    QCOMPARE(find<QPushButton>("differenceRun")->text(), QStringLiteral("Tell what changed"));
    QThreadPool::globalInstance()->waitForDone();
    QCoreApplication::processEvents();
    QCOMPARE(find<QLabel>("differenceHeadline")->text(), QStringLiteral("What changed?"));
  }

  void whereEachSensorHasACorrectionOneIsChosen() {
    write("both_before.ftcal.json", ofTwoSensors(3, 0.0), "2026-03-02", true);
    write("both_after.ftcal.json", ofTwoSensors(5, 0.03), "2026-09-14", true);
    auto* sensor = find<QComboBox>("differenceSensor");
    QVERIFY(!sensor->isVisible());
    compare("both_before.ftcal.json", "both_after.ftcal.json");
    QTRY_COMPARE_WITH_TIMEOUT(find<QLabel>("differenceHeadline")->text(), QStringLiteral("No change is shown"),
                              kWaitMs);
    QTRY_VERIFY_WITH_TIMEOUT(sensor->isVisible(), kWaitMs);
    QCOMPARE(sensor->currentText(), QStringLiteral("Sensor 0"));
    sensor->setFocus();
    QTest::keyClick(sensor, Qt::Key_Down);
    QTRY_COMPARE_WITH_TIMEOUT(find<QLabel>("differenceHeadline")->text(), QStringLiteral("The field changed"), kWaitMs);
    QCOMPARE(sensor->currentText(), QStringLiteral("Sensor 3"));
    picture("7-changes-of-a-sensor");
  }

  void aFileOfOneSensorChoosesIt() {
    CalibrationTable three = ofTwoSensors(6, 0.0);
    std::erase_if(three.nodes, [](const Node& node) { return node.sensor != 3; });
    write("three.ftcal.json", three, "2026-09-14");
    compare("both_before.ftcal.json", "three.ftcal.json");
    auto* sensor = find<QComboBox>("differenceSensor");
    QTRY_COMPARE_WITH_TIMEOUT(sensor->count(), 1, kWaitMs);
    QCOMPARE(sensor->currentText(), QStringLiteral("Sensor 3"));
    compare("before.ftcal.json", "after.ftcal.json");
    QTRY_VERIFY_WITH_TIMEOUT(!sensor->isVisible(), kWaitMs);
  }

  void whatIsNoCalibrationIsSaid() {
    QFile file(folder_.filePath("wrong.ftcal.json"));
    QVERIFY(file.open(QIODevice::WriteOnly) && file.write("{}") == 2);
    file.close();
    compare("before.ftcal.json", "wrong.ftcal.json");
    const auto is_told = [&] {
      for (const QLabel* label : window_->findChildren<QLabel*>())
        if (label->isVisible() && label->text().contains(QStringLiteral("wrong.ftcal.json"))) return true;
      return false;
    };
    QTRY_VERIFY_WITH_TIMEOUT(is_told(), kWaitMs);
    QCOMPARE(find<QLabel>("differenceHeadline")->text(), QStringLiteral("What changed?"));
  }

 private:
  void write(const char* name, CalibrationTable table, const std::string& date, bool is_separate = false) {
    table.metadata.date = date;
    calibration::CorrectorChoice choice = calibration::parseCorrectorChoice("rbf", "none").value();
    choice.separate_position = is_separate;
    const auto corrector =
        calibration::Corrector::fit(table.nodes, table.metadata, choice, calibration::AlignMode::kNone);
    FT_VERIFY_OK(corrector);
    FT_VERIFY_OK(corrector->save(folder_.filePath(name).toStdString()));
  }

  void compare(const char* first, const char* second) {
    find<QLineEdit>("differenceFirst")->setText(folder_.filePath(first));
    find<QLineEdit>("differenceSecond")->setText(folder_.filePath(second));
    click("differenceRun");
  }
};

FIELDTRUE_WINDOW_TEST(DifferencePageTest)
#include "difference_page_test.moc"
