// Nothing of a report is cut off: laid out by a real browser, on a screen of 1,200 px and on the width of A4 paper.

#include <QFile>
#include <QProcess>
#include <QStandardPaths>
#include <QTemporaryDir>
#include <QTest>

#include "calib/correctors/base/method.h"
#include "calib/correctors/registry.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"
#include "tests/widgets/gap_fixture.h"
#include "widgets/report/gap_section.h"
#include "widgets/report/report.h"

using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

namespace {

constexpr int kBrowserMs = 60000;
/// A4 is 210 mm wide; between margins of 12 mm, at the 96 px an inch of style sheets.
constexpr int kA4_px = 702;

/// Puts what does not fit into the document's attribute `data-cut`: how far the page, or a part that would scroll or
/// hide, is wider than its room. On a busy machine fonts still change after the page is loaded, so that what was
/// measured last counts.
constexpr const char* kMeasure = R"(<script>
window.addEventListener('load', function () {
document.querySelectorAll('details').forEach(function (d) { d.open = true; });
document.fonts.ready.then(measure);
setInterval(measure, 500);
});
function measure() {
var cut = [];
var page = document.documentElement;
if (page.scrollWidth > page.clientWidth) cut.push('page ' + page.scrollWidth + ' in ' + page.clientWidth);
document.querySelectorAll('body *').forEach(function (e) {
  var right = e.getBoundingClientRect().right;
  if (right > page.clientWidth + 1) cut.push(e.tagName + ' to ' + right + ': ' + e.textContent.slice(0, 30));
  if (e.clientWidth > 0 && e.scrollWidth > e.clientWidth + 1)
    cut.push(e.tagName + ' ' + e.scrollWidth + ' in ' + e.clientWidth + ': ' + e.textContent.slice(0, 30));
});
page.setAttribute('data-cut', cut.length + ' parts. ' + cut.slice(0, 5).join('; '));
}
</script></body>)";

QString browser() { return QStandardPaths::findExecutable(QStringLiteral("chromium")); }

/// Every method of both registries, with figures as long as figures get.
ReportInput longReport() {
  SyntheticOptions options;
  options.smooth_distortion_m = 0.03;
  options.orientation_error_rad = 0.05;
  ReportInput input;
  input.table = syntheticTable(options);
  evaluation::ComparisonOptions few;
  few.position_methods = {{"none", {}}, {"affine", {}}};
  few.orientation_methods = {{"none", {}}, {"rigid", {}}};
  auto comparison = evaluation::compareMethods(input.table, few);
  if (!comparison) qFatal("%s", comparison.error().message.c_str());
  input.comparison = *comparison;
  const auto widest = [](evaluation::MethodScore score, const std::string& id, const std::vector<Setting>& settings) {
    score.method = id;
    score.settings.clear();
    // Another value than the default, so that it stands in the name.
    for (const Setting& setting : settings) {
      if (const auto* whole = std::get_if<std::int64_t>(&setting.default_value))
        score.settings[setting.key] = *whole + 1;
      if (const auto* number = std::get_if<double>(&setting.default_value)) score.settings[setting.key] = *number + 1.0;
    }
    score.stats = {0.0123, 0.0123, 0.0123, 0.0123, 0.0123, 0.0123, 0.0123};
    score.rms_to_best = 0.0123;
    score.rms_to_best_low90 = -0.0123;
    score.rms_to_best_high90 = 0.0456;
    score.n_uncovered = 100;
    score.notes = {"A note on it."};
    return score;
  };
  const evaluation::MethodScore position = input.comparison.position.at(1),
                                orientation = input.comparison.orientation.at(1);
  for (const correctors::PositionMethod& method : correctors::positionMethods())
    input.comparison.position.push_back(widest(position, method.id, method.settings));
  for (const correctors::OrientationMethod& method : correctors::orientationMethods())
    input.comparison.orientation.push_back(widest(orientation, method.id, method.settings));
  input.source = "/a/folder/with/a/long/name/session-2024-05-01-120000-of-the-laboratory.fieldtrue";
  input.table.metadata.other["a_key_that_goes_on_and_on_without_a_blank_anywhere_in_it"] = std::string(200, 'x');
  input.plan = R"({"grid":"5x5x4@0.3048","order":"serpentine","orientations":1,"reseat":1,"seed":1})";
  input.gap = writtenReport();
  return input;
}

}  // namespace

class ReportLayoutTest : public QObject {
  Q_OBJECT

 private slots:
  void initTestCase() {
    if (browser().isEmpty()) QSKIP("there is no program chromium to lay a page out");
    QVERIFY(folder_.isValid());
  }

  void nothingIsCut_data() {
    QTest::addColumn<QString>("html");
    QTest::addColumn<int>("width");
    QTest::addColumn<bool>("printed");
    const QString report = QString::fromStdString(htmlReport(longReport()));
    const QString gap = QString::fromStdString(gapHtml(writtenReport(), nullptr));
    for (const auto& [name, html] : {std::pair("report", report), std::pair("gap", gap)}) {
      QTest::addRow("%s on a screen", name) << html << 1200 << false;
      QTest::addRow("%s on A4", name) << html << kA4_px << true;
    }
  }
  void nothingIsCut() {
    QFETCH(QString, html);
    QFETCH(int, width);
    QFETCH(bool, printed);
    if (printed) html.replace(QStringLiteral("@media print"), QStringLiteral("@media all"));
    html.replace(QStringLiteral("</body>"), QString::fromLatin1(kMeasure));
    const QString path = folder_.filePath(QStringLiteral("page.html"));
    QFile file(path);
    QVERIFY(file.open(QIODevice::WriteOnly));
    file.write(html.toUtf8());
    file.close();
    QProcess chromium;
    chromium.start(browser(), {"--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
                               "--disable-background-networking", "--disable-component-update", "--disable-sync",
                               "--hide-scrollbars", "--virtual-time-budget=5000",
                               "--user-data-dir=" + folder_.filePath(QStringLiteral("profile")),
                               QStringLiteral("--window-size=%1,900").arg(width), "--dump-dom", "file://" + path});
    QVERIFY2(chromium.waitForFinished(kBrowserMs), qPrintable(chromium.errorString()));
    const QString page = QString::fromUtf8(chromium.readAllStandardOutput());
    const QString cut = page.section(QStringLiteral("data-cut=\""), 1).section('"', 0, 0);
    QVERIFY2(cut.startsWith(QStringLiteral("0 parts")), qPrintable(cut.isEmpty() ? page.left(400) : cut));
  }

 private:
  QTemporaryDir folder_;
};

FIELDTRUE_TEST(ReportLayoutTest)
#include "report_layout_test.moc"
