#include <QFile>
#include <QTemporaryDir>
#include <QTest>

#include "tests/support/matchers.h"
#include "tests/support/xml_tree.h"
#include "tests/widgets/gap_fixture.h"
#include "widgets/report/gap_section.h"
#include "widgets/report/report.h"
#include "widgets/views/gap_bars.h"

using namespace fieldtrue;
using namespace fieldtrue::testing;

namespace {

std::unique_ptr<XmlElement> parsed(const GapReport& report, bool with_pictures) {
  QString error;
  auto page = parseXml(QByteArray::fromStdString(gapHtml(report, with_pictures)), error);
  if (!error.isEmpty()) qFatal("%s", qPrintable(error));
  return page;
}

const XmlElement* figure(const XmlElement& page, const QString& id) {
  for (const XmlElement* element : page.all(QStringLiteral("figure")))
    if (element->attributes.value(QStringLiteral("id")) == id) return element;
  return nullptr;
}

}  // namespace

class GapHtmlTest : public QObject {
  Q_OBJECT

 private slots:
  void tellsWhatTheReportSays() {
    const GapReport report = writtenReport();
    const auto page = parsed(report, false);
    for (const std::string& words :
         {gapHeadline(report), report.text, report.next_measurement, report.findings[0].text, predictionText(report)})
      QVERIFY2(page->text.contains(QString::fromStdString(words)), words.c_str());
    QVERIFY(page->text.contains(QStringLiteral("Pictures could not be drawn: they were not asked for")));
  }

  void everyBarIsDrawnToScale() {
    const GapReport report = writtenReport();
    const auto page = parsed(report, false);
    for (const GapBarChart& chart : gapCharts(report)) {
      const XmlElement* drawn = figure(*page, QStringLiteral("gap-") + QString::fromStdString(chart.id));
      QVERIFY2(drawn, chart.id.c_str());
      const auto bars = drawn->all(QStringLiteral("rect"));
      QCOMPARE(bars.size(), chart.bars.size());
      for (std::size_t i = 0; i < bars.size(); ++i) {
        const double width = bars[i]->attributes.value(QStringLiteral("width")).toDouble();
        FT_VERIFY_MATCH(near(width, 560.0 * chart.bars[i].value / chart.maximum(), 0.06));
        QVERIFY(drawn->text.contains(QString::fromStdString(chart.bars[i].text)));
      }
    }
  }

  void longNotesAreWholeAndStayBetweenBars() {
    GapReport report = writtenReport();
    std::string doubt = "first";
    for (int i = 0; i < 60; ++i) doubt += " word" + std::to_string(i);
    report.candidates[0].is_plausible = false;
    report.candidates[0].doubt = doubt;
    const auto page = parsed(report, false);
    const XmlElement* drawn = figure(*page, QStringLiteral("gap-probability"));
    QVERIFY(drawn);
    for (int i = 0; i < 60; ++i) QVERIFY(drawn->text.contains(QStringLiteral("word%1").arg(i)));
    const auto bars = drawn->all(QStringLiteral("rect"));
    double lowest_note = 0.0;
    for (const XmlElement* text : drawn->all(QStringLiteral("text"))) {
      QVERIFY(text->text.size() < 100);
      if (text->text.contains(QStringLiteral("word")))
        lowest_note = std::max(lowest_note, text->attributes.value(QStringLiteral("y")).toDouble());
    }
    QVERIFY(lowest_note > 43.0);
    QVERIFY(lowest_note < bars[1]->attributes.value(QStringLiteral("y")).toDouble());
  }

  void wordsOfAReportCannotBreakThePage() {
    GapReport report = writtenReport();
    report.text = "a < b & \"c\" </p><script>x</script>";
    const auto page = parsed(report, false);
    QVERIFY(page->text.contains(QString::fromStdString(report.text)));
    QVERIFY(page->all(QStringLiteral("script")).empty());
  }

  void anEmptyReportIsAPage() {
    const auto page = parsed(GapReport{}, false);
    QVERIFY(page->text.contains(QStringLiteral("The simulation matches the recording")));
    QVERIFY(!figure(*page, QStringLiteral("gap-waterfall")));
  }

