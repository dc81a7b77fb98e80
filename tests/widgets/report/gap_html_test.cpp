#include <QFile>
#include <QImage>
#include <QProcess>
#include <QProcessEnvironment>
#include <QTemporaryDir>
#include <QTest>

#include "tests/support/matchers.h"
#include "tests/support/test_main.h"
#include "tests/support/xml_tree.h"
#include "tests/widgets/gap_fixture.h"
#include "widgets/figures/gap_bars.h"
#include "widgets/figures/gap_field.h"
#include "widgets/report/gap_section.h"
#include "widgets/report/report.h"
#include "widgets/views/draw_picture.h"

using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

namespace {

std::unique_ptr<XmlElement> parsed(const gap::GapReport& report, bool with_pictures) {
  QString error;
  auto page =
      parseXml(QByteArray::fromStdString(gapHtml(report, with_pictures ? DrawPictures(drawPictures) : nullptr)), error);
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
    const gap::GapReport report = writtenReport();
    const auto page = parsed(report, false);
    for (const std::string& words :
         {gapHeadline(report), report.text, report.next_measurement, report.findings[0].text, predictionText(report)})
      QVERIFY2(page->text.contains(QString::fromStdString(words)), words.c_str());
    QVERIFY(page->text.contains(QStringLiteral("Pictures could not be drawn: they were not asked for")));
  }

