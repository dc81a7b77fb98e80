// A whole guided session in the window, by keys and clicks only: connect the simulated tracker, plan 5x5x4 places, take
// 60 samples at each, compare, fit, export, close, reopen. Leaves a picture of every page in FIELDTRUE_ARTEFACTS (or
// the folder `artefacts` beside the test).

#include <QApplication>
#include <QCheckBox>
#include <QComboBox>
#include <QDir>
#include <QDoubleSpinBox>
#include <QFileInfo>
#include <QImage>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QPainter>
#include <QPushButton>
#include <QSettings>
#include <QSlider>
#include <QSpinBox>
#include <QTabWidget>
#include <QTableView>
#include <QTableWidget>
#include <QTemporaryDir>
#include <QTest>
#include <algorithm>
#include <memory>

#include "calib/tables/table_io.h"
#include "tests/widgets/pages/window_driver.h"
#include "tests/widgets/session_fixture.h"
#include "widgets/compare/curve_panel.h"
#include "widgets/compare/method_panel.h"
#include "widgets/pages/gap_page.h"
#include "widgets/shell/main_window.h"
#include "widgets/style/theme.h"
#include "widgets/style/unit_texts.h"
#include "widgets/views/charts/chart_views.h"
#include "widgets/views/field/field_view.h"
#include "widgets/views/field/scale_strip.h"

namespace fieldtrue::widgets {
using testing::kWaitMs;

namespace {

constexpr int kPlaces = 5 * 5 * 4;
}  // namespace

class GuidedSessionTest : public testing::WindowDriver {
  Q_OBJECT

 private slots:
  void initTestCase();
  void startPageOffersWhatToDo();
  void connectsTheSimulatedTracker();
  void plansTheGrid();
  void takesEveryPlace();
  void undoSkipAndRetake();
  void comparesTheMethods();
  void showsAnyTwoMethods();
  void cutsTheVolume();
  void fadesWhatIsUncertain();
  void inspectsAPlace();
  void drawsLearningCurves();
  void comparesASettingToo();
  void diagnosesTheGap();
  void fitsAndExports();
  void reopensWhereItWas();

 private:
  void openWindow();
  bool waitUntilStillAtPlace();
  bool takeWith(Qt::Key key);
  const acquisition::AcquisitionStatus& status() { return window_->workbench().status(); }

