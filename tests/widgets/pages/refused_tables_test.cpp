// A session whose positions are in two units, and one with two sensors, in the real window: nothing is fitted, scored
// or diagnosed before the person has said what to do.

#include <QApplication>
#include <QComboBox>
#include <QDir>
#include <QDragEnterEvent>
#include <QFileInfo>
#include <QLabel>
#include <QMimeData>
#include <QPushButton>
#include <QTemporaryDir>
#include <QTest>
#include <QThreadPool>
#include <QUrl>

#include "acquisition/session/session_store.h"
#include "calib/calibration/alignment.h"
#include "tests/support/matchers.h"
#include "tests/widgets/pages/window_driver.h"
#include "tests/widgets/session_fixture.h"
#include "widgets/pages/gap_page.h"
#include "widgets/shell/main_window.h"
#include "widgets/shell/message_line.h"
#include "widgets/style/theme.h"
#include "widgets/views/field/field_view.h"

using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

namespace {

struct Recorded {
  double plan_per_reading = 1.0;  ///< 1000: the plan was made in millimetres.
  bool has_two_sensors = false;   ///< The second half of the places with another sensor than the first.
};

/// A recorded session of 18 places without any error.
void record(const QString& path, const Recorded& recorded) {
  acquisition::Plan plan;
  plan.counts = {3, 3, 2};
  plan.pitch_m = Eigen::Vector3d::Constant(0.2 * recorded.plan_per_reading);
  auto store = acquisition::SessionStore::create(path, plan, TableMetadata{});
  FT_VERIFY_OK(store);
  const std::vector<PlannedPlace>& places = store->places();
  for (std::size_t place = 0; place < places.size(); ++place) {
    std::vector<Sample> samples(20);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      samples[i].time_s = static_cast<double>(place) + 0.01 * static_cast<double>(i);
      samples[i].sensor = recorded.has_two_sensors && 2 * place >= places.size() ? 1 : 0;
      Pose& pose = samples[i].tracker_from_sensor;
      pose.position_m = places[place].reference_from_sensor.position_m / recorded.plan_per_reading +
                        Eigen::Vector3d(0.5, 0.1, 1e-5 * static_cast<double>(i % 3));
      if (samples[i].sensor == 1) pose.orientation = rotationFromVector(Eigen::Vector3d(0.0, 0.0, 1.57));
    }
    FT_VERIFY_OK(store->storeTake(place, {{samples, averageSamples(samples).value()}}, {}));
  }
}

}  // namespace

class RefusedTablesTest : public testing::WindowDriver {
  Q_OBJECT

