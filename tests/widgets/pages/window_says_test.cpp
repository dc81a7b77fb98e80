// What the window says and offers, by keys and clicks on the real one: the rail's keys, what may be fitted and
// exported, what a comparison is called before it is finished, the plan's pitch, and one name for each thing.

#include <QApplication>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QFile>
#include <QFileInfo>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QPushButton>
#include <QRegularExpression>
#include <QSpinBox>
#include <QTabWidget>
#include <QTableView>
#include <QTemporaryDir>
#include <QTest>
#include <QToolButton>
#include <algorithm>
#include <functional>
#include <memory>

#include "acquisition/session/session_store.h"
#include "calib/calibration/alignment.h"
#include "calib/correctors/registry.h"
#include "calib/exporters/exporter.h"
#include "calib/exporters/registry.h"
#include "calib/tables/table_io.h"
#include "tests/widgets/pages/window_driver.h"
#include "tests/widgets/session_fixture.h"
#include "widgets/report/report.h"
#include "widgets/shell/main_window.h"
#include "widgets/style/theme.h"

namespace fieldtrue::widgets {
using testing::kWaitMs;

namespace {

constexpr double kPitch_m = 0.2;

/// Where the tracker says that a place is, from where it is.
using Bend = std::function<Eigen::Vector3d(const Eigen::Vector3d&)>;

/// Along y it measures half as much again: an error that an affine map takes away.
Eigen::Vector3d stretched(const Eigen::Vector3d& p_true_m) { return {p_true_m.x(), 1.5 * p_true_m.y(), p_true_m.z()}; }

acquisition::Plan gridOf(int n) {
  acquisition::Plan plan;
  plan.counts = {n, n, n};
  plan.pitch_m = Eigen::Vector3d::Constant(kPitch_m);
  plan.origin_m = Eigen::Vector3d(0.4, -0.5 * (n - 1) * kPitch_m, -0.5 * (n - 1) * kPitch_m);
  return plan;
}

/// Ten readings at a pose, a tenth of a millimetre to and fro.
std::vector<Sample> readingsAt(const Eigen::Vector3d& p_tracked_m, double start_s) {
  std::vector<Sample> samples;
  for (int i = 0; i < 10; ++i) {
    Sample sample;
    sample.time_s = start_s + 0.01 * i;
    sample.tracker_from_sensor.position_m = p_tracked_m + Eigen::Vector3d::Constant((i % 2 == 0 ? 1 : -1) * 1e-4);
    samples.push_back(sample);
  }
  return samples;
}

}  // namespace

class WindowSaysTest : public testing::WindowDriver {
  Q_OBJECT

 private slots:
  void initTestCase();
  void init();
  void cleanup() { window_.reset(); }
  void everyStepHasItsKey();
  void aZeroPitchIsAnsweredAtTheField();
  void whatOrientationsWillTellIsSaid();
  void numbersAreTakenWithPointOrComma();
  void aSessionShowsItsOwnPlan();
  void theSimulatedTrackerHasOneName();
  void nothingIsFittedBeforeResultsStand();
  void whatCannotBeUsedCannotBeFitted();
  void aComparisonOnItsWayIsNoVerdict();
  void aFoldIsInTheHeadline();
  void aWorstPlaceNoBetterIsInTheHeadline();
  void aCalibrationThatCorrectsNothingIsNotOffered();
  void nothingIsReplacedUnasked();
  void tablesAreWrittenWithoutACalibration();
  void mirroredReadingsAreNotToBeCorrected();
  void methodsHaveOneName();