  void everyBarIsDrawnToScale() {
    const gap::GapReport report = writtenReport();
    const auto page = parsed(report, false);
    for (const GapBarChart& chart : gapCharts(report)) {
      const XmlElement* drawn = figure(*page, QStringLiteral("gap-") + QString::fromStdString(chart.id));
      QVERIFY2(drawn, chart.id.c_str());
      // Three quarters of certainty fill three quarters.
      if (chart.id == "probability" || chart.id == "origin") QCOMPARE(chart.maximum(), 1.0);
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
    gap::GapReport report = writtenReport();
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

  void aCauseBesideTheFirstNeedNotBeProbableByItself() {
    gap::GapReport report = writtenReport();
    QVERIFY(report.candidates.size() >= 2 && report.selected.size() == 1);
    gap::SelectedEffect second;
    second.effect = report.candidates[1].effect;
    report.selected.push_back(second);
    report.candidates[1].probability = 1e-210;
    const GapBarChart chart = probabilityChart(report);
    QVERIFY(chart.bars[0].text.ends_with("%"));
    QCOMPARE(chart.bars[1].text, std::string("beside the first"));
  }

  /// What is shown with 0 % for its probability is not shown to take all of the gap.
  void whatNobodyBelievesTakesNothing() {
    gap::GapReport report = writtenReport();
    report.candidates[1].shrinkage.fraction = 1.05;
    QCOMPARE(shrinkageChart(report).bars.size(), std::size_t{2});
    report.candidates[1].probability = 0.004;
    QCOMPARE(shrinkageChart(report).bars.size(), std::size_t{1});
    report.candidates[0].probability = 0.004;  // But it is named.
    QCOMPARE(shrinkageChart(report).bars.size(), std::size_t{1});
  }

  void sharesOfRotationAreCalledSo() {
    gap::GapReport report = writtenReport();
    QVERIFY(shrinkageChart(report).title.find("rotation") == std::string::npos);
    report.remaining.is_of_rotation = true;
    QVERIFY(shrinkageChart(report).title.find("gap of rotation") != std::string::npos);
  }

  void wordsOfAReportCannotBreakThePage() {
    gap::GapReport report = writtenReport();
    report.text = "a < b & \"c\" </p><script>x</script>";
    const auto page = parsed(report, false);
    QVERIFY(page->text.contains(QString::fromStdString(report.text)));
    QVERIFY(page->all(QStringLiteral("script")).empty());
  }

  void anEmptyReportIsAPage() {
    const auto page = parsed(gap::GapReport{}, false);
    QVERIFY(page->text.contains(QStringLiteral("The simulation matches the recording")));
    QVERIFY(!figure(*page, QStringLiteral("gap-waterfall")));
  }

  void fieldsAreDrawn() {
    QString why;
    if (renderPicture({FieldPicture{}, 64, 64, false}, &why).isNull())
      QSKIP(qPrintable("this machine draws no pictures: " + why));
    const auto page = parsed(writtenReport(), true);
    for (const char* id : {"gap-before", "gap-after"}) {
      const XmlElement* drawn = figure(*page, QString::fromLatin1(id));
      QVERIFY2(drawn, id);
      const QString source = drawn->all("img").front()->attributes["src"].section(',', 1);
      QVERIFY(!QImage::fromData(QByteArray::fromBase64(source.toLatin1()), "PNG").isNull());
    }
    QVERIFY(!page->text.contains(QStringLiteral("could not be drawn")));
  }

  void withoutGraphicsTheReasonIsTold() {
    // EGL is asked for its drivers once in a process: the page without them is made in another one.
    constexpr const char* kNoDrivers = "__EGL_VENDOR_LIBRARY_FILENAMES";
    if (!qEnvironmentVariableIsSet(kNoDrivers)) {
      QProcess without;
      auto environment = QProcessEnvironment::systemEnvironment();
      environment.insert(QString::fromLatin1(kNoDrivers), QStringLiteral("/no/such/driver.json"));
      without.setProcessEnvironment(environment);
      without.start(QCoreApplication::applicationFilePath(),
                    {QStringLiteral("gap_html_test"), QStringLiteral("withoutGraphicsTheReasonIsTold")});
      QVERIFY(without.waitForFinished());
      const QByteArray said = without.readAllStandardOutput() + without.readAllStandardError();
      QVERIFY2(without.exitStatus() == QProcess::NormalExit && without.exitCode() == 0, said.constData());
      return;
    }
    const auto page = parsed(writtenReport(), true);
    QVERIFY(!figure(*page, QStringLiteral("gap-before")) && !figure(*page, QStringLiteral("gap-after")));
    QVERIFY(page->text.contains(QStringLiteral("Pictures could not be drawn: pictures need OpenGL 3.2")));
  }

  void aPageOfItsOwnHasATitle() {
    const auto page = parsed(writtenReport(), false);
    QCOMPARE(page->all("title").front()->text, QStringLiteral("Simulation and reality"));
    QCOMPARE(page->all("h1").size(), std::size_t{1});
    QCOMPARE(page->all("h1").front()->text, QStringLiteral("Simulation and reality"));
  }

  void theSessionsReportTellsItToo() {
    ReportInput input;
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
    const auto written = writeGapHtml(gap::GapReport{}, drawPictures, path);
    QVERIFY(!written.has_value());
    QVERIFY(written.error().code == ErrorCode::kIo);
  }

  void bodiesStandInTheRigsFrame() {
    gap::GapReport report = writtenReport();
    report.tracker_from_reference = {{0.0, 0.0, 1.0}, rotationFromVector({0.0, 0.0, M_PI / 2.0})};
    const ErrorField field = gapField(report, false);
    // x_tracker = Rz(90) x_rig + (0, 0, 1): the tracker's (0.9, 0.1, -0.4) is the rig's (0.1, -0.9, -1.4).
    FT_VERIFY_MATCH(near(field.bodies.at(0).center_m, Eigen::Vector3d(0.1, -0.9, -1.4), 1e-9));
    FT_VERIFY_MATCH(near(field.arrows.at(0).error_m, Eigen::Vector3d(0.0, -0.001, 0.0), 1e-9));
    FT_VERIFY_MATCH(near(field.arrows.at(0).from_m, Eigen::Vector3d(0.1, -0.5, -1.0), 1e-9));
  }

  void planesAndLoopsKeepTheirShape() {
    gap::GapReport report = writtenReport();
    gap::SelectedEffect plane;
    plane.effect = "metal_plane";
    plane.location_m = Eigen::Vector3d(0.0, 0.0, -1.2);
    plane.scene_parameters = {{"toward", {0.0, 0.0, -1.0}}, {"distance_m", 1.2}};
    plane.parameters = {{"distance_m", "m", 1.2, 1.15, 1.3}};
    gap::SelectedEffect loop;
    loop.effect = "closed_loop";
    loop.location_m = Eigen::Vector3d(1.0, 0.0, 0.0);
    loop.scene_parameters = {{"center_m", {1.0, 0.0, 0.0}}, {"normal", {0.0, 2.0, 0.0}}, {"radius_m", 0.3}};
    report.selected = {plane, loop};
    const auto bodies = gapField(report, false).bodies;
    QCOMPARE(bodies.size(), std::size_t{2});
    QVERIFY(bodies[0].shape == effects::DrawnShape::kPlane);
    FT_VERIFY_MATCH(near(*bodies[0].nearest_m, -0.05, 1e-12));
    FT_VERIFY_MATCH(near(*bodies[0].farthest_m, 0.1, 1e-12));
    QVERIFY(bodyLabel(bodies[0]).ends_with("10 cm"));
    QVERIFY(bodies[1].shape == effects::DrawnShape::kLoop);
    QCOMPARE(bodies[1].radius_m, 0.3);
    FT_VERIFY_MATCH(near(bodies[1].normal, Eigen::Vector3d(0.0, 1.0, 0.0), 1e-12));
  }
};

FIELDTRUE_TEST(GapHtmlTest)
#include "gap_html_test.moc"
