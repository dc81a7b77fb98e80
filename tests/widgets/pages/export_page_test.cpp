#include "widgets/pages/export_page.h"

#include <QDoubleSpinBox>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QPushButton>
#include <QTest>
#include <QThreadPool>

#include "acquisition/session/imported_session.h"
#include "acquisition/session/session_store.h"
#include "calib/tables/table_io.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/widgets/pages/window_driver.h"
#include "widgets/style/theme.h"

/// Several files at once: what is ticked, where it goes, what is said, and a stop.
using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

class ExportPageTest : public WindowDriver {
  Q_OBJECT

 private slots:
  void initTestCase() {
    showWindow();
    window_->workbench().openSession(makeFittedSession());
    QTRY_VERIFY_WITH_TIMEOUT(window_->workbench().corrector().has_value(), kWaitMs);
    QTRY_COMPARE_WITH_TIMEOUT(window_->workbench().recordedTable().nodes.size(), table().nodes.size(), kWaitMs);
    click("step_export");
  }

  void cleanupTestCase() { closeWindow(); }

  void severalFilesAreWrittenAtOnce() {
    tick({"(.nrrd)", "(.npz)", "(.nodes.csv)"});
    QCOMPARE(find<QPushButton>("exportWrite")->text(), QStringLiteral("Write 3 files"));
    picture("6-export");
    writeInto("several");
    QCOMPARE(names("several"), QStringList({"lab.nodes.csv", "lab_measured-to-true.npz", "lab_measured-to-true.nrrd"}));
    const auto nodes = readNodeTable(folder_.filePath("several/lab.nodes.csv").toStdString());
    FT_VERIFY_OK(nodes);
    QCOMPARE(nodes->table.nodes.size(), table().nodes.size());
    QVERIFY(isSaid("3 files written"));
  }

  void whatIsThereIsAskedFor() {
    QVERIFY(QFile::remove(folder_.filePath("several/lab_measured-to-true.npz")));
    QFile theirs(folder_.filePath("other/lab.nodes.csv"));
    QVERIFY(QDir().mkpath(folder_.filePath("other")) && theirs.open(QIODevice::WriteOnly) && theirs.write("x") == 1);
    theirs.close();
    type("exportPath", folder_.filePath("other"));
    click("exportWrite");
    QVERIFY(isSaid("exists already"));
    QCOMPARE(names("other"), QStringList({"lab.nodes.csv"}));
    QTest::mouseClick(find<QWidget>("messageLine")->findChild<QPushButton*>(), Qt::LeftButton);
    QTRY_COMPARE_WITH_TIMEOUT(names("other").size(), 3, kWaitMs);
    QTRY_VERIFY_WITH_TIMEOUT(find<QPushButton>("exportWrite")->isEnabled(), kWaitMs);
  }

  void theKeyboardStaysWithTheButton() {
    tick({"(.nodes.csv)"});
    type("exportPath", folder_.filePath("by-key.nodes.csv"));
    auto* write = find<QPushButton>("exportWrite");
    write->setFocus();
    QTest::keyClick(write, Qt::Key_Space);
    QTRY_VERIFY_WITH_TIMEOUT(QFile::exists(folder_.filePath("by-key.nodes.csv")) && write->isEnabled(), kWaitMs);
    // Of the window, which on a screen without a manager is never the active one.
    QCOMPARE(window_->focusWidget(), write);
  }

  void aPlaceThatIsNoFileIsSaid() {
    tick({});
    find<QLineEdit>("exportPath")->clear();
    click("exportWrite");
    QVERIFY(isSaid("Name the file"));
    type("exportPath", folder_.path());
    click("exportWrite");
    QVERIFY(isSaid("is a folder"));
    tick({"(.nrrd)", "(.npz)"});
    find<QLineEdit>("exportPath")->clear();
    click("exportWrite");
    QVERIFY(isSaid("Name the folder"));
  }

  /// One that cannot be does not keep the others.
  void whatCannotBeWrittenIsNamed() {
    tick({"(.npz)", "olynomial"});
    writeInto("part");
    QVERIFY(names("part").contains(QStringLiteral("lab_measured-to-true.npz")));
    QVERIFY(isSaid("could not be"));
    QVERIFY(isSaid("polynomial"));
  }

  void aStopLeavesNothingHalfWritten() {
    tick({"(.nrrd)", "(.npz)"});
    find<QDoubleSpinBox>("exportDeviation")->setValue(0.001);
    QVERIFY(QDir().mkpath(folder_.filePath("stopped")));
    type("exportPath", folder_.filePath("stopped"));
    click("exportWrite");
    QVERIFY(find<QPushButton>("exportStop")->isVisible() && !find<QPushButton>("exportWrite")->isEnabled());
    click("exportStop");
    // What became of the files is told when it is known.
    QVERIFY(!find<QPushButton>("exportStop")->isEnabled() && !find<QPushButton>("exportWrite")->isEnabled());
    QTRY_VERIFY_WITH_TIMEOUT(find<QPushButton>("exportWrite")->isEnabled(), kWaitMs);
    QVERIFY(!find<QPushButton>("exportStop")->isVisible());
    for (const QString& name : names("stopped")) QVERIFY2(!name.contains(QStringLiteral("part")), qPrintable(name));
    QVERIFY(names("stopped").size() < 2);
    QVERIFY(isSaid(names("stopped").isEmpty() ? "Stopped: nothing was written" : "Stopped: 1 of 2 files written to"));
  }