 private:
  QString text(const char* name) { return find<QLabel>(name)->text(); }
  /// Of the compare page; the gap page has a headline too.
  QString compareText(const char* name) {
    return find<QWidget>("page_compare")->findChild<QLabel*>(QString::fromLatin1(name))->text();
  }
  /// Leaves a picture of the window where FIELDTRUE_ARTEFACTS asks for it.
  void picture(const char* name) {
    if (!qEnvironmentVariableIsSet("FIELDTRUE_ARTEFACTS")) return;
    QTest::qWait(400);
    window_->grab().save(QStringLiteral("%1/says-%2.png").arg(qEnvironmentVariable("FIELDTRUE_ARTEFACTS")).arg(name));
  }
  QString verdictState() {
    return find<QWidget>("page_compare")->findChild<QWidget*>("verdictBar")->property("state").toString();
  }
  Workbench& workbench() { return window_->workbench(); }
  /// Types into a field as a person does: all of it replaced.
  void type(const char* name, const QString& typed) {
    auto* field = find<QWidget>(name);
    field->setFocus();
    QTest::keyClick(field, Qt::Key_A, Qt::ControlModifier);
    QTest::keyClicks(field, typed);
  }
  QString makeSession(const QString& name, const acquisition::Plan& plan, const Bend& bend, const QString& fit = {});
  void open(const QString& path);
  bool finished() {
    return QTest::qWaitFor([this] { return workbench().comparisonIsFinal(); }, kWaitMs);
  }
  void chooseRow(const char* table, const std::function<bool(const QAbstractItemModel&, int)>& wanted);
};

void WindowSaysTest::initTestCase() {
  QVERIFY(folder_.isValid());
  testing::keepIn(folder_);
  applyTheme(*qApp, qEnvironmentVariableIsSet("FIELDTRUE_DARK"));
}

void WindowSaysTest::init() {
  window_ = std::make_unique<MainWindow>();
  window_->resize(1280, 800);
  window_->show();
  window_->activateWindow();
  QVERIFY(QTest::qWaitForWindowExposed(window_.get()));
  QVERIFY(QTest::qWaitForWindowActive(window_.get()));
}

QString WindowSaysTest::makeSession(const QString& name, const acquisition::Plan& plan, const Bend& bend,
                                    const QString& fit) {
  const QString path = folder_.filePath(name + QStringLiteral(".fieldtrue"));
  auto store = acquisition::SessionStore::create(path, plan, TableMetadata{});
  if (!store) qFatal("%s", store.error().message.c_str());
  for (std::size_t place = 0; place < store->places().size(); ++place) {
    const Eigen::Vector3d p_true_m = store->places()[place].reference_from_sensor.position_m;
    const auto samples = readingsAt(bend(p_true_m), static_cast<double>(place));
    const auto stored = store->storeTake(place, {{samples, averageSamples(samples).value()}}, "");
    if (!stored) qFatal("%s", stored.error().message.c_str());
  }
  if (!fit.isEmpty() && !store->storeFit("kept", fit.toStdString())) qFatal("the fit was not stored");
  return path;
}

void WindowSaysTest::open(const QString& path) {
  workbench().openSession(path);
  QVERIFY(QTest::qWaitFor([this] { return !workbench().table().nodes.empty(); }, kWaitMs));
}

void WindowSaysTest::chooseRow(const char* name, const std::function<bool(const QAbstractItemModel&, int)>& wanted) {
  auto* table = find<QTableView>(name);
  const QAbstractItemModel& model = *table->model();
  int row = 0;
  while (row < model.rowCount() && !wanted(model, row)) ++row;
  QVERIFY2(row < model.rowCount(), name);
  const QModelIndex index = model.index(row, 1);
  table->scrollTo(index);
  QTest::mouseClick(table->viewport(), Qt::LeftButton, {}, table->visualRect(index).center());
  QCOMPARE(table->currentIndex().row(), row);
}

void WindowSaysTest::everyStepHasItsKey() {
  const char* steps[] = {"start", "connect", "signal", "plan", "acquire", "compare", "gap", "export"};
  for (int number = 7; number >= 0; --number) {
    const QString step = QString::fromLatin1(steps[number]);
    QTest::keyClick(window_.get(), static_cast<Qt::Key>(Qt::Key_0 + number), Qt::AltModifier);
    QTRY_VERIFY2(onPage(QStringLiteral("page_") + step), qPrintable(step));  // A key presses the button for a moment.
    const auto* button = find<QToolButton>(qPrintable(QStringLiteral("step_") + step));
    QVERIFY(button->isChecked());
    QVERIFY2(button->toolTip().contains(QStringLiteral("Alt+%1").arg(number)), qPrintable(button->toolTip()));
  }
}

void WindowSaysTest::whatOrientationsWillTellIsSaid() {
  click("step_plan");
  auto* summary = find<QLabel>("planSummary");
  QVERIFY2(summary->text().contains(QStringLiteral("One orientation: a correction holds")),
           qPrintable(summary->text()));
  type("orientations", QStringLiteral("12"));
  QTest::keyClick(find<QWidget>("orientations"), Qt::Key_Tab);
  // The covering radius of the tetrahedron's rotations is 90 degrees.
  const QRegularExpressionMatch far =
      QRegularExpression(QStringLiteral("at most about (\\d+) degrees")).match(summary->text());
  QVERIFY2(far.hasMatch() && far.captured(1).toInt() >= 86 && far.captured(1).toInt() <= 90,
           qPrintable(summary->text()));
  picture("orientations");
}

void WindowSaysTest::aZeroPitchIsAnsweredAtTheField() {
  click("step_plan");
  auto* problem = find<QLabel>("planProblem");
  QVERIFY(!problem->isVisible());
  for (const char* field : {"pitch_x", "pitch_y", "pitch_z"}) {
    type(field, QStringLiteral("0"));
    QTest::keyClick(find<QWidget>(field), Qt::Key_Tab);
    QCOMPARE(find<QDoubleSpinBox>(field)->value(), 0.0);
    QVERIFY(problem->isVisible());
    QVERIFY2(problem->text().contains(QStringLiteral("pitch along %1 is 0").arg(QLatin1String(field).back())),
             qPrintable(problem->text()));
    QVERIFY(!find<QPushButton>("createSession")->isEnabled());
    picture("pitch");
    click("createSession");
    QTest::qWait(300);
    QVERIFY(!workbench().sessionIsOpen());
    type(field, QStringLiteral("0.25"));
    QVERIFY(!problem->isVisible());
    QVERIFY(find<QPushButton>("createSession")->isEnabled());
  }
}

void WindowSaysTest::numbersAreTakenWithPointOrComma() {
  click("step_plan");
  auto* pitch = find<QDoubleSpinBox>("pitch_x");
  for (const auto& [typed, expected] : {std::pair("0,25", 0.25), {"1.5", 1.5}, {",3048", 0.3048}, {"5e-2", 0.05}}) {
    type("pitch_x", QString::fromLatin1(typed));
    QTest::keyClick(pitch, Qt::Key_Tab);
    QVERIFY2(std::abs(pitch->value() - expected) < 1e-12, typed);
    QVERIFY2(!pitch->text().contains(QLatin1Char(',')), qPrintable(pitch->text()));
  }
  // What is no number is not made one by leaving a mark out.
  auto* count = find<QSpinBox>("count_x");
  type("count_x", QStringLiteral("3,5"));
  QTest::keyClick(count, Qt::Key_Tab);
  QCOMPARE(count->value(), 3);
  // Nor is a number that is too large the part of it that fits.
  for (const auto& [typed, expected] : {std::pair("1000", count->maximum()), {"0", count->minimum()}, {"7", 7}}) {
    type("count_x", QString::fromLatin1(typed));
    QTest::keyClick(count, Qt::Key_Tab);
    QCOMPARE(count->value(), expected);
  }
  // A room of 30 m is no pitch of a grid.
  type("pitch_x", QStringLiteral("25"));
  QVERIFY2(text("planProblem").contains(QStringLiteral("no tracker reaches farther than 30 m")),
           qPrintable(text("planProblem")));
  QVERIFY(!find<QPushButton>("createSession")->isEnabled());
}

void WindowSaysTest::aSessionShowsItsOwnPlan() {
  acquisition::Plan plan;
  plan.counts = {2, 3, 6};
  plan.pitch_m = {0.25, 0.35, 0.45};
  plan.origin_m = Eigen::Vector3d(0.5, -0.1, -1.0);
  plan.order = acquisition::PlanOrder::kRandom;
  plan.seed = 17;
  plan.reseat = 2;
  plan.pipe_base_m = -1.5;
  open(makeSession(QStringLiteral("own_plan"), plan, stretched));
  click("step_plan");
  const int counts[] = {2, 3, 6};
  const double pitches_m[] = {0.25, 0.35, 0.45};
  for (int axis = 0; axis < 3; ++axis) {
    const QChar letter = QLatin1String("xyz")[axis];
    QCOMPARE(find<QSpinBox>(qPrintable(QStringLiteral("count_") + letter))->value(), counts[axis]);
    QCOMPARE(find<QDoubleSpinBox>(qPrintable(QStringLiteral("pitch_") + letter))->value(), pitches_m[axis]);
  }
  // Started anew it is the same plan.
  const QString first = workbench().sessionPath();
  click("createSession");
  QTRY_VERIFY_WITH_TIMEOUT(workbench().sessionPath() != first, kWaitMs);
  QCOMPARE(toJson(workbench().plan()).dump(), toJson(plan).dump());
}

void WindowSaysTest::theSimulatedTrackerHasOneName() {
  click("step_connect");
  type("setting_speed", QStringLiteral("20"));
  QTest::keyClick(find<QWidget>("setting_speed"), Qt::Key_Tab);
  click("connectButton");
  QTRY_COMPARE_WITH_TIMEOUT(workbench().status().device, acquisition::DeviceState::kRunning, kWaitMs);
  QTest::qWait(200);
  bool told = false;
  for (const QLabel* label : window_->findChildren<QLabel*>()) {
    QVERIFY2(!label->text().contains(QStringLiteral("Fastrak")), qPrintable(label->text()));
    told = told || label->text().startsWith(QStringLiteral("Simulated tracker, station 1 at"));
  }
  QVERIFY(told);
  picture("simulated");
  click("step_plan");
  click("createSession");
  QTRY_VERIFY_WITH_TIMEOUT(workbench().status().current && workbench().status().still, kWaitMs);
  QTest::keyClick(window_.get(), Qt::Key_Space);
  QTRY_VERIFY_WITH_TIMEOUT(!workbench().table().nodes.empty(), kWaitMs);
  const TableMetadata metadata = workbench().table().metadata;
  QVERIFY2(metadata.tracker.value_or("").starts_with("simulated tracker in "), metadata.tracker.value_or("").c_str());
  ReportInput input;
  input.table.metadata = metadata;
  const QString report = QString::fromStdString(htmlReport(input));
  QVERIFY(report.contains(QStringLiteral("simulated tracker in ")));
  QVERIFY(!report.contains(QStringLiteral("fastrak"), Qt::CaseInsensitive));
}

void WindowSaysTest::nothingIsFittedBeforeResultsStand() {
  open(makeSession(QStringLiteral("fit"), gridOf(3), stretched));
  click("step_compare");
  auto* fit = find<QPushButton>("fit");
  QVERIFY(workbench().isComparing());
  QVERIFY(!fit->isEnabled());
  click("fit");
  QVERIFY(finished());
  QVERIFY(!workbench().isFitting() && !workbench().corrector());
  picture("final");
  QVERIFY(fit->isEnabled());
  QCOMPARE(verdictState(), QStringLiteral("apply"));

  // Nothing chosen for either part: nothing to fit, and it is said.
  find<QTabWidget>("inspectorTabs")->setCurrentIndex(2);
  chooseRow("orientationTable", [](const QAbstractItemModel& model, int row) {
    return model.index(row, 0).data().toString() == QStringLiteral("Before");
  });
  find<QTabWidget>("inspectorTabs")->setCurrentIndex(1);
  chooseRow("positionTable", [](const QAbstractItemModel& model, int row) {
    return model.index(row, 0).data().toString() == QStringLiteral("Before");
  });
  QVERIFY(!fit->isEnabled());
  QVERIFY2(text("fitted").contains(QStringLiteral("nothing to fit")), qPrintable(text("fitted")));
  picture("nothing-to-fit");

  // With the best chosen again, Export offers what was fitted, by its name.
  chooseRow("positionTable", [](const QAbstractItemModel& model, int row) {
    return model.index(row, 0).data().toString() == QStringLiteral("Affine");
  });
  QVERIFY(fit->isEnabled());
  click("fit");
  QTRY_VERIFY_WITH_TIMEOUT(workbench().corrector().has_value(), kWaitMs);
  QTRY_VERIFY_WITH_TIMEOUT(text("fitted").contains(QStringLiteral("Kept in the session, ready to export")), kWaitMs);
  click("step_export");
  QVERIFY2(text("calibrationSummary").startsWith(QStringLiteral("Calibration: Affine for position")),
           qPrintable(text("calibrationSummary")));
}

void WindowSaysTest::whatCannotBeUsedCannotBeFitted() {
  acquisition::Plan plan = gridOf(2);
  plan.counts = {3, 2, 1};
  open(makeSession(QStringLiteral("few"), plan, stretched));
  click("step_compare");
  QVERIFY(finished());
  find<QTabWidget>("inspectorTabs")->setCurrentIndex(1);
  chooseRow("positionTable", [](const QAbstractItemModel& model, int row) {
    return model.index(row, 1).data().toString() == QStringLiteral("cannot");
  });
  QVERIFY(!find<QPushButton>("fit")->isEnabled());
  QVERIFY2(text("fitted").contains(QStringLiteral("Cannot be used here")), qPrintable(text("fitted")));
  picture("cannot");
  // One that was never tried cannot either.
  chooseRow("positionTable",
            [](const QAbstractItemModel& model, int row) { return model.index(row, 1).data().toString().isEmpty(); });
  QVERIFY(!find<QPushButton>("fit")->isEnabled());
  QVERIFY2(text("fitted").contains(QStringLiteral("Not compared yet")), qPrintable(text("fitted")));
}

void WindowSaysTest::aComparisonOnItsWayIsNoVerdict() {
  open(makeSession(QStringLiteral("on_its_way"), gridOf(4), stretched));
  click("step_compare");
  QVERIFY(finished());
  auto* tabs = find<QTabWidget>("inspectorTabs");
  tabs->setCurrentIndex(1);
  click("positionAll");
  tabs->setCurrentIndex(2);
  click("orientationAll");
  auto* validation = find<QComboBox>("validation");
  validation->setFocus();
  QTest::keyClick(validation, Qt::Key_Down);  // Another way to judge: the quick methods first, then the slow ones.
  QVERIFY2(compareText("headline").startsWith(QStringLiteral("Comparing again")), qPrintable(compareText("headline")));
  QVERIFY(verdictState().isEmpty());
  const auto partial = [this] { return workbench().comparedMethods().done < workbench().comparedMethods().wanted; };
  QTRY_VERIFY_WITH_TIMEOUT(partial(), kWaitMs);
  QVERIFY(workbench().isComparing());
  const Workbench::MethodCount count = workbench().comparedMethods();
  const QString counted = QStringLiteral("%1 of %2 methods").arg(count.done).arg(count.wanted);
  QVERIFY2(compareText("headline").startsWith(QStringLiteral("So far, ") + counted),
           qPrintable(compareText("headline")));
  picture("so-far");
  QVERIFY(verdictState().isEmpty());
  QVERIFY(!find<QPushButton>("fit")->isEnabled());

  click("runComparison");  // Now it reads Stop.
  QVERIFY(!workbench().isComparing());
  QVERIFY2(compareText("headline").startsWith(QStringLiteral("Stopped after ") + counted),
           qPrintable(compareText("headline")));
  picture("stopped");
  QVERIFY(verdictState().isEmpty());
  QVERIFY(!compareText("verdict").startsWith(QStringLiteral("Apply")));
  QVERIFY(find<QPushButton>("fit")->isEnabled());  // What was tried stands.

  click("orientationQuick");
  tabs->setCurrentIndex(1);
  click("positionQuick");
  click("runComparison");
  QVERIFY(verdictState().isEmpty());
  QVERIFY2(compareText("headline").startsWith(QStringLiteral("So far")), qPrintable(compareText("headline")));
  QVERIFY(finished());
  QVERIFY2(compareText("headline").startsWith(QStringLiteral("Apply it:")), qPrintable(compareText("headline")));
  QCOMPARE(verdictState(), QStringLiteral("apply"));
}

void WindowSaysTest::aFoldIsInTheHeadline() {
  // One corner reads nearer than the place before it.
  const auto folded = [](const Eigen::Vector3d& p_true_m) {
    Eigen::Vector3d p_tracked_m = stretched(p_true_m);
    if (p_true_m.x() > 0.4 + 2.5 * kPitch_m && p_true_m.z() < -kPitch_m && p_true_m.y() < -kPitch_m)
      p_tracked_m.x() -= 1.2 * kPitch_m;
    return p_tracked_m;
  };
  open(makeSession(QStringLiteral("folded"), gridOf(4), folded));
  click("step_compare");
  QVERIFY(finished());
  QVERIFY2(workbench().comparison()->verdict.apply_position, workbench().comparison()->verdict.text.c_str());
  QVERIFY(workbench().comparison()->fold_back->n_folded > 0);
  QVERIFY2(compareText("headline").contains(QStringLiteral("the field folds back")),
           qPrintable(compareText("headline")));
  picture("fold");
  QCOMPARE(verdictState(), QStringLiteral("care"));
}

void WindowSaysTest::aWorstPlaceNoBetterIsInTheHeadline() {
  // The stretch is off by 150 mm at y = 0.3 m. One place there jumps back by 300 mm: 150 mm off the other way as
  // tracked, but 300 / 1.5 = 200 mm off once the stretch is taken away.
  const auto jumping = [](const Eigen::Vector3d& p_true_m) {
    Eigen::Vector3d p_tracked_m = stretched(p_true_m);
    if ((p_true_m - Eigen::Vector3d(0.6, 0.3, 0.1)).norm() < 0.01) p_tracked_m.y() -= 0.3;
    return p_tracked_m;
  };
  open(makeSession(QStringLiteral("jumping"), gridOf(4), jumping));
  click("step_compare");
  QVERIFY(finished());
  const evaluation::Comparison& comparison = *workbench().comparison();
  QVERIFY(comparison.verdict.apply_position);
  QVERIFY(comparison.position[*comparison.best_position_row].stats.max >= comparison.before_position_mm.max);
  QVERIFY2(compareText("headline").contains(QStringLiteral("the worst place is no better")),
           qPrintable(compareText("headline")));
  picture("worst");
  QCOMPARE(verdictState(), QStringLiteral("care"));
}

void WindowSaysTest::aCalibrationThatCorrectsNothingIsNotOffered() {
  const QString source = makeSession(QStringLiteral("source"), gridOf(3), stretched);
  const CalibrationTable table = acquisition::SessionStore::open(source)->nodeTable().value();
  const auto nothing = calibration::Corrector::fit(table.nodes, table.metadata, calibration::CorrectorChoice{},
                                                   calibration::AlignMode::kRigid);
  QVERIFY(nothing.has_value());
  open(makeSession(QStringLiteral("nothing"), gridOf(3), stretched, QString::fromStdString(nothing->toText())));
  QTRY_VERIFY_WITH_TIMEOUT(workbench().corrector().has_value(), kWaitMs);
  click("step_compare");
  QVERIFY(finished());
  QVERIFY(compareText("headline").startsWith(QStringLiteral("Apply it")));
  click("step_export");
  QVERIFY2(text("calibrationSummary").contains(QStringLiteral("corrects nothing")),
           qPrintable(text("calibrationSummary")));
  auto* list = find<QListWidget>("exportList");
  for (const exporters::Exporter& exporter : exporters::exporters()) {
    const auto items = list->findItems(QString::fromStdString(exporter.extension), Qt::MatchContains);
    QVERIFY(!items.isEmpty());
    QVERIFY2(!(items.front()->flags() & Qt::ItemIsEnabled), exporter.id.c_str());
    QTest::mouseClick(list->viewport(), Qt::LeftButton, {}, list->visualItemRect(items.front()).center());
    QVERIFY(list->currentItem() != items.front());
  }
  QVERIFY(list->currentItem()->text().contains(QStringLiteral(".nodes.csv")));
  picture("export-nothing");
}

void WindowSaysTest::nothingIsReplacedUnasked() {
  const QString session = makeSession(QStringLiteral("kept"), gridOf(3), stretched);
  const CalibrationTable table = acquisition::SessionStore::open(session)->nodeTable().value();
  calibration::CorrectorChoice choice;
  choice.position_id = "affine";
  const auto fitted = calibration::Corrector::fit(table.nodes, table.metadata, choice, calibration::AlignMode::kRigid);
  QVERIFY(fitted.has_value());
  open(makeSession(QStringLiteral("replaced"), gridOf(3), stretched, QString::fromStdString(fitted->toText())));
  QTRY_VERIFY_WITH_TIMEOUT(workbench().corrector().has_value(), kWaitMs);
  click("step_export");
  const QString path = folder_.filePath(QStringLiteral("theirs.ftcal.json"));
  const auto content = [](const QString& name) {
    QFile file(name);
    return file.open(QIODevice::ReadOnly) ? file.readAll() : QByteArray();
  };
  const auto isSaid = [&](const char* words) {
    const auto labels = find<QWidget>("messageLine")->findChildren<QLabel*>();
    return std::any_of(labels.begin(), labels.end(),
                       [&](const QLabel* label) { return label->text().contains(QLatin1String(words)); });
  };
  const auto doAsOffered = [&] {
    QTest::mouseClick(find<QWidget>("messageLine")->findChild<QPushButton*>(), Qt::LeftButton);
  };
  QFile theirs(path);
  QVERIFY(theirs.open(QIODevice::WriteOnly) && theirs.write("theirs") == 6);
  theirs.close();
  type("exportPath", path);
  click("exportWrite");
  QTRY_VERIFY_WITH_TIMEOUT(isSaid("theirs.ftcal.json exists already"), kWaitMs);
  QCOMPARE(content(path), QByteArray("theirs"));
  doAsOffered();
  QTRY_VERIFY_WITH_TIMEOUT(content(path).startsWith("{"), kWaitMs);
  QTRY_VERIFY_WITH_TIMEOUT(find<QPushButton>("exportWrite")->isEnabled(), kWaitMs);
  // A session least of all, whoever asks.
  const QByteArray before = content(session);
  type("exportPath", session);
  click("exportWrite");
  QTRY_VERIFY_WITH_TIMEOUT(isSaid("kept.fieldtrue exists already"), kWaitMs);
  doAsOffered();
  QTRY_VERIFY_WITH_TIMEOUT(isSaid("it is a session"), kWaitMs);
  QCOMPARE(content(session), before);
}

void WindowSaysTest::tablesAreWrittenWithoutACalibration() {
  const QString session = makeSession(QStringLiteral("bare"), gridOf(3), stretched);
  open(session);
  click("step_export");
  QTRY_VERIFY_WITH_TIMEOUT(find<QListWidget>("exportList")->isVisible(), kWaitMs);
  QVERIFY2(text("calibrationSummary").contains(QStringLiteral("no calibration yet")),
           qPrintable(text("calibrationSummary")));
  auto* list = find<QListWidget>("exportList");
  QVERIFY(list->currentItem()->text().contains(QStringLiteral(".nodes.csv")));
  const QString path = folder_.filePath(QStringLiteral("bare.nodes.csv"));
  type("exportPath", path);
  click("exportWrite");
  QTRY_VERIFY_WITH_TIMEOUT(QFileInfo::exists(path), kWaitMs);
  QTRY_VERIFY_WITH_TIMEOUT(find<QPushButton>("exportWrite")->isEnabled(), kWaitMs);
  const auto reading = readNodeTable(path.toStdString());
  QVERIFY(reading.has_value());
  QCOMPARE(reading->table.nodes.size(), std::size_t{27});
  picture("export-tables");
}

void WindowSaysTest::mirroredReadingsAreNotToBeCorrected() {
  const auto mirrored = [](const Eigen::Vector3d& p_true_m) {
    return Eigen::Vector3d(p_true_m.x(), 1.02 * p_true_m.y(), -p_true_m.z());
  };
  open(makeSession(QStringLiteral("mirrored"), gridOf(3), mirrored));
  click("step_compare");
  QVERIFY(finished());
  QVERIFY2(compareText("headline").contains(QStringLiteral("axes or places of the readings are wrong")),
           qPrintable(compareText("headline")));
  QCOMPARE(verdictState(), QStringLiteral("leave"));
  QVERIFY2(compareText("verdict").contains(QStringLiteral("mirror image")), qPrintable(compareText("verdict")));
  picture("mirrored");
}

void WindowSaysTest::methodsHaveOneName() {
  open(makeSession(QStringLiteral("names"), gridOf(3), stretched));
  click("step_compare");
  QVERIFY(finished());
  ReportInput input;
  input.table = workbench().table();
  input.comparison = *workbench().comparison();
  const QString report = QString::fromStdString(htmlReport(input));
  for (const evaluation::MethodScore& score : input.comparison.position) {
    const auto row = correctors::findPositionMethod(score.method);
    QVERIFY(row.has_value());
    const QString label = QString::fromStdString((*row)->label);
    QVERIFY2(report.contains(label.toHtmlEscaped()), qPrintable(label));
    if (score.method.find('_') != std::string::npos)
      QVERIFY2(!report.contains(score.method.c_str()), score.method.c_str());
    if (score.method == "none") continue;
    bool listed = false;
    const QAbstractItemModel& model = *find<QTableView>("positionTable")->model();
    for (int at = 0; at < model.rowCount(); ++at)
      listed = listed || model.index(at, 0).data().toString().startsWith(label);
    QVERIFY2(listed, qPrintable(label));
  }
  const QString best = QString::fromStdString((*correctors::findPositionMethod(input.comparison.best_position))->label);
  QVERIFY2(compareText("verdict").startsWith(QStringLiteral("Apply %1").arg(best)), qPrintable(compareText("verdict")));
}

}  // namespace fieldtrue::widgets

FIELDTRUE_WINDOW_TEST(fieldtrue::widgets::WindowSaysTest)
#include "window_says_test.moc"
