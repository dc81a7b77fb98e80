#include <QApplication>
#include <QComboBox>
#include <QElapsedTimer>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QSignalSpy>
#include <QTemporaryDir>
#include <QTest>
#include <QThreadPool>
#include <algorithm>

#include "acquisition/session/session_store.h"
#include "calib/calibration/alignment.h"
#include "tests/support/matchers.h"
#include "tests/support/silent_port.h"
#include "tests/support/synthetic.h"
#include "tests/widgets/pages/window_driver.h"
#include "tests/widgets/session_fixture.h"
#include "tests/widgets/window_test.h"
#include "widgets/pages/compare_page.h"
#include "widgets/pages/gap_page.h"
#include "widgets/shell/main_window.h"
#include "widgets/style/theme.h"

/// The window stays usable: work that throws or does not fit into memory, a tracker that never answers, its own session
/// opened again.
using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

namespace {

std::unique_ptr<MainWindow> openWindow() {
  auto window = std::make_unique<MainWindow>();
  window->show();
  window->activateWindow();
  if (!QTest::qWaitForWindowExposed(window.get())) qFatal("no window");
  return window;
}

bool isShown(MainWindow& window, const QString& part) {
  const auto labels = window.findChildren<QLabel*>();
  return std::any_of(labels.begin(), labels.end(),
                     [&](const QLabel* label) { return label->isVisible() && label->text().contains(part); });
}

}  // namespace

class WindowSurvivesTest : public QObject {
  Q_OBJECT

  QTemporaryDir folder_;

  /// A session with every place of a bent room taken.
  QString makeSession(const QString& name, std::array<int, 3> counts) {
    const QString path = folder_.filePath(name);
    makeTakenSession(path, counts);
    return path;
  }

 private slots:
  void initTestCase() {
    QVERIFY(folder_.isValid());
    keepIn(folder_);
    applyTheme(*qApp, false);
  }
  void cleanup() {
    qunsetenv("FIELDTRUE_MEMORY_MIB");
    QThreadPool::globalInstance()->waitForDone();
  }

  void closesWhileAConnectionIsBeingOpened() {
    const testing::SilentPort port;
    auto window = openWindow();
    QSignalSpy changes(&window->workbench(), &Workbench::statusChanged);
    window->workbench().connectDevice(QString("fastrak:tcp:127.0.0.1:%1").arg(port.number()), {});
    QTest::qWait(300);
    QElapsedTimer timer;
    timer.start();
    window->close();
    window.reset();
    QVERIFY2(timer.elapsed() < 1000, qPrintable(QString("closing took %1 ms").arg(timer.elapsed())));
  }

  void itsOwnSessionKeepsEverything() {
    const QString path = makeSession("own.fieldtrue", {4, 4, 3});
    auto window = openWindow();
    Workbench& workbench = window->workbench();
    workbench.openSession(path);
    QTRY_COMPARE_WITH_TIMEOUT(workbench.table().nodes.size(), std::size_t{48}, kWaitMs);
    evaluation::ComparisonOptions options;
    options.position_methods = {{"none", {}}, {"affine", {}}};
    options.orientation_methods = {{"none", {}}};
    options.with_surroundings = false;
    workbench.compare(options, {2, 2});
    QTRY_VERIFY_WITH_TIMEOUT(workbench.comparison().has_value() && !workbench.isComparing(), kWaitMs);
    workbench.goToPage(QStringLiteral("start"));
    QTest::qWait(100);
    const QString link = folder_.filePath("link.fieldtrue");
    QVERIFY(QFile::link(path, link));
    for (const QString& given : {path, link}) {
      QSignalSpy sessions(&workbench, &Workbench::sessionChanged);
      QSignalSpy steps(&workbench, &Workbench::pageRequested);
      workbench.openSession(given);
      QTRY_COMPARE_WITH_TIMEOUT(steps.size(), qsizetype{1}, kWaitMs);
      QTest::qWait(100);
      QCOMPARE(sessions.size(), qsizetype{0});
      QVERIFY2(workbench.comparison().has_value(), "the comparison is kept");
      QCOMPARE(workbench.table().nodes.size(), std::size_t{48});
      QVERIFY2(!find<QWidget>(*window, "page_start")->isVisible(), "the window goes to the session");
    }
  }

  void aFitThatDoesNotFitIsTold() {
    const QString path = makeSession("large.fieldtrue", {8, 8, 7});
    auto window = openWindow();
    Workbench& workbench = window->workbench();
    workbench.openSession(path);
    QTRY_COMPARE_WITH_TIMEOUT(workbench.table().nodes.size(), std::size_t{448}, kWaitMs);
    qputenv("FIELDTRUE_MEMORY_MIB", "1");
    workbench.fit(*calibration::parseCorrectorChoice("hmq", "none"), calibration::AlignMode::kRigid);
    QTRY_VERIFY_WITH_TIMEOUT(isShown(*window, "80 % of the 1 MiB"), kWaitMs);
    QVERIFY(!workbench.isFitting() && !workbench.corrector());
    workbench.fit(*calibration::parseCorrectorChoice("affine", "none"), calibration::AlignMode::kRigid);
    QTRY_VERIFY_WITH_TIMEOUT(workbench.corrector().has_value(), kWaitMs);
  }

  void workThatThrowsIsTold() {
    auto window = openWindow();
    int runs = 0;
    GapPage page(window->workbench(), [&runs](auto&&...) -> Result<gap::GapReport> {
      if (++runs == 1) throw std::bad_alloc();
      FT_CHECK(false);
      return fail(ErrorCode::kCancelled, "");
    });
    testing::SyntheticOptions options;
    options.counts = {4, 4, 3};
    page.setRecording(testing::syntheticTable(options), {});
    for (const char* told : {"not enough memory", "internal check failed"}) {
      find<QPushButton>(page, "diagnose")->click();
      QTRY_VERIFY_WITH_TIMEOUT(isShown(*window, told), kWaitMs);
      QVERIFY(!page.isDiagnosing());
    }
  }
};

FIELDTRUE_WINDOW_TEST(WindowSurvivesTest)
#include "window_survives_test.moc"