  /// A table is written in one go: what is told is whether it is there.
  void aFileThatIsThereAfterAStopIsTold() {
    tick({"(.nodes.csv)"});
    const QString path = folder_.filePath("late.nodes.csv");
    type("exportPath", path);
    click("exportWrite");
    click("exportStop");
    QTRY_VERIFY_WITH_TIMEOUT(find<QPushButton>("exportWrite")->isEnabled(), kWaitMs);
    QVERIFY(isSaid(QFile::exists(path) ? "Written: " : "Stopped: nothing was written"));
  }

  void aNameThatWasTypedStaysUntilAnotherTargetIsChosen() {
    tick({});
    auto* list = find<QListWidget>("exportList");
    const int nodes = rowOf("(.nodes.csv)");
    list->setCurrentRow(nodes);
    auto* path = find<QLineEdit>("exportPath");
    QCOMPARE(path->text(), folder_.filePath("lab.nodes.csv"));
    const QString mine = folder_.filePath("mine.csv");
    type("exportPath", mine);
    Workbench& workbench = window_->workbench();
    emit workbench.tableChanged();
    emit workbench.comparisonChanged();
    emit workbench.correctorChanged();
    QCOMPARE(path->text(), mine);
    list->setCurrentRow(rowOf("(.samples.csv)"));
    QCOMPARE(path->text(), folder_.filePath("lab.samples.csv"));
    list->setCurrentRow(nodes);
    QCOMPARE(path->text(), folder_.filePath("lab.nodes.csv"));
  }

 private:
  static CalibrationTable table() {
    SyntheticOptions options;
    options.counts = {5, 4, 3};
    options.smooth_distortion_m = 0.01;
    CalibrationTable table = syntheticTable(options, {.seed = 3});
    table.metadata.alignment_known = true;
    return table;
  }

  QString makeFittedSession() {
    QString path = folder_.filePath("lab.fieldtrue");
    const auto made = acquisition::makeSession(path, table(), {}, "lab.csv");
    const auto fitted = calibration::Corrector::fit(table().nodes, table().metadata,
                                                    calibration::parseCorrectorChoice("rbf", "none").value(),
                                                    calibration::AlignMode::kNone);
    if (!made || !fitted) qFatal("not made");
    auto store = acquisition::SessionStore::open(path);
    if (!store->storeFit("rbf", fitted->toText()) || !store->setState("page", "export")) qFatal("not stored");
    return path;
  }

  void tick(const std::vector<const char*>& words) {
    auto* list = find<QListWidget>("exportList");
    for (int row = 0; row < list->count(); ++row) {
      QListWidgetItem* item = list->item(row);
      if (!(item->flags() & Qt::ItemIsUserCheckable)) continue;
      const bool wanted = std::any_of(words.begin(), words.end(),
                                      [&](const char* word) { return item->text().contains(QLatin1String(word)); });
      item->setCheckState(wanted ? Qt::Checked : Qt::Unchecked);
    }
  }

  int rowOf(const char* words) {
    auto* list = find<QListWidget>("exportList");
    int row = 0;
    while (row < list->count() && !list->item(row)->text().contains(QLatin1String(words))) ++row;
    return row;
  }

  void type(const char* name, const QString& text) {
    auto* edit = find<QLineEdit>(name);
    QTest::keyClick(edit, Qt::Key_A, Qt::ControlModifier);
    QTest::keyClicks(edit, text);
  }

  void writeInto(const char* folder) {
    QVERIFY(QDir().mkpath(folder_.filePath(folder)));
    type("exportPath", folder_.filePath(folder));
    click("exportWrite");
    QTRY_VERIFY_WITH_TIMEOUT(find<QPushButton>("exportWrite")->isEnabled(), kWaitMs);
  }

  QStringList names(const char* folder) {
    return QDir(folder_.filePath(folder)).entryList(QDir::Files | QDir::Hidden, QDir::Name);
  }

  bool isSaid(const char* words) {
    const auto labels = find<QWidget>("messageLine")->findChildren<QLabel*>();
    return std::any_of(labels.begin(), labels.end(),
                       [&](const QLabel* label) { return label->text().contains(QLatin1String(words)); });
  }
};

FIELDTRUE_WINDOW_TEST(ExportPageTest)
#include "export_page_test.moc"
