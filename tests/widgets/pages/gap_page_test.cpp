#include "widgets/pages/gap_page.h"

#include <QCheckBox>
#include <QDir>
#include <QElapsedTimer>
#include <QLabel>
#include <QProgressBar>
#include <QPushButton>
#include <QScrollArea>
#include <QSignalSpy>
#include <QTemporaryDir>
#include <QTest>
#include <QThreadPool>
#include <atomic>
#include <thread>

#include "acquisition/session/imported_session.h"
#include "calib/tables/table_writer.h"
#include "tests/support/matchers.h"
#include "tests/widgets/gap_fixture.h"
#include "tests/widgets/pages/window_driver.h"
#include "tests/widgets/session_fixture.h"
#include "tests/widgets/window_test.h"
#include "widgets/figures/gap_field.h"
#include "widgets/shell/main_window.h"
#include "widgets/style/theme.h"
#include "widgets/views/charts/gap_bar_view.h"
#include "widgets/views/field/field_view.h"

using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

namespace {

/// Runs until it is stopped, as a long diagnosis would.
Result<gap::GapReport> runUntilStopped(const CalibrationTable&, const SampleTable*, const simulation::Scene*,
                                       const gap::DiagnosisOptions&, const RunControl& control) {
  while (!control.stop.stop_requested()) {
    control.progress(0.4);
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return fail(ErrorCode::kCancelled, "stopped");
}

const GapBarChart& chart(GapPage& page, const char* id) {
  return find<GapBarView>(page, (std::string("chart_") + id).c_str())->chart();
}

GapPage* openedAtGap(MainWindow& window) {
  window.resize(1280, 800);
  window.show();
  if (!QTest::qWaitForWindowExposed(&window)) return nullptr;
  QTest::mouseClick(find<QWidget>(window, "step_gap"), Qt::LeftButton);
  return window.findChild<GapPage*>();
}

QString textOf(GapPage& page, const char* label) { return find<QLabel>(page, label)->text(); }

}  // namespace

class GapPageTest : public QObject {
  Q_OBJECT

 private slots:
  void initTestCase();
  void cleanup() { QThreadPool::globalInstance()->waitForDone(); }
  void tooFewPlacesSayWhatIsMissing_data();
  void tooFewPlacesSayWhatIsMissing();
  void showsWhatTheReportSays();
  void explainedSaysWhetherItIsSure();
  void switchShowsWhatIsLeft();
  void trustIsAskedFor();
  void changeSinceIsAskedFor();
  void unitsOfTheEarlierAreChecked();
  void addAndUndoChangeTheScene();
  void stopEndsTheRun();
  void someOfThePlacesAnswerFirst();
  void otherRowsDropTheReport();
  void whyItFailedIsTold();
  void goesWhileRunning();
  void realDiagnosisStopsSoon();
  void positionOnlyIsDiagnosed();
  void windowFindsTheMetal();
  void windowTellsWhatCame();
  void windowTellsAProvisionalAnswer();
  void windowTellsWhyACauseIsRefused();

 private:
  /// Whether the first body drawn is the known room's, within 10 cm.
  bool standsAtTheMetal(const ErrorField& field) const {
    return !field.bodies.empty() && (field.bodies[0].center_m - room_.body_m).norm() < 0.1;
  }
  /// A page on the known room whose diagnosis answers at once.
  std::unique_ptr<GapPage> pageThatAnswers(const gap::GapReport& report);

