#include "widgets/compare/curve_panel.h"

#include <QComboBox>
#include <QLabel>
#include <QPushButton>
#include <QTest>
#include <QThreadPool>

#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/widgets/window_test.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;
using namespace fieldtrue::widgets;

/// Learning curves are told of the methods they were drawn of.
class CurvePanelTest : public QObject {
  Q_OBJECT
 private slots:
  void aStoppedRunLeavesTheNamesOfTheCurves() {
    SyntheticOptions options;
    options.counts = {5, 4, 3};
    options.smooth_distortion_m = 0.02;
    CalibrationTable table = syntheticTable(options, {.seed = 2});
    table.metadata.alignment_known = true;
    evaluation::Comparison comparison;
    for (const char* method : {"affine", "hmq"}) comparison.position.emplace_back().method = method;
    CurvePanel panel;
    panel.setComparison(table, comparison);
    auto* which = panel.findChild<QComboBox*>("curveMethods");
    auto* start = panel.findChild<QPushButton*>("curveStart");
    const auto* text = panel.findChild<QLabel*>("curveText");
    QVERIFY(which && start && text);
    which->setCurrentIndex(1);  // The two shown.
    panel.showMethods(0, 0);
    start->click();
    QVERIFY(panel.isRunning());
    QTRY_VERIFY_WITH_TIMEOUT(!panel.isRunning(), 60000);
    QCOMPARE(panel.curves().size(), std::size_t{1});
    const QString told = text->text();
    QVERIFY2(told.startsWith(positionLabel(comparison, 0)), qPrintable(told));
    panel.showMethods(1, 1);
    start->click();
    start->click();
    QVERIFY(!panel.isRunning());
    QCOMPARE(text->text(), told);
    QThreadPool::globalInstance()->waitForDone();
  }
};

FIELDTRUE_WINDOW_TEST(CurvePanelTest)
#include "curve_panel_test.moc"