  void fieldsAreDrawnOrTheReasonIsTold() {
    const auto page = parsed(writtenReport(), true);
    const bool drawn = figure(*page, QStringLiteral("gap-before")) && figure(*page, QStringLiteral("gap-after"));
    QVERIFY(drawn || page->text.contains(QStringLiteral("Picture could not be drawn:")));
  }

  void theSessionsReportTellsItToo() {
    ReportInput input;
    input.with_pictures = false;
    QVERIFY(htmlReport(input).find("Simulation and reality") == std::string::npos);
    input.gap = writtenReport();
    QString error;
    const auto page = parseXml(QByteArray::fromStdString(htmlReport(input)), error);
    QVERIFY2(error.isEmpty(), qPrintable(error));
    QVERIFY(page->text.contains(QString::fromStdString(gapHeadline(*input.gap))));
    QVERIFY(page->text.contains(QString::fromStdString(input.gap->text)));
    QVERIFY(figure(*page, QStringLiteral("gap-waterfall")));
  }

  void writingWhereNobodyCanIsAnError() {
    QTemporaryDir folder;
    const auto path = (folder.path() + QStringLiteral("/no/such/gap.html")).toStdString();
    const auto written = writeGapHtml(GapReport{}, path);
    QVERIFY(!written.has_value());
    QVERIFY(written.error().code == ErrorCode::kIo);
  }

  void bodiesStandInTheRigsFrame() {
    GapReport report = writtenReport();
    report.tracker_from_reference = {{0.0, 0.0, 1.0}, rotationFromVector({0.0, 0.0, M_PI / 2.0})};
    const ErrorField field = gapField(report, false);
    // x_tracker = Rz(90) x_rig + (0, 0, 1): the tracker's (0.9, 0.1, -0.4) is the rig's (0.1, -0.9, -1.4).
    FT_VERIFY_MATCH(near(field.bodies.at(0).center_m, Eigen::Vector3d(0.1, -0.9, -1.4), 1e-9));
    FT_VERIFY_MATCH(near(field.arrows.at(0).error_m, Eigen::Vector3d(0.0, -0.001, 0.0), 1e-9));
    FT_VERIFY_MATCH(near(field.arrows.at(0).from_m, Eigen::Vector3d(0.1, -0.5, -1.0), 1e-9));
  }

  void planesAndLoopsKeepTheirShape() {
    GapReport report = writtenReport();
    SelectedEffect plane;
    plane.effect = "metal_plane";
    plane.location_m = Eigen::Vector3d(0.0, 0.0, -1.2);
    plane.scene_parameters = {{"toward", {0.0, 0.0, -1.0}}, {"distance_m", 1.2}};
    plane.parameters = {{"distance_m", "m", 1.2, 1.15, 1.3}};
    SelectedEffect loop;
    loop.effect = "closed_loop";
    loop.location_m = Eigen::Vector3d(1.0, 0.0, 0.0);
    loop.scene_parameters = {{"center_m", {1.0, 0.0, 0.0}}, {"normal", {0.0, 2.0, 0.0}}, {"radius_m", 0.3}};
    report.selected = {plane, loop};
    const auto bodies = gapField(report, false).bodies;
    QCOMPARE(bodies.size(), std::size_t{2});
    QVERIFY(bodies[0].kind == BodyKind::kPlane);
    FT_VERIFY_MATCH(near(*bodies[0].nearest_m, -0.05, 1e-12));
    FT_VERIFY_MATCH(near(*bodies[0].farthest_m, 0.1, 1e-12));
    QVERIFY(bodyLabel(bodies[0]).ends_with("10 cm"));
    QVERIFY(bodies[1].kind == BodyKind::kLoop);
    QCOMPARE(bodies[1].radius_m, 0.3);
    FT_VERIFY_MATCH(near(bodies[1].normal, Eigen::Vector3d(0.0, 1.0, 0.0), 1e-12));
  }
};

QTEST_GUILESS_MAIN(GapHtmlTest)
#include "gap_html_test.moc"