 private slots:
  void initTestCase() {
    QVERIFY(folder_.isValid());
    keepIn(folder_);
    applyTheme(*qApp, false);
    record(folder_.filePath("mm.fieldtrue"), {1000.0, false});
    record(folder_.filePath("two.fieldtrue"), {1.0, true});
    record(folder_.filePath("good.fieldtrue"), {});
  }
  void aDroppedSessionOpensAndAnythingElseIsImported() {
    const auto drop = [&](const QString& path) {
      QMimeData data;
      data.setUrls({QUrl::fromLocalFile(path)});
      QDragEnterEvent enter({100, 100}, Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
      QApplication::sendEvent(window_.get(), &enter);
      QVERIFY(enter.isAccepted());
      QDropEvent dropped({100.0, 100.0}, Qt::CopyAction, &data, Qt::LeftButton, Qt::NoModifier);
      QApplication::sendEvent(window_.get(), &dropped);
      QVERIFY(dropped.isAccepted());
    };
    drop(folder_.filePath("places.nodes.csv"));
    QVERIFY(!window_->workbench().sessionIsOpen());
    QVERIFY(onPage("page_import"));
    drop(folder_.filePath("good.fieldtrue"));
    QTRY_VERIFY_WITH_TIMEOUT(window_->workbench().sessionIsOpen(), 20000);
    QCOMPARE(QFileInfo(window_->workbench().sessionPath()).fileName(), QStringLiteral("good.fieldtrue"));
  }
  void init() {
    window_ = std::make_unique<MainWindow>();
    window_->resize(1280, 800);
    window_->show();
    window_->activateWindow();
    QVERIFY(QTest::qWaitForWindowExposed(window_.get()));
  }
  void cleanup() {
    window_.reset();
    QThreadPool::globalInstance()->waitForDone();
  }

  void millimetresAreNotCompared() {
    open("mm.fieldtrue");
    click("step_compare");
    QTRY_VERIFY_WITH_TIMEOUT(message().contains("1000, millimetres for metres"), kWaitMs);
    QVERIFY(!workbench().isComparing() && !workbench().comparison());
    QVERIFY2(text("verdict").contains("1000, millimetres for metres"), qPrintable(text("verdict")));
    QVERIFY(!find<QComboBox>("compareSensor")->isVisible());
    picture("refused-units");
    // Asking again does not help either.
    click("runComparison");
    QVERIFY(!workbench().isComparing() && !workbench().comparison());
    click(action("Use anyway"));
    QTRY_VERIFY_WITH_TIMEOUT(workbench().comparison() && !workbench().isComparing(), kWaitMs);
    QVERIFY(message().isEmpty());
    // The answer holds for the session, not for the next one.
    open("good.fieldtrue");
    open("mm.fieldtrue");
    click("step_compare");
    QTRY_VERIFY_WITH_TIMEOUT(message().contains("1000, millimetres for metres"), kWaitMs);
  }

  void noFieldOfAnotherSessionStaysInSight() {
    open("good.fieldtrue");
    click("step_compare");
    auto* left = find<FieldView>("fieldLeft");
    QTRY_VERIFY_WITH_TIMEOUT(workbench().comparison() && !workbench().isComparing(), kWaitMs);
    QVERIFY(left->field().arrows.size() == 18);
    open("mm.fieldtrue");
    click("step_compare");
    QTRY_VERIFY_WITH_TIMEOUT(message().contains("1000, millimetres for metres"), kWaitMs);
    QVERIFY(left->field().arrows.empty());
    QVERIFY(find<FieldView>("fieldRight")->field().arrows.empty());
  }

  void millimetresAreNotFitted() {
    open("mm.fieldtrue");
    workbench().fit({}, calibration::AlignMode::kRigid);
    QVERIFY(!workbench().isFitting());
    QVERIFY(message().contains("1000, millimetres for metres"));
  }

  void millimetresAreNotDiagnosed() {
    open("mm.fieldtrue");
    click("step_gap");
    click("diagnose");
    auto* page = window_->findChild<GapPage*>();
    QVERIFY(!page->isDiagnosing());
    QVERIFY2(message().contains("1000, millimetres for metres"), qPrintable(message()));
    QVERIFY(text("gapSentence").contains("1000, millimetres for metres"));
    click(action("Use anyway"));
    QVERIFY(page->isDiagnosing());
    click("diagnose");  // Stop.
    QVERIFY(!page->isDiagnosing());
  }

  void sensorsAreChosenToCompare() {
    open("two.fieldtrue");
    click("step_compare");
    // All are compared at once, each with a mounting of its own.
    QTRY_VERIFY_WITH_TIMEOUT(workbench().comparison() && !workbench().isComparing(), kWaitMs);
    QVERIFY(message().isEmpty());
    QVERIFY(workbench().comparison()->before_orientation_deg->median < 1.0);
    auto* sensor = find<QComboBox>("compareSensor");
    QVERIFY(sensor->isVisible());
    QCOMPARE(sensor->currentText(), QStringLiteral("All sensors"));
    picture("all-sensors");
    choose(sensor, 2);
    QTRY_VERIFY_WITH_TIMEOUT(workbench().comparison() && !workbench().isComparing(), kWaitMs);
    QCOMPARE(workbench().chosenSensor(), std::optional<int>(1));
    QCOMPARE(workbench().table().nodes.size(), std::size_t{9});
    for (const Node& node : workbench().table().nodes) QCOMPARE(node.sensor, 1);
    QCOMPARE(workbench().recordedTable().nodes.size(), std::size_t{18});
    QVERIFY(!text("verdict").contains("sensors 0 and 1"));
    choose(sensor, 1);
    QTRY_VERIFY_WITH_TIMEOUT(workbench().comparison() && !workbench().isComparing(), kWaitMs);
    for (const Node& node : workbench().table().nodes) QCOMPARE(node.sensor, 0);
    choose(sensor, 0);
    QCOMPARE(workbench().chosenSensor(), std::optional<int>());
    QCOMPARE(workbench().table().nodes.size(), std::size_t{18});
    open("good.fieldtrue");
    QVERIFY(!sensor->isVisible());
    QCOMPARE(workbench().table().nodes.size(), std::size_t{18});
  }

  void sensorsAreChosenToDiagnose() {
    open("two.fieldtrue");
    click("step_gap");
    click("diagnose");
    auto* page = window_->findChild<GapPage*>();
    // Both sensors are diagnosed at once, each with a mounting of its own.
    QTRY_VERIFY_WITH_TIMEOUT(page->report() && !page->isDiagnosing(), kWaitMs);
    QVERIFY(message().isEmpty());
    QCOMPARE(page->report()->sensors_from_mounts.size(), std::size_t{2});
    auto* sensor = find<QComboBox>("gapSensor");
    QVERIFY(sensor->isVisible());
    choose(sensor, 1);
    // Nine places are too few for the page, which says so.
    QVERIFY(!find<QWidget>("diagnose")->isVisible());
    QCOMPARE(find<QComboBox>("compareSensor")->currentIndex(), 1);
  }

 private:
  Workbench& workbench() { return window_->workbench(); }
  void click(QWidget* widget) { QTest::mouseClick(widget, Qt::LeftButton); }
  void click(const char* name) { click(find<QWidget>(name)); }
  QString text(const char* label) { return find<QLabel>(label)->text(); }
  QString message() { return window_->findChild<MessageLine*>()->text(); }
  QPushButton* action(const char* label) {
    for (QPushButton* button : window_->findChild<MessageLine*>()->findChildren<QPushButton*>())
      if (button->isVisible() && button->text() == QLatin1String(label)) return button;
    qFatal("no action %s", label);
  }
  void choose(QComboBox* box, int index) {
    box->setFocus();
    QTest::keyClick(box, Qt::Key_Home);
    for (int i = 0; i < index; ++i) QTest::keyClick(box, Qt::Key_Down);
    QCOMPARE(box->currentIndex(), index);
  }
  void open(const char* name) {
    const QString path = folder_.filePath(QString::fromLatin1(name));
    workbench().openSession(path);
    QTRY_VERIFY_WITH_TIMEOUT(workbench().sessionPath() == path && !workbench().table().nodes.empty(), kWaitMs);
  }
  void picture(const char* name) {
    const QString folder = qEnvironmentVariable("FIELDTRUE_ARTEFACTS");
    if (folder.isEmpty()) return;
    QVERIFY(QDir().mkpath(folder));
    QTest::qWait(400);
    QVERIFY(window_->grab().save(folder + QLatin1Char('/') + QLatin1String(name) + QStringLiteral(".png")));
  }
};

FIELDTRUE_WINDOW_TEST(RefusedTablesTest)
#include "refused_tables_test.moc"