  QTemporaryDir folder_;
  KnownRoom room_;
  std::unique_ptr<Workbench> workbench_;
  std::atomic<int> runs_ = 0;
  std::vector<std::size_t> effects_believed_;  ///< Of the scene each run was given.
};

void GapPageTest::initTestCase() {
  QVERIFY(folder_.isValid());
  keepIn(folder_);
  applyTheme(*qApp, qEnvironmentVariableIsSet("FIELDTRUE_DARK"));
  room_ = roomWithSteel();
  workbench_ = std::make_unique<Workbench>();
}

std::unique_ptr<GapPage> GapPageTest::pageThatAnswers(const gap::GapReport& report) {
  runs_ = 0;
  effects_believed_.clear();
  const auto answer = [this, report](const CalibrationTable&, const SampleTable*, const simulation::Scene* scene,
                                     const gap::DiagnosisOptions& options,
                                     const RunControl&) -> Result<gap::GapReport> {
    ++runs_;
    effects_believed_.push_back(scene ? scene->effects.size() : 0);
    gap::GapReport answered = report;
    if (options.replicates > 0) {
      answered.replicates.emplace();
      answered.replicates->n = options.replicates;
      answered.replicates->text = "Named so 46 times of 50.";
    }
    return answered;
  };
  auto page = std::make_unique<GapPage>(*workbench_, answer);
  page->resize(1184, 740);
  page->setRecording(room_.table, {});
  find<QPushButton>(*page, "diagnose")->click();
  if (!QTest::qWaitFor([&] { return !page->isDiagnosing(); }, kWaitMs)) qFatal("no answer");
  return page;
}

void GapPageTest::tooFewPlacesSayWhatIsMissing_data() {
  QTest::addColumn<int>("places");
  QTest::newRow("none") << 0;
  QTest::newRow("one") << 1;
  QTest::newRow("eleven") << 11;
}

void GapPageTest::tooFewPlacesSayWhatIsMissing() {
  QFETCH(int, places);
  CalibrationTable table = room_.table;
  table.nodes.resize(static_cast<std::size_t>(places));
  GapPage page(*workbench_);
  page.setRecording(table, {});
  page.show();
  QVERIFY(!find<QPushButton>(page, "diagnose")->isVisible());
  page.setRecording(room_.table, {});
  QVERIFY(find<QPushButton>(page, "diagnose")->isVisible());
}

void GapPageTest::showsWhatTheReportSays() {
  const gap::GapReport report = writtenReport();
  const auto page = pageThatAnswers(report);
  QCOMPARE(textOf(*page, "headline"),
           QStringLiteral("Partly explained: ") + QString::fromStdString(effectLabel("compact_metal")));
  QCOMPARE(textOf(*page, "gapSentence"), QString::fromStdString(report.text));
  QVERIFY(textOf(*page, "gapNext").contains(QString::fromStdString(report.next_measurement)));
  QVERIFY(textOf(*page, "gapHowFarOff").contains(QStringLiteral("readings that no fit saw lie off by less than")));
  QVERIFY(textOf(*page, "gapPrediction").contains(QStringLiteral("P2 falls from 31 to 12 +- 4 mm")));

  const GapBarChart& probability = chart(*page, "probability");
  QCOMPARE(probability.bars.size(), std::size_t{3});
  QCOMPARE(probability.bars[0].text, std::string("75 %"));
  QCOMPARE(probability.bars[1].value, 0.2);
  QVERIFY(probability.bars[0].note.find(effectLabel("finite_plate")) != std::string::npos);
  QVERIFY(probability.bars[1].note.find("9 percent an hour") != std::string::npos);
  const GapBarChart& shrinkage = chart(*page, "shrinkage");
  QCOMPARE(shrinkage.bars.size(), std::size_t{2});
  QCOMPARE(shrinkage.bars[0].value, 0.75);
  QCOMPARE(*shrinkage.bars[0].low90, 0.6);
  const GapBarChart& waterfall = chart(*page, "waterfall");
  QCOMPARE(waterfall.bars.size(), std::size_t{3});
  QCOMPARE(waterfall.bars[0].value, 4.0);
  QCOMPARE(waterfall.bars[1].value, 1.0);
  QCOMPARE(waterfall.bars[2].value, 0.0);
  QVERIFY(waterfall.bars[2].text.find("1.5 mm") != std::string::npos);
  QCOMPARE(chart(*page, "range").bars.size(), std::size_t{2});
  QCOMPARE(*chart(*page, "range").bars[0].floor, 1.5);
  QCOMPARE(chart(*page, "time").bars[0].value, 3.0);
  QCOMPARE(chart(*page, "origin").bars[0].value, 0.8);
  QCOMPARE(textOf(*page, "gapFinding"), QStringLiteral("Places 0 and 3 hold the same reading."));
}

void GapPageTest::explainedSaysWhetherItIsSure() {
  gap::GapReport report = writtenReport();
  report.verdict = gap::GapVerdict::kExplained;
  const auto stateOf = [](GapPage& page) { return find<QWidget>(page, "verdictBar")->property("state").toString(); };
  report.remaining.low90 = 0.0;
  for (const double high90 : {0.8, 0.2}) {
    report.remaining.high90 = high90;
    const auto unsure = pageThatAnswers(report);
    QVERIFY2(textOf(*unsure, "headline").startsWith("Explained as far as these places can tell: "),
             qPrintable(textOf(*unsure, "headline")));
    QCOMPARE(stateOf(*unsure), QString("leave"));
  }
  report.remaining.high90 = 0.1;
  const auto sure = pageThatAnswers(report);
  QVERIFY2(textOf(*sure, "headline").startsWith("Explained: "), qPrintable(textOf(*sure, "headline")));
  QCOMPARE(stateOf(*sure), QString("apply"));
}

void GapPageTest::switchShowsWhatIsLeft() {
  const gap::GapReport report = writtenReport();
  const auto page = pageThatAnswers(report);
  const ErrorField& field = find<FieldView>(*page, "gapField")->field();
  QCOMPARE(field.arrows.size(), report.nodes.size());
  for (std::size_t n = 0; n < report.nodes.size(); ++n) {
    QCOMPARE(field.arrows[n].flagged, report.nodes[n].is_flagged);
    QVERIFY((field.arrows[n].error_m - report.nodes[n].before_m).norm() < 1e-12);
  }
  QCOMPARE(field.bodies.size(), std::size_t{1});
  QCOMPARE(field.bodies[0].radius_m, 0.1);
  // Standard deviations of 2, 1 and 1 cm; a ball of 2.5 of them holds 90 %.
  FT_VERIFY_MATCH(near(field.bodies[0].region_m.colwise().norm().maxCoeff(), 2.5 * 0.02, 1e-9));
  find<QCheckBox>(*page, "showAfter")->setChecked(true);
  QVERIFY((field.arrows[1].error_m - report.nodes[1].after_m).norm() < 1e-12);
}

void GapPageTest::trustIsAskedFor() {
  const auto page = pageThatAnswers(writtenReport());
  auto* trust = page->findChild<QPushButton*>("trustGap");
  QVERIFY(trust->isEnabled());
  QTest::mouseClick(trust, Qt::LeftButton);
  QTRY_VERIFY(page->report() && page->report()->replicates && !page->isDiagnosing());
  QCOMPARE(page->report()->replicates->n, 50);
  QCOMPARE(page->findChild<QLabel*>("gapTrust")->text(), QStringLiteral("Named so 46 times of 50."));
  QVERIFY(!trust->isEnabled());
}

/// The known room held against itself recorded before, through a file: nothing changed, and the page says so.
void GapPageTest::changeSinceIsAskedFor() {
  GapPage page(*workbench_);
  page.resize(1184, 740);
  page.setRecording(room_.table, {});
  page.diagnoseSince(folder_.filePath("none.csv"));
  QVERIFY(!page.isDiagnosing());
  const QString path = folder_.filePath("yesterday.nodes.csv");
  QVERIFY(writeNodeTable(path.toStdString(), room_.table).has_value());
  page.diagnoseSince(path);
  QVERIFY(page.isDiagnosing());
  QVERIFY(!find<QPushButton>(page, "gapAgainst")->isEnabled());
  QTRY_VERIFY_WITH_TIMEOUT(page.report().has_value(), kWaitMs);
  QVERIFY(page.report()->against && !page.report()->against->changed);
  QCOMPARE(find<QLabel>(page, "headline")->text(), QStringLiteral("Nothing changed since the earlier recording"));
  QVERIFY(find<QLabel>(page, "gapBelieved")->text().contains("yesterday.nodes.csv"));
  const QString session = folder_.filePath("yesterday.fieldtrue");
  QVERIFY(acquisition::makeSession(session, room_.table, {}, "yesterday").has_value());
  page.diagnoseSince(session);
  QTRY_VERIFY_WITH_TIMEOUT(page.report().has_value() && !page.isDiagnosing(), kWaitMs);
  QVERIFY(page.report()->against && !page.report()->against->changed);
  QVERIFY(find<QLabel>(page, "gapBelieved")->text().contains("yesterday.fieldtrue"));
  QVERIFY(!find<QPushButton>(page, "addToSimulation")->isEnabled());
  QCOMPARE(gapField(*page.report(), false).title, QStringLiteral("What changed since the earlier recording"));
  find<QPushButton>(page, "diagnose")->click();
  QTRY_VERIFY_WITH_TIMEOUT(page.report().has_value() && !page.isDiagnosing(), kWaitMs);
  QVERIFY(!page.report()->against);
}

/// True positions in millimetres are no earlier recording until somebody insists.
void GapPageTest::unitsOfTheEarlierAreChecked() {
  const auto page = pageThatAnswers(writtenReport());
  CalibrationTable in_mm = room_.before;
  for (Node& node : in_mm.nodes) node.reference_from_sensor.position_m *= 1000.0;
  const QString path = folder_.filePath("in_mm.nodes.csv");
  QVERIFY(writeNodeTable(path.toStdString(), in_mm).has_value());
  QSignalSpy messages(workbench_.get(), &Workbench::messageShown);
  page->diagnoseSince(path);
  QVERIFY(!page->isDiagnosing());
  QCOMPARE(messages.size(), 1);
  const auto message = messages[0][0].value<Message>();
  QVERIFY2(message.text.contains("millimetres"), qPrintable(message.text));
  QCOMPARE(message.action_label, QStringLiteral("Use anyway"));
  message.action();
  QTRY_VERIFY_WITH_TIMEOUT(runs_.load() == 2 && !page->isDiagnosing(), kWaitMs);
  QVERIFY(find<QLabel>(*page, "gapBelieved")->text().contains("in_mm.nodes.csv"));
}

void GapPageTest::addAndUndoChangeTheScene() {
  const auto page = pageThatAnswers(writtenReport());
  QVERIFY(!find<QPushButton>(*page, "undoAdd")->isEnabled());
  find<QPushButton>(*page, "addToSimulation")->click();
  QVERIFY(page->scene().has_value());
  QCOMPARE(page->scene()->effects.size(), std::size_t{1});
  QCOMPARE(page->scene()->effects[0].id, std::string("compact_metal"));
  QTRY_VERIFY_WITH_TIMEOUT(!page->isDiagnosing(), kWaitMs);
  QCOMPARE(effects_believed_, (std::vector<std::size_t>{0, 1}));
  find<QPushButton>(*page, "undoAdd")->click();
  QVERIFY(!page->scene().has_value());
  QVERIFY(!page->isDiagnosing());
  QVERIFY(page->report().has_value());
  QCOMPARE(runs_.load(), 2);
  QVERIFY(!find<QPushButton>(*page, "undoAdd")->isEnabled());
}

void GapPageTest::stopEndsTheRun() {
  GapPage page(*workbench_, runUntilStopped);
  page.setRecording(room_.table, {});
  page.show();
  auto* button = find<QPushButton>(page, "diagnose");
  button->click();
  QVERIFY(page.isDiagnosing());
  QTRY_COMPARE_WITH_TIMEOUT(find<QProgressBar>(page, "gapProgress")->value(), 400, kWaitMs);
  QVERIFY(find<QProgressBar>(page, "gapProgress")->isVisible());
  QVERIFY(!find<QPushButton>(page, "addToSimulation")->isEnabled());
  button->click();
  QVERIFY(!page.isDiagnosing());
  QVERIFY(!page.report().has_value());
  QVERIFY(!find<QProgressBar>(page, "gapProgress")->isVisible());
}

void GapPageTest::someOfThePlacesAnswerFirst() {
  CalibrationTable many = room_.table;
  for (Node node : room_.table.nodes) {
    node.node += 1000;
    node.reference_from_sensor.position_m.x() += 2.0;
    many.nodes.push_back(node);
  }
  std::atomic<bool> is_all_looked_at = false;
  const auto answer = [&](const CalibrationTable& table, const SampleTable*, const simulation::Scene*,
                          const gap::DiagnosisOptions&, const RunControl& control) -> Result<gap::GapReport> {
    gap::GapReport report = writtenReport();
    report.input.places = static_cast<int>(table.nodes.size());
    if (table.nodes.size() == many.nodes.size()) {
      report.verdict = gap::GapVerdict::kUnexplained;
      while (!is_all_looked_at && !control.stop.stop_requested())
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return report;
  };
  GapPage page(*workbench_, answer);
  page.setRecording(many, {});
  auto* diagnose = find<QPushButton>(page, "diagnose");
  const auto isProvisional = [&] { return textOf(page, "headline").startsWith("Provisional: "); };
  diagnose->click();
  QTRY_VERIFY_WITH_TIMEOUT(isProvisional(), kWaitMs);
  QVERIFY(page.isDiagnosing());
  QVERIFY(!page.report());
  QCOMPARE(find<QWidget>(page, "verdictBar")->property("state").toString(), QString());
  QVERIFY2(textOf(page, "gapSentence").startsWith("By 60 of the places; all of them are being looked at. Most of"),
           qPrintable(textOf(page, "gapSentence")));
  for (const char* button : {"addToSimulation", "saveGapReport", "trustGap"})
    QVERIFY2(!find<QPushButton>(page, button)->isEnabled(), button);
  QVERIFY(!page.saveReport(folder_.filePath("provisional.gap.json")));
  // Stopped: what was told stays, and is no report.
  diagnose->click();
  QVERIFY(!page.isDiagnosing());
  QVERIFY(isProvisional() && !page.report());
  QVERIFY(textOf(page, "gapSentence").contains("yet to be looked at"));
  QVERIFY(!find<QPushButton>(page, "saveGapReport")->isEnabled());
  is_all_looked_at = true;
  diagnose->click();
  QTRY_VERIFY_WITH_TIMEOUT(page.report().has_value(), kWaitMs);
  QVERIFY(!isProvisional());
  QCOMPARE(page.report()->verdict, gap::GapVerdict::kUnexplained);
  QVERIFY(!page.isDiagnosing());
  // Again: what all of them said stays until they are looked at again.
  is_all_looked_at = false;
  diagnose->click();
  QVERIFY(page.isDiagnosing() && page.report() && !isProvisional());
}

void GapPageTest::otherRowsDropTheReport() {
  const auto page = pageThatAnswers(writtenReport());
  find<QPushButton>(*page, "addToSimulation")->click();
  QTRY_VERIFY_WITH_TIMEOUT(page->report().has_value(), kWaitMs);
  CalibrationTable fewer = room_.table;
  fewer.nodes.pop_back();
  page->setRecording(fewer, {});
  QVERIFY(!page->report().has_value());
  QVERIFY(find<FieldView>(*page, "gapField")->field().arrows.empty());
  QVERIFY(!find<QPushButton>(*page, "saveGapReport")->isEnabled());
  find<QPushButton>(*page, "undoAdd")->click();
  QVERIFY(!page->report().has_value());
  QCOMPARE(runs_.load(), 2);
}

void GapPageTest::whyItFailedIsTold() {
  GapPage page(*workbench_, [](auto&&...) -> Result<gap::GapReport> {
    return fail(ErrorCode::kTooFewNodes, "Diagnosis needs 12 places, got 3");
  });
  page.setRecording(room_.table, {});
  QSignalSpy messages(workbench_.get(), &Workbench::messageShown);
  find<QPushButton>(page, "diagnose")->click();
  QTRY_COMPARE_WITH_TIMEOUT(messages.size(), 1, kWaitMs);
  QCOMPARE(messages[0][0].value<Message>().text, QStringLiteral("Diagnosis needs 12 places, got 3"));
  QVERIFY(!page.isDiagnosing());
}

void GapPageTest::goesWhileRunning() {
  auto page = std::make_unique<GapPage>(*workbench_, runUntilStopped);
  page->setRecording(room_.table, {});
  find<QPushButton>(*page, "diagnose")->click();
  QTest::qWait(50);
  QElapsedTimer timer;
  timer.start();
  page.reset();
  QVERIFY(timer.elapsed() < 500);
  QVERIFY(QThreadPool::globalInstance()->waitForDone(5000));
  QCoreApplication::processEvents();
}

void GapPageTest::realDiagnosisStopsSoon() {
  auto page = std::make_unique<GapPage>(*workbench_);
  page->setRecording(room_.table, [this] { return room_.samples; });
  find<QPushButton>(*page, "diagnose")->click();
  QTest::qWait(300);
  page.reset();
  QVERIFY(QThreadPool::globalInstance()->waitForDone(5000));
}

void GapPageTest::positionOnlyIsDiagnosed() {
  CalibrationTable table = room_.table;
  for (Node& node : table.nodes) node.has_orientation = false;
  GapPage page(*workbench_);
  page.setRecording(table, {});
  find<QPushButton>(page, "diagnose")->click();
  QTRY_VERIFY_WITH_TIMEOUT(!page.isDiagnosing(), kWaitMs);
  QVERIFY(page.report().has_value());
  QVERIFY(page.report()->input.position_only);
  QCOMPARE(textOf(page, "gapSentence"), QString::fromStdString(page.report()->text));
}

void GapPageTest::windowFindsTheMetal() {
  MainWindow window;
  GapPage* page = openedAtGap(window);
  QVERIFY(page && page->isVisible());
  page->setRecording(room_.table, [this] { return room_.samples; });
  QTest::mouseClick(find<QWidget>(*page, "diagnose"), Qt::LeftButton);
  QVERIFY(page->isDiagnosing());
  QTRY_VERIFY_WITH_TIMEOUT(!page->isDiagnosing(), kWaitMs);
  QVERIFY(page->report().has_value());
  const ErrorField& field = find<FieldView>(*page, "gapField")->field();
  QCOMPARE(field.arrows.size(), page->report()->nodes.size());
  // The rig puts places at whole multiples of 0.2 m; so they are drawn.
  for (const FieldArrow& arrow : field.arrows)
    for (int axis = 0; axis < 3; ++axis)
      FT_VERIFY_MATCH(near(arrow.from_m[axis], 0.2 * std::round(arrow.from_m[axis] / 0.2), 1e-9));
  QVERIFY(standsAtTheMetal(field));
  const QString folder = qEnvironmentVariable("FIELDTRUE_ARTEFACTS");
  if (folder.isEmpty()) return;
  QVERIFY(QDir().mkpath(folder));
  QTest::qWait(400);
  QVERIFY(window.grab().save(folder + QStringLiteral("/6-gap.png")));
  QVERIFY(find<QScrollArea>(*page, "inspector")->widget()->grab().save(folder + QStringLiteral("/6-gap-charts.png")));
  find<QCheckBox>(*page, "showAfter")->setChecked(true);
  QTest::qWait(400);
  QVERIFY(window.grab().save(folder + QStringLiteral("/6-gap-after.png")));
}

/// The known room held against itself before the metal came, at other places: that is what changed.
void GapPageTest::windowTellsWhatCame() {
  MainWindow window;
  GapPage* page = openedAtGap(window);
  QVERIFY(page && page->isVisible());
  page->setRecording(room_.table, {});
  const QString path = folder_.filePath("before.nodes.csv");
  QVERIFY(writeNodeTable(path.toStdString(), room_.before).has_value());
  page->diagnoseSince(path);
  QTRY_VERIFY_WITH_TIMEOUT(page->report().has_value() && !page->isDiagnosing(), kWaitMs);
  QVERIFY(page->report()->against && page->report()->against->changed);
  QCOMPARE(QString::fromStdString(page->report()->against->effect), QStringLiteral("compact_metal"));
  QVERIFY(standsAtTheMetal(find<FieldView>(*page, "gapField")->field()));
  const QString folder = qEnvironmentVariable("FIELDTRUE_ARTEFACTS");
  if (folder.isEmpty()) return;
  QVERIFY(QDir().mkpath(folder));
  QTest::qWait(400);
  QVERIFY(window.grab().save(folder + QStringLiteral("/6-gap-since.png")));
}

/// 192 places: the body is named and drawn by 60 of them, beside every place of these.
void GapPageTest::windowTellsAProvisionalAnswer() {
  MainWindow window;
  GapPage* page = openedAtGap(window);
  QVERIFY(page && page->isVisible());
  page->setRecording(recordedIn(steelScene(), gapPlan({.counts = {8, 6, 4}}), 8), {});
  QTest::mouseClick(find<QWidget>(*page, "diagnose"), Qt::LeftButton);
  QTRY_VERIFY_WITH_TIMEOUT(page->shown().has_value(), kWaitMs);
  QVERIFY(page->isDiagnosing() && !page->report());
  QVERIFY2(textOf(*page, "headline").contains("Compact metal body"), qPrintable(textOf(*page, "headline")));
  const ErrorField& field = find<FieldView>(*page, "gapField")->field();
  QCOMPARE(field.arrows.size(), std::size_t{60});
  QVERIFY(standsAtTheMetal(field));
  const QString folder = qEnvironmentVariable("FIELDTRUE_ARTEFACTS");
  if (!folder.isEmpty()) {
    QVERIFY(QDir().mkpath(folder));
    QTest::qWait(100);
    QVERIFY(window.grab().save(folder + QStringLiteral("/6-gap-provisional.png")));
  }
  QTRY_VERIFY_WITH_TIMEOUT(page->report().has_value(), kWaitMs);
  QCOMPARE(page->report()->input.places, 192);
  QCOMPARE(find<FieldView>(*page, "gapField")->field().arrows.size(), std::size_t{192});
}

/// A field that no physics makes: what would fit it best is told, and why it is not named.
void GapPageTest::windowTellsWhyACauseIsRefused() {
  CalibrationTable table = recordedIn(gapScene(), gapPlan({.counts = {5, 5, 4}}), 8);
  for (Node& node : table.nodes) {
    Eigen::Vector3d& p_m = node.tracker_from_sensor.position_m;
    p_m += 0.006 * Eigen::Vector3d(std::sin(6.0 * p_m.y()), std::sin(6.0 * p_m.z()), std::sin(6.0 * p_m.x()));
  }
  MainWindow window;
  GapPage* page = openedAtGap(window);
  QVERIFY(page && page->isVisible());
  page->setRecording(table, {});
  QTest::mouseClick(find<QWidget>(*page, "diagnose"), Qt::LeftButton);
  QTRY_VERIFY_WITH_TIMEOUT(page->report().has_value() && !page->isDiagnosing(), kWaitMs);
  QCOMPARE(textOf(*page, "headline"), QStringLiteral("Not explained by any known effect"));
  QVERIFY(page->report()->selected.empty() && !page->report()->rival.refused.empty());
  const QString text = textOf(*page, "gapSentence");
  for (const std::string& refused : page->report()->rival.refused)
    QVERIFY2(text.contains(QString::fromStdString(effectLabel(refused))), qPrintable(text));
  QVERIFY2(text.contains("would fit, but"), qPrintable(text));
  const QString folder = qEnvironmentVariable("FIELDTRUE_ARTEFACTS");
  if (folder.isEmpty()) return;
  QVERIFY(QDir().mkpath(folder));
  QTest::qWait(400);
  QVERIFY(window.grab().save(folder + QStringLiteral("/6-gap-refused.png")));
}

FIELDTRUE_WINDOW_TEST(GapPageTest)
#include "gap_page_test.moc"
