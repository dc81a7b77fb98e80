#include <QLabel>
#include <QPushButton>
#include <QTemporaryDir>
#include <QTest>
#include <QThreadPool>
#include <atomic>
#include <thread>

#include "calib/tables/table_writer.h"
#include "tests/support/matchers.h"
#include "tests/widgets/gap_fixture.h"
#include "tests/widgets/pages/window_driver.h"
#include "tests/widgets/session_fixture.h"
#include "tests/widgets/window_test.h"
#include "widgets/pages/gap_page.h"
#include "widgets/style/theme.h"

using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

/// What the page says that a report is held against is true of the report it shows.
class GapHeldAgainstTest : public QObject {
  Q_OBJECT

 private slots:
  void initTestCase() {
    QVERIFY(folder_.isValid());
    keepIn(folder_);
    applyTheme(*qApp, false);
    room_ = roomWithSteel();
    for (const char* name : {"monday.nodes.csv", "tuesday.nodes.csv"})
      QVERIFY(writeNodeTable(path(name).toStdString(), room_.before).has_value());
    workbench_ = std::make_unique<Workbench>();
  }
  void cleanup() { QThreadPool::globalInstance()->waitForDone(); }

  void aStoppedOneLeavesTheNameOfTheReport() {
    const auto page = diagnosed();
    const QString alone = believed(*page);
    ends_ = End::kNever;
    page->diagnoseSince(path("monday.nodes.csv"));
    QVERIFY(page->isDiagnosing());
    QCOMPARE(believed(*page), alone);
    find<QPushButton>(*page, "diagnose")->click();
    QVERIFY(!page->isDiagnosing() && page->report());
    QCOMPARE(believed(*page), alone);
    ends_ = End::kWell;
    page->diagnoseSince(path("monday.nodes.csv"));
    QTRY_VERIFY_WITH_TIMEOUT(!page->isDiagnosing(), kWaitMs);
    QVERIFY(believed(*page).contains("monday"));
    ends_ = End::kNever;
    page->diagnoseSince(path("tuesday.nodes.csv"));
    find<QPushButton>(*page, "diagnose")->click();
    QVERIFY(page->report() && believed(*page).contains("monday"));
  }

  void afterAnErrorThereIsNone() {
    const auto page = diagnosed();
    const QString alone = believed(*page);
    ends_ = End::kBadly;
    page->diagnoseSince(path("monday.nodes.csv"));
    QTRY_VERIFY_WITH_TIMEOUT(!page->isDiagnosing(), kWaitMs);
    QVERIFY(!page->report());
    QCOMPARE(believed(*page), alone);
  }

 private:
  enum class End { kWell, kBadly, kNever };

  /// A page with a report that is held against no earlier recording.
  std::unique_ptr<GapPage> diagnosed() {
    ends_ = End::kWell;
    auto page = std::make_unique<GapPage>(
        *workbench_,
        [this](const CalibrationTable&, const SampleTable*, const simulation::Scene*, const gap::DiagnosisOptions&,
               const RunControl& control) -> Result<gap::GapReport> {
          while (ends_ == End::kNever && !control.stop.stop_requested())
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
          if (ends_ == End::kWell) return writtenReport();
          return fail(ErrorCode::kTooFewNodes, "Diagnosis needs 12 places, got 3");
        });
    page->setRecording(room_.table, {});
    find<QPushButton>(*page, "diagnose")->click();
    if (!QTest::qWaitFor([&] { return !page->isDiagnosing(); }, kWaitMs)) qFatal("no answer");
    return page;
  }
  static QString believed(GapPage& page) { return find<QLabel>(page, "gapBelieved")->text(); }
  QString path(const char* name) const { return folder_.filePath(QLatin1String(name)); }

  QTemporaryDir folder_;
  KnownRoom room_;
  std::unique_ptr<Workbench> workbench_;
  std::atomic<End> ends_ = End::kWell;
};

FIELDTRUE_WINDOW_TEST(GapHeldAgainstTest)
#include "gap_held_against_test.moc"