  QString artefacts_;
  QString session_;
  QImage inspector_;  ///< Of a place, for the picture beside the learning curves.
};

void GuidedSessionTest::initTestCase() {
  QVERIFY(folder_.isValid());
  testing::keepIn(folder_);
  artefacts_ = qEnvironmentVariable("FIELDTRUE_ARTEFACTS", QStringLiteral("artefacts"));
  QVERIFY(QDir().mkpath(artefacts_));
  applyTheme(*qApp, qEnvironmentVariableIsSet("FIELDTRUE_DARK"));
  openWindow();
}

void GuidedSessionTest::openWindow() {
  window_ = std::make_unique<MainWindow>();
  window_->resize(1280, 800);
  window_->show();
  window_->activateWindow();
  QVERIFY(QTest::qWaitForWindowExposed(window_.get()));
}

void GuidedSessionTest::startPageOffersWhatToDo() {
  QVERIFY(onPage("page_start"));
  QVERIFY(find<QPushButton>("startDemo")->isVisible());
  picture(QStringLiteral("1-start"));
  click("step_acquire");
  QVERIFY(onPage("page_acquire"));
  picture(QStringLiteral("1-acquire-empty"));
  click("step_start");
  click("startConnect");
  QVERIFY(onPage("page_connect"));
}

void GuidedSessionTest::connectsTheSimulatedTracker() {
  auto* kind = find<QComboBox>("deviceKind");
  QCOMPARE(kind->currentData().toString(), QStringLiteral("simulated"));
  auto* scene = find<QComboBox>("deviceScene");
  QTest::keyClicks(scene, QStringLiteral("steel"));
  QCOMPARE(scene->currentData().toString(), QStringLiteral("steel_floor"));
  auto* speed = find<QWidget>("setting_speed");
  QTest::keyClick(speed, Qt::Key_A, Qt::ControlModifier);
  QTest::keyClicks(speed, QStringLiteral("6"));
  QTest::keyClick(speed, Qt::Key_Tab);
  QTest::keyClick(kind, Qt::Key_Tab);
  click("connectButton");
  QTRY_COMPARE_WITH_TIMEOUT(status().device, acquisition::DeviceState::kRunning, kWaitMs);
  QTRY_VERIFY_WITH_TIMEOUT(status().rate_hz > 10.0, kWaitMs);
  picture(QStringLiteral("2-connect"));
}

void GuidedSessionTest::plansTheGrid() {
  click("step_plan");
  QVERIFY(onPage("page_plan"));
  const std::pair<const char*, int> counts[] = {{"count_x", 5}, {"count_y", 5}, {"count_z", 4}};
  for (const auto& [name, count] : counts) {
    auto* box = find<QSpinBox>(name);
    QTest::keyClick(box, Qt::Key_A, Qt::ControlModifier);
    QTest::keyClicks(box, QString::number(count));
    QCOMPARE(box->value(), count);
  }
  QCOMPARE(find<QSpinBox>("samplesPerNode")->value(), 60);
  picture(QStringLiteral("3-plan"));
  click("createSession");
  QTRY_VERIFY_WITH_TIMEOUT(onPage("page_acquire"), kWaitMs);
  QTRY_COMPARE_WITH_TIMEOUT(status().session->places.size(), std::size_t{kPlaces}, kWaitMs);
  session_ = window_->workbench().sessionPath();
  QVERIFY(QFileInfo::exists(session_));
}

bool GuidedSessionTest::waitUntilStillAtPlace() {
  return QTest::qWaitFor(
      [this] {
        if (status().device != acquisition::DeviceState::kRunning || !status().current || !status().still) return false;
        const Pose planned = status().session->places[*status().current].reference_from_sensor;
        const Pose live = status().reference_from_tracker * status().live->tracker_from_sensor;
        return !status().reference_known || (planned.position_m - live.position_m).norm() < 0.15;
      },
      kWaitMs);
}

bool GuidedSessionTest::takeWith(Qt::Key key) {
  const std::size_t done = status().recorded->n_done;
  if (!waitUntilStillAtPlace()) return false;
  QTest::qWait(100);  // An operator, too, lets the jig settle before pressing.
  if (!waitUntilStillAtPlace()) return false;
  QTest::keyClick(window_.get(), key);
  return QTest::qWaitFor([this, done] { return status().recorded->n_done > done; }, kWaitMs);
}

void GuidedSessionTest::takesEveryPlace() {
  for (int place = 0; place < kPlaces; ++place) {
    QVERIFY2(takeWith(place % 2 == 0 ? Qt::Key_Space : Qt::Key_PageDown),
             qPrintable(QStringLiteral("place %1: %2").arg(place).arg(status().reason)));
    if (place == 37) picture(QStringLiteral("4-acquire"));
  }
  QCOMPARE(status().recorded->n_done, std::size_t{kPlaces});
  QVERIFY(!status().current.has_value());
  QTRY_COMPARE_WITH_TIMEOUT(window_->workbench().table().nodes.size(), std::size_t{kPlaces}, kWaitMs);
  for (const Node& node : window_->workbench().table().nodes) QCOMPARE(node.n_used + node.n_rejected, 60);
}

void GuidedSessionTest::undoSkipAndRetake() {
  QTest::keyClick(window_.get(), Qt::Key_U);
  QTRY_COMPARE_WITH_TIMEOUT(status().recorded->n_done, std::size_t{kPlaces - 1}, kWaitMs);
  QTest::keyClick(window_.get(), Qt::Key_S);
  QTRY_COMPARE_WITH_TIMEOUT(status().recorded->n_skipped, std::size_t{1}, kWaitMs);
  QTest::keyClick(window_.get(), Qt::Key_U);
  QTRY_COMPARE_WITH_TIMEOUT(status().recorded->n_skipped, std::size_t{0}, kWaitMs);
  QVERIFY(takeWith(Qt::Key_Space));

  auto* list = find<QTableView>("placeList");
  list->selectRow(12);
  QTest::keyClick(window_.get(), Qt::Key_R);
  QTRY_VERIFY_WITH_TIMEOUT(status().current == std::size_t{12}, kWaitMs);
  picture(QStringLiteral("4-acquire-retake"));
  QVERIFY(waitUntilStillAtPlace());
  QTest::keyClick(window_.get(), Qt::Key_Space);
  QTRY_VERIFY_WITH_TIMEOUT(!status().current.has_value(), kWaitMs);
  QCOMPARE(status().recorded->n_done, std::size_t{kPlaces});
}

void GuidedSessionTest::comparesTheMethods() {
  QTRY_COMPARE(find<QLabel>("bannerReason")->text(), QStringLiteral("Next: compare the methods"));
  QVERIFY(find<QPushButton>("take")->text().startsWith(QStringLiteral("Compare")));
  picture(QStringLiteral("4-acquire-done"));
  QTest::keyClick(window_.get(), Qt::Key_Space);
  QVERIFY(onPage("page_compare"));
  QTRY_VERIFY_WITH_TIMEOUT(window_->workbench().comparison().has_value() && !window_->workbench().isComparing(),
                           400000);
  const evaluation::Comparison& comparison = *window_->workbench().comparison();
  QCOMPARE(comparison.places.size(), std::size_t{kPlaces});
  // The room has a steel floor: its error is many times the noise, and smooth.
  QVERIFY(comparison.verdict.apply_position);
  QVERIFY2(find<QLabel>("verdict")->text().startsWith(QString::fromStdString(comparison.verdict.text)),
           qPrintable(find<QLabel>("verdict")->text()));
  auto* table = find<QTableView>("positionTable");
  QVERIFY(table->model()->rowCount() >= static_cast<int>(comparison.position.size()));
  picture(QStringLiteral("5-compare"));

  auto* scale = find<QSlider>("glyphScale");
  const int before = scale->value();
  QTest::keyClick(scale, Qt::Key_PageUp);
  QVERIFY(scale->value() != before);
}

void GuidedSessionTest::showsAnyTwoMethods() {
  const evaluation::Comparison& comparison = *window_->workbench().comparison();
  auto* left = find<QComboBox>("leftMethod");
  auto* right = find<QComboBox>("rightMethod");
  QCOMPARE(right->currentData().toInt(), static_cast<int>(*comparison.best_position_row));
  left->setFocus();
  QTest::keyClick(left, Qt::Key_End);
  if (left->currentIndex() == right->currentIndex()) QTest::keyClick(left, Qt::Key_Up);
  QVERIFY(left->currentData().toInt() >= 0);
  QVERIFY(left->currentData().toInt() != right->currentData().toInt());
  QVERIFY(find<FieldView>("fieldLeft")->isVisible());
  QVERIFY(find<FieldView>("fieldLeft")->cameraPose() == find<FieldView>("fieldRight")->cameraPose());
  picture(QStringLiteral("5-compare-two"));
  click("modeDifference");
  QVERIFY(!find<FieldView>("fieldLeft")->isVisible());
  QVERIFY(find<FieldView>("fieldRight")->isVisible());
  QVERIFY(find<ScaleStrip>("scaleStrip")->text().contains(QStringLiteral("better by")));
  picture(QStringLiteral("5-compare-difference"));
  click("modeTwo");
  QTest::keyClick(left, Qt::Key_Home);
  QCOMPARE(left->currentData().toInt(), -1);
}

void GuidedSessionTest::cutsTheVolume() {
  auto* quantity = find<QComboBox>("volumeQuantity");
  auto* text = find<QLabel>("volumeText");
  const auto shot = [this] { return find<FieldView>("fieldLeft")->picture(); };
  const QImage places = shot();
  // Not typed: on a busy machine the list forgets letters that are far apart.
  const auto choose = [quantity](const QString& start) {
    quantity->setCurrentIndex(quantity->findText(start, Qt::MatchStartsWith));
  };
  choose(QStringLiteral("Expected"));
  QTRY_VERIFY_WITH_TIMEOUT(text->text().contains(QStringLiteral("interpolated between the places")), kWaitMs);
  QTRY_VERIFY(shot() != places);
  const QImage middle = shot();
  auto* slider = find<QSlider>("slicePosition");
  QTest::keyClick(slider, Qt::Key_PageUp);
  QTRY_VERIFY(shot() != middle);
  find<QCheckBox>("sliceShown")->click();
  const QImage without = shot();
  find<QCheckBox>("isoShown")->click();
  QTRY_VERIFY(shot() != without);
  auto* iso = find<QDoubleSpinBox>("isoValue");
  const QImage first = shot();
  QTest::keyClick(iso, Qt::Key_Up);
  QTRY_VERIFY(shot() != first);
  find<QCheckBox>("sliceShown")->click();
  choose(QStringLiteral("Size"));
  QTRY_VERIFY_WITH_TIMEOUT(text->text().contains(QStringLiteral("moves a reading")), kWaitMs);
  const int left = find<QComboBox>("leftMethod")->currentIndex();
  const int tetrahedral = find<QComboBox>("leftMethod")->findText(QStringLiteral("Tetrahedral"), Qt::MatchStartsWith);
  if (tetrahedral >= 0) find<QComboBox>("leftMethod")->setCurrentIndex(tetrahedral);
  choose(QStringLiteral("Expected"));
  QTRY_VERIFY_WITH_TIMEOUT(!text->text().contains(QStringLiteral("Sampling")), kWaitMs);
  iso->setValue(20.0);
  slider->setValue(25);
  picture(QStringLiteral("5-compare-slice"));
  find<QComboBox>("leftMethod")->setCurrentIndex(left);
  find<QCheckBox>("isoShown")->click();
  click("modeDifference");
  QTRY_VERIFY_WITH_TIMEOUT(text->text().contains(QStringLiteral("needs two methods")), kWaitMs);
  click("modeTwo");
  choose(QStringLiteral("Places"));
  QTRY_VERIFY(!text->isVisible());
}

void GuidedSessionTest::fadesWhatIsUncertain() {
  auto* right = find<QComboBox>("rightMethod");
  auto* strip = find<ScaleStrip>("scaleStrip");
  const int best = right->currentIndex();
  const auto choose = [&](const QString& name) {
    for (int row = 0; row < right->count(); ++row)
      if (right->itemText(row).startsWith(name)) right->setCurrentIndex(row);
  };
  click("modeOne");
  choose(QStringLiteral("Gaussian process"));
  const QImage opaque = find<FieldView>("fieldRight")->picture();
  find<QCheckBox>("showCertainty")->click();
  QTRY_VERIFY_WITH_TIMEOUT(strip->text().contains(QStringLiteral("Faint arrows are uncertain")), kWaitMs);
  QTRY_VERIFY(find<FieldView>("fieldRight")->picture() != opaque);
  picture(QStringLiteral("5-compare-certainty"));
  choose(QStringLiteral("Rigid"));
  QTRY_VERIFY_WITH_TIMEOUT(
      find<QLabel>("certaintyText")->text().contains(QStringLiteral("does not state its uncertainty")), kWaitMs);
  QVERIFY(!strip->text().contains(QStringLiteral("Faint")));
  find<QCheckBox>("showCertainty")->click();
  right->setCurrentIndex(best);
  click("modeTwo");
}

void GuidedSessionTest::inspectsAPlace() {
  const evaluation::Comparison& comparison = *window_->workbench().comparison();
  const int node = comparison.places.at(17);
  auto* view = find<FieldView>("fieldRight");
  emit view->nodeClicked(node);
  QTRY_VERIFY(find<QTableWidget>("placePosition")->isVisible());
  auto* table = find<QTableWidget>("placePosition");
  int usable = 1;  // The error before.
  for (const evaluation::MethodScore& score : comparison.position) usable += !score.skipped && score.method != "none";
  QCOMPARE(table->rowCount(), usable);
  std::vector<double> expected = {comparison.before_place_mm.at(17)};
  for (const evaluation::MethodScore& score : comparison.position)
    if (!score.skipped && score.method != "none") expected.push_back(score.place_errors.at(17));
  std::sort(expected.begin(), expected.end());
  for (int row = 0; row < table->rowCount(); ++row)
    QCOMPARE(table->item(row, 1)->text(), threeFigures(expected[static_cast<std::size_t>(row)]));
  QString facts;
  for (const QLabel* label : find<QWidget>("placeFacts")->findChildren<QLabel*>()) facts += label->text() + u'\n';
  QVERIFY2(facts.contains(QStringLiteral("scatter alone gives")), qPrintable(facts));
  QVERIFY2(facts.contains(QStringLiteral("used, ")), qPrintable(facts));
  picture(QStringLiteral("5-compare-place"));
  inspector_ = find<QWidget>("page_compare")->findChild<QWidget*>(QStringLiteral("inspector"))->grab().toImage();
  inspector_.setDevicePixelRatio(1.0);
}

void GuidedSessionTest::drawsLearningCurves() {
  auto* tabs = find<QTabWidget>("inspectorTabs");
  tabs->setCurrentIndex(tabs->count() - 1);
  auto* curves = find<QComboBox>("curveMethods");
  curves->setFocus();
  QTest::keyClick(curves, Qt::Key_Home);
  click("curveStart");
  auto* view = find<CurveView>("curveView");
  QTRY_VERIFY_WITH_TIMEOUT(!view->lines().empty(), 240000);
  for (const ChartLine& line : view->lines()) {
    QVERIFY(!line.points.empty());
    for (std::size_t k = 1; k < line.points.size(); ++k) QVERIFY(line.points[k].x > line.points[k - 1].x);
    // A smooth field: with most of the places a fit is better than with the fewest.
    if (line.points.size() > 2) QVERIFY(line.points.back().y < 1.5 * line.points.front().y);
  }
  picture(QStringLiteral("5-compare-curve"));
  QImage curves_tab = find<QWidget>("page_compare")->findChild<QWidget*>(QStringLiteral("inspector"))->grab().toImage();
  curves_tab.setDevicePixelRatio(1.0);
  QImage both(inspector_.width() + curves_tab.width(), inspector_.height(), QImage::Format_RGB32);
  both.fill(theme().surface);
  QPainter painter(&both);
  painter.drawImage(0, 0, inspector_);
  painter.drawImage(inspector_.width(), 0, curves_tab);
  painter.end();
  QVERIFY(both.save(artefacts_ + QStringLiteral("/5-place-and-curve.png")));
  click("curveStart");
  click("curveStart");
  QTRY_VERIFY(!find<CurvePanel>("curvePanel")->isRunning());
  tabs->setCurrentIndex(0);
}

void GuidedSessionTest::comparesASettingToo() {
  const std::size_t compared = window_->workbench().comparison()->position.size();
  auto* tabs = find<QTabWidget>("inspectorTabs");
  tabs->setCurrentIndex(1);
  click("positionNone");
  QVERIFY(find<QLabel>("positionTicks")->text().startsWith(QStringLiteral("0 of")));
  auto* table = find<QTableView>("positionTable");
  for (int row = 0; row < table->model()->rowCount(); ++row) {
    const QModelIndex index = table->model()->index(row, 0);
    if (index.data().toString() == QStringLiteral("Polynomial")) {
      table->setCurrentIndex(index);
      table->model()->setData(index, Qt::Checked, Qt::CheckStateRole);
    }
  }
  picture(QStringLiteral("5-compare-methods"));
  auto* panel = find<MethodPanel>("positionPanel");
  QWidget* degree = panel->findChild<QWidget*>(QStringLiteral("setting_degree"));
  QVERIFY(degree != nullptr);
  QTest::keyClick(degree, Qt::Key_Up);
  QVERIFY(find<QLabel>("positionTicks")->text().startsWith(QStringLiteral("2 of")));
  click("runComparison");
  QTRY_VERIFY_WITH_TIMEOUT(!window_->workbench().isComparing(), 400000);
  const evaluation::Comparison& comparison = *window_->workbench().comparison();
  QVERIFY(comparison.position.size() < compared);
  QCOMPARE(comparison.position.size(), std::size_t{3});  // none and polynomial in two ways
  QVERIFY(comparison.position[1].settings != comparison.position[2].settings);
  click("positionQuick");
  click("runComparison");
  QTRY_VERIFY_WITH_TIMEOUT(!window_->workbench().isComparing(), 400000);
  QCOMPARE(window_->workbench().comparison()->position.size(),
           static_cast<std::size_t>(find<MethodPanel>("positionPanel")->tickedCount()) + 1);
  tabs->setCurrentIndex(0);
}

void GuidedSessionTest::diagnosesTheGap() {
  click("step_gap");
  QVERIFY(onPage("page_gap"));
  auto* page = window_->findChild<GapPage*>();
  QVERIFY(page && !page->report().has_value());
  click("diagnose");
  QTRY_VERIFY_WITH_TIMEOUT(page->report().has_value(), 400000);
  QCOMPARE(page->report()->input.places, kPlaces);
  QVERIFY(page->report()->verdict != gap::GapVerdict::kNoGap);
  QCOMPARE(find<QLabel>("gapSentence")->text(), QString::fromStdString(page->report()->text));
  QVERIFY(window_->workbench().gapReport().has_value());
  picture(QStringLiteral("6-gap-session"));
}

void GuidedSessionTest::fitsAndExports() {
  click("fit");
  QTRY_VERIFY_WITH_TIMEOUT(window_->workbench().corrector().has_value(), kWaitMs);
  click("step_export");
  QVERIFY(onPage("page_export"));
  auto* list = find<QListWidget>("exportList");
  auto* path = find<QLineEdit>("exportPath");
  for (int row = 0; row < list->count(); ++row) {
    if (!(list->item(row)->flags() & Qt::ItemIsEnabled)) continue;                // A heading.
    if (list->item(row)->text().contains(QStringLiteral("olynomial"))) continue;  // Of another method's calibration.
    list->setCurrentRow(row);
    const QString target = folder_.filePath(QStringLiteral("out%1").arg(row));
    QTest::keyClick(path, Qt::Key_A, Qt::ControlModifier);
    QTest::keyClicks(path, target);
    click("exportWrite");
    QTRY_VERIFY2_WITH_TIMEOUT(QFileInfo::exists(target), qPrintable(list->item(row)->text()), kWaitMs);
    QTRY_VERIFY_WITH_TIMEOUT(find<QPushButton>("exportWrite")->isEnabled(), kWaitMs);
    if (list->item(row)->text().contains(QStringLiteral("ftcal"), Qt::CaseInsensitive)) {
      const auto loaded = calibration::Corrector::load(target.toStdString());
      QVERIFY(loaded.has_value());
      const Pose probe{Eigen::Vector3d(1.1, 0.1, 0.2), Eigen::Quaterniond::Identity()};
      QCOMPARE(loaded->correct(probe).position_m, window_->workbench().corrector()->correct(probe).position_m);
    }
  }
  picture(QStringLiteral("6-export"));

  list->setCurrentItem(list->findItems(QStringLiteral(".ftcal.json"), Qt::MatchContains).first());
  const QString baked = folder_.filePath(QStringLiteral("baked.ftcal.json"));
  find<QCheckBox>("exportBake")->click();
  QTest::keyClick(path, Qt::Key_A, Qt::ControlModifier);
  QTest::keyClicks(path, baked);
  click("exportWrite");
  QTRY_VERIFY_WITH_TIMEOUT(QFileInfo::exists(baked) && find<QPushButton>("exportWrite")->isEnabled(), 60000);
  const auto loaded = calibration::Corrector::load(baked.toStdString());
  QVERIFY(loaded.has_value());
  QVERIFY(loaded->isBaked());
  int n_covered = 0;
  for (const Node& node : window_->workbench().table().nodes) {
    const Eigen::Vector3d& p_tracked_m = node.tracker_from_sensor.position_m;
    if (!loaded->covers(p_tracked_m)) continue;
    ++n_covered;
    const Eigen::Vector3d exact_m = window_->workbench().corrector()->correctPosition_m(p_tracked_m);
    QVERIFY((loaded->correctPosition_m(p_tracked_m) - exact_m).norm() < 1e-4);  // 0.05 mm was asked for
  }
  QVERIFY(n_covered > 0);
}

void GuidedSessionTest::reopensWhereItWas() {
  const CalibrationTable before = window_->workbench().table();
  window_->close();
  window_.reset();
  QVERIFY(!QFileInfo::exists(session_ + QStringLiteral("-wal")));

  openWindow();
  QVERIFY(onPage("page_start"));
  window_->workbench().openSession(session_);
  QTRY_VERIFY_WITH_TIMEOUT(onPage("page_export"), kWaitMs);
  QTRY_COMPARE_WITH_TIMEOUT(window_->workbench().table().nodes.size(), before.nodes.size(), kWaitMs);
  for (std::size_t i = 0; i < before.nodes.size(); ++i)
    QCOMPARE(window_->workbench().table().nodes[i].tracker_from_sensor.position_m,
             before.nodes[i].tracker_from_sensor.position_m);
  QTRY_VERIFY_WITH_TIMEOUT(window_->workbench().corrector().has_value(), kWaitMs);
  QCOMPARE(QSettings().value(QStringLiteral("recent")).toStringList().first(), session_);
  window_.reset();
}

}  // namespace fieldtrue::widgets

FIELDTRUE_WINDOW_TEST(fieldtrue::widgets::GuidedSessionTest)
#include "guided_session_test.moc"
