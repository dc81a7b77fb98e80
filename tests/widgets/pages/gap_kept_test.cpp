#include <QLabel>
#include <QPushButton>
#include <QTemporaryDir>
#include <QTest>
#include <QThreadPool>

#include "acquisition/session/imported_session.h"
#include "acquisition/session/session_store.h"
#include "tests/support/matchers.h"
#include "tests/widgets/gap_fixture.h"
#include "tests/widgets/pages/window_driver.h"
#include "tests/widgets/session_fixture.h"
#include "tests/widgets/window_test.h"
#include "widgets/pages/gap_page.h"
#include "widgets/pages/kept_gap.h"
#include "widgets/style/theme.h"

using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

/// A diagnosis outlives the window: report, believed scene and what undo goes back to.
class GapKeptTest : public QObject {
  Q_OBJECT

 private slots:
  void initTestCase() {
    QVERIFY(folder_.isValid());
    keepIn(folder_);
    applyTheme(*qApp, false);
    room_ = roomWithSteel();
    for (const char* name : {"room", "other"})
      QVERIFY(acquisition::makeSession(path(name), room_.table, {}, name).has_value());
  }
  void cleanup() { QThreadPool::globalInstance()->waitForDone(); }

  void opensWhereItWas() {
    {
      Workbench workbench;
      const auto page = opened(workbench, "room");
      press(*page, "diagnose");
      press(*page, "addToSimulation");
    }
    Workbench workbench;
    const auto page = opened(workbench, "room");
    QTRY_VERIFY_WITH_TIMEOUT(page->scene().has_value(), kWaitMs);
    QCOMPARE(page->scene()->effects.size(), std::size_t{1});
    QCOMPARE(page->scene()->effects[0].id, std::string("compact_metal"));
    QVERIFY(page->report().has_value());
    QCOMPARE(page->report()->text, writtenReport().text);
    QVERIFY(find<QLabel>(*page, "gapBelieved")->text().contains("1 effect"));
    auto* undo = find<QPushButton>(*page, "undoAdd");
    QVERIFY(undo->isEnabled());
    undo->click();
    QVERIFY(!page->scene() && !undo->isEnabled());
  }

  void anotherSessionKnowsNothingOfIt() {
    Workbench workbench;
    const auto page = opened(workbench, "other");
    press(*page, "diagnose");
    press(*page, "addToSimulation");
    QVERIFY(page->scene().has_value());
    workbench.openSession(path("room"));
    QTRY_VERIFY_WITH_TIMEOUT(workbench.sessionPath() == path("room") && !workbench.table().nodes.empty(), kWaitMs);
    // Undone there before: neither scene nor report.
    QVERIFY(!page->scene());
    QVERIFY(!find<QPushButton>(*page, "undoAdd")->isEnabled());
  }

  void changedPlacesAreTold() {
    Workbench workbench;
    const auto page = opened(workbench, "room");
    press(*page, "diagnose");
    CalibrationTable fewer = room_.table;
    fewer.nodes.pop_back();
    page->setRecording(fewer, {});
    QVERIFY(!page->report());
    QVERIFY(find<QLabel>(*page, "gapSentence")->text().contains("changed since the last diagnosis"));
  }

  void aReportIsOfItsRows() {
    const KeptGap kept{std::nullopt, {std::nullopt, steelScene()}, writtenReport()};
    const std::string text = toText(kept, room_.table);
    const auto same = readKeptGap(text, room_.table, "room.fieldtrue");
    FT_VERIFY_OK(same);
    QVERIFY(!same->scene);
    QCOMPARE(same->earlier.size(), std::size_t{2});
    QCOMPARE(same->earlier[1].value().effects[0].id, std::string("compact_metal"));
    QCOMPARE(same->report.value().text, writtenReport().text);
    // What is stated of the recording does not count, a row less does.
    CalibrationTable table = room_.table;
    table.metadata.date = "2031-01-01";
    QVERIFY(readKeptGap(text, table, "room.fieldtrue")->report.has_value());
    table.nodes.pop_back();
    const auto fewer = readKeptGap(text, table, "room.fieldtrue");
    FT_VERIFY_OK(fewer);
    QVERIFY(!fewer->report && fewer->earlier.size() == 2);
    for (const char* damaged : {"", "{}", "[1]", "{\"scene\": 3, \"rows\": \"\"}"})
      QVERIFY2(!readKeptGap(damaged, room_.table, "room.fieldtrue"), damaged);
  }

 private:
  QString path(const char* name) const { return folder_.filePath(QString::fromLatin1(name) + ".fieldtrue"); }
  /// A page whose diagnosis answers at once, with a session open.
  std::unique_ptr<GapPage> opened(Workbench& workbench, const char* name) {
    const auto answer = [](const CalibrationTable&, const SampleTable*, const simulation::Scene*,
                           const gap::DiagnosisOptions&,
                           const RunControl&) -> Result<gap::GapReport> { return writtenReport(); };
    auto page = std::make_unique<GapPage>(workbench, answer);
    bool is_told = false;
    const auto told =
        connect(&workbench, &Workbench::tableChanged, page.get(), [&] { is_told = !workbench.table().nodes.empty(); });
    workbench.openSession(path(name));
    [&] { QTRY_VERIFY_WITH_TIMEOUT(is_told, kWaitMs); }();
    disconnect(told);
    return page;
  }

  /// Presses a button that diagnoses, and waits for the report.
  static void press(GapPage& page, const char* button) {
    find<QPushButton>(page, button)->click();
    QTRY_VERIFY_WITH_TIMEOUT(page.report() && !page.isDiagnosing(), kWaitMs);
  }

  QTemporaryDir folder_;
  KnownRoom room_;
};

FIELDTRUE_WINDOW_TEST(GapKeptTest)
#include "gap_kept_test.moc"
