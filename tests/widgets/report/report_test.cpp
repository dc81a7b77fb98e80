#include "widgets/report/report.h"

#include <QImage>
#include <QTemporaryDir>
#include <QTest>
#include <fstream>
#include <set>
#include <sstream>

#include "calib/correctors/method_label.h"
#include "tests/support/matchers.h"
#include "tests/support/synthetic.h"
#include "tests/support/test_main.h"
#include "tests/support/xml_tree.h"
#include "widgets/report/numbers.h"
#include "widgets/report/report_data.h"
#include "widgets/views/draw_picture.h"

using namespace fieldtrue;
using namespace fieldtrue::widgets;
using namespace fieldtrue::testing;

namespace {

/// A bent 5x5x4 grid of which an affine fit undoes most and hmq the rest.
CalibrationTable bentTable() {
  SyntheticOptions options;
  options.smooth_distortion_m = 0.03;
  options.orientation_error_rad = 0.05;
  SyntheticNoise noise;
  noise.position_sd_m = 0.0002;
  CalibrationTable table = syntheticTable(options, noise);
  for (Node& node : table.nodes) {
    node.covariance_m2 = Eigen::Vector3d(4e-6, 4e-6, 1e-6).asDiagonal();
    node.n_used = 60;
    node.n_rejected = 1;
    node.n_effective = 20.0;
  }
  return table;
}

ReportInput reportOf(CalibrationTable table, const evaluation::ComparisonOptions& options) {
  ReportInput input;
  const auto comparison = evaluation::compareMethods(table, options);
  if (!comparison) qFatal("%s", comparison.error().message.c_str());
  input.comparison = *comparison;
  input.table = std::move(table);
  input.source = "room.nodes.csv";
  input.made_at = "2024-05-01T12:00:00";
  return input;
}

evaluation::ComparisonOptions fewMethods() {
  evaluation::ComparisonOptions options;
  options.position_methods = {{"none", {}}, {"affine", {}}, {"polynomial", {{"degree", "3"}}}};
  options.orientation_methods = {{"none", {}}, {"rigid", {}}};
  options.validation = evaluation::Validation{evaluation::ValidationKind::kFolds, 5};
  return options;
}

std::unique_ptr<XmlElement> parsed(const ReportInput& input) {
  QString error;
  auto page = parseXml(QByteArray::fromStdString(htmlReport(input)), error);
  if (!error.isEmpty()) qFatal("%s", qPrintable(error));
  return page;
}

std::vector<QString> rowTexts(const XmlElement& row) {
  std::vector<QString> cells;
  for (const auto& cell : row.children) cells.push_back(cell->text);
  return cells;
}

}  // namespace

class ReportTest : public QObject {
  Q_OBJECT
 private slots:
  void initTestCase() { input_ = reportOf(bentTable(), fewMethods()); }

  void titleVerdictAndSummaryComeFirst() {
    ReportInput input = input_;
    input.source = "/somewhere/room.nodes.csv";
    const auto page = parsed(input);
    const auto bodies = page->all("body");
    QCOMPARE(bodies.size(), std::size_t(1));
    const XmlElement& header = *bodies.front()->children.front();
    QCOMPARE(header.children.size(), std::size_t(3));
    QCOMPARE(header.children[0]->tag, QStringLiteral("h1"));
    QCOMPARE(header.children[0]->text, QStringLiteral("Calibration report: room.nodes.csv"));
    QCOMPARE(page->all("h1").size(), std::size_t(1));
    QCOMPARE(page->all("title").front()->text, header.children[0]->text);
    QVERIFY(header.children[1]->hasClass("verdict"));
    QCOMPARE(header.children[1]->text.toStdString(), input.comparison.verdict.text);
    QVERIFY(!input.comparison.verdict.text.empty());
    const evaluation::MethodScore* best = bestPosition(input.comparison);
    QVERIFY(best != nullptr);
    for (const std::string& told :
         {errorFigure(input.comparison.before_position_mm.rms) + " mm RMS before", errorFigure(best->stats.rms) + " mm",
          correctors::positionLabel(best->method, best->settings), floorText(input.comparison)})
      QVERIFY2(header.children[2]->text.contains(QString::fromStdString(told)), told.c_str());
  }

  void cautionsAreTold() {
    evaluation::Comparison comparison = input_.comparison;
    comparison.verdict.apply_position = true;
    comparison.fold_back = evaluation::FoldBack{};
    evaluation::MethodScore& best = comparison.position.at(*comparison.best_position_row);
    best.stats.max = 0.5 * comparison.before_position_mm.max;
    QCOMPARE(cautionText(comparison), std::string());
    best.stats.max = comparison.before_position_mm.max;
    QCOMPARE(cautionText(comparison), std::string("the worst place is no better"));
    comparison.fold_back->n_folded = 1;
    QCOMPARE(cautionText(comparison), std::string("the field folds back and the worst place is no better"));
    ReportInput input = input_;
    input.comparison = comparison;
    QVERIFY(parsed(input)->all("header").front()->text.contains(
        QStringLiteral("the field folds back and the worst place is no better")));
    comparison.verdict.apply_position = false;
    QCOMPARE(cautionText(comparison), std::string());
  }

  void positionTableHoldsTheComparison() {
    const auto page = parsed(input_);
    const XmlElement& table = *page->all("table").front();
    const auto rows = table.all("tbody").front()->all("tr");
    QCOMPARE(rows.size(), 1 + input_.comparison.position.size());
    QCOMPARE(rowTexts(*rows.front()).at(3).toStdString(), errorFigure(input_.comparison.before_position_mm.rms));
    const evaluation::MethodScore* best = bestPosition(input_.comparison);
    QVERIFY(best != nullptr);
    for (std::size_t i = 0; i < input_.comparison.position.size(); ++i) {
      const evaluation::MethodScore& score = input_.comparison.position[i];
      const auto cells = rowTexts(*rows[i + 1]);
      QCOMPARE(cells.at(1).toStdString(), errorFigure(score.stats.mean));
      QCOMPARE(cells.at(3).toStdString(), errorFigure(score.stats.rms));
      QCOMPARE(cells.at(5).toStdString(), errorFigure(score.stats.p95));
      QCOMPARE(cells.at(6).toStdString(), errorFigure(score.stats.max));
      QCOMPARE(rows[i + 1]->hasClass("best"), &score == best);
    }
  }

  void worseThanBeforeIsMarked() {
    ReportInput input = input_;
    evaluation::MethodScore& score = input.comparison.position.at(1);
    score.stats.rms = 2.0 * input.comparison.before_position_mm.rms;
    input.comparison.best_position_row = 2;
    const auto page = parsed(input);
    const auto rows = page->all("tbody").front()->all("tr");
    QVERIFY(rows.at(2)->hasClass("worse"));
    QVERIFY(rows.at(2)->text.contains("worse than before"));
    QVERIFY(!rows.at(3)->text.contains("worse than before"));
  }

  void skippedMethodsSayWhy() {
    ReportInput input = input_;
    input.comparison.position.at(0) = {};
    input.comparison.position.at(0).method = "hmq";
    input.comparison.position.at(0).skipped = "needs nodes <not> in one plane";
    const auto page = parsed(input);
    const auto rows = page->all("tbody").front()->all("tr");
    QVERIFY(rows.at(1)->text.contains("needs nodes <not> in one plane"));
  }

  void placesAreListedOnceWorstFirst() {
    const auto page = parsed(input_);
    const auto details = page->all("details");
    QCOMPARE(details.size(), std::size_t(1));
    const auto tables = page->all("table");
    QCOMPARE(tables.size(), std::size_t(4));
    const auto worst = tables.at(2)->all("tbody").front()->all("tr");
    const auto rest = details.front()->all("tbody").front()->all("tr");
    QCOMPARE(worst.size(), std::size_t(10));
    QCOMPARE(worst.size() + rest.size(), input_.comparison.places.size());
    std::set<QString> nodes;
    double last = 1e9;
    for (const auto* rows : {&worst, &rest}) {
      for (const XmlElement* row : *rows) {
        const auto cells = rowTexts(*row);
        nodes.insert(cells.at(1));
        const double after = cells.at(6).toDouble();
        QVERIFY(after <= last);
        last = after;
      }
    }
    QCOMPARE(nodes.size(), input_.comparison.places.size());
    const auto best = bestPosition(input_.comparison);
    const double largest = *std::max_element(best->place_errors.begin(), best->place_errors.end());
    QCOMPARE(rowTexts(*worst.front()).at(6).toStdString(), errorFigure(largest));
  }

  void measuredFactsAreThoseOfTheTable() {
    const MeasurementSummary summary = measurementSummary(input_.table);
    QCOMPARE(summary.n_rows, std::size_t(100));
    QCOMPARE(summary.n_used, 6000L);
    QCOMPARE(summary.n_rejected, 100L);
    QCOMPARE(summary.n_sensors, 1);
    FT_VERIFY_MATCH(near(summary.sd_mm.value_or(0.0), 3.0, 1e-12));  // sqrt(4 + 4 + 1) mm
    FT_VERIFY_MATCH(
        near(summary.autocorrelation.value_or(0.0), 0.5, 1e-12));  // 60 samples worth 20: (1 - 1/3) / (1 + 1/3)
    const auto page = parsed(input_);
    QVERIFY(page->text.contains("6000 used, 100 rejected"));
  }

  void textIsEscaped() {
    ReportInput input = input_;
    input.source = "<script>alert('&')</script>\x01.csv";
    input.comparison.verdict.text = "a < b & \"c\"";
    input.table.metadata.tracker = "Fast\"rak <1>";
    input.notes = {"]]> <b>bold</b>"};
    const std::string html = htmlReport(input);
    QVERIFY(html.find("<script") == std::string::npos);
    const auto page = parsed(input);
    QVERIFY(page->all("script").empty());
    QVERIFY(page->all("b").empty());
    QCOMPARE(page->all("p").front()->text, QString("a < b & \"c\""));
    QVERIFY(page->text.contains("Fast\"rak <1>"));
    QVERIFY(page->text.contains("]]> <b>bold</b>"));
  }

  void nothingIsLoadedFromElsewhere() {
    std::string html = htmlReport(input_);
    const auto name_space = html.find("http://www.w3.org/1999/xhtml");
    QVERIFY(name_space != std::string::npos);
    html.erase(name_space, 28);
    for (const char* reference : {"http:", "https:", "file:", "url(", "@import", "<link"}) {
      QVERIFY2(html.find(reference) == std::string::npos, reference);
    }
  }

  void missingPicturesAreExplained() {
    const auto page = parsed(input_);
    QVERIFY(page->all("img").empty());
    bool told = false;
    for (const XmlElement* paragraph : page->all("p")) {
      told = told || (paragraph->hasClass("notice") && paragraph->text.contains("Pictures could not be drawn"));
    }
    QVERIFY(told);
  }

  void picturesAreInThePage() {
    ReportInput input = input_;
    input.draw = drawPictures;
    const auto page = parsed(input);
    const auto figures = page->all("figure");
    if (page->text.contains("Pictures could not be drawn")) {
      for (const XmlElement* p : page->all("p")) {
        if (p->hasClass("notice")) QSKIP(qPrintable("this machine draws no pictures: " + p->text));
      }
    }
    QCOMPARE(figures.size(), std::size_t(4));
    for (const XmlElement* figure : figures) {
      const QString light = figure->all("img").front()->attributes["src"];
      const QString dark = figure->all("source").front()->attributes["srcset"];
      QVERIFY(light != dark);
      for (const QString& source : {light, dark}) {
        const QString prefix = "data:image/png;base64,";
        QVERIFY(source.startsWith(prefix));
        const QImage image = QImage::fromData(QByteArray::fromBase64(source.mid(prefix.size()).toLatin1()), "PNG");
        QVERIFY(image.width() > 400 && image.height() > 300);
        std::set<QRgb> colours;
        for (int y = 0; y < image.height(); y += 3) {
          for (int x = 0; x < image.width(); x += 3) colours.insert(image.pixel(x, y));
        }
        QVERIFY2(colours.size() > 8, "the picture is blank");
      }
      QVERIFY(!figure->all("figcaption").front()->text.isEmpty());
    }
  }

  void distanceToTheBestIsAColumn() {
    const auto page = parsed(input_);
    const auto rows = page->all("table").front()->all("tbody").front()->all("tr");
    for (std::size_t i = 0; i < input_.comparison.position.size(); ++i) {
      const evaluation::MethodScore& score = input_.comparison.position[i];
      const bool is_best = &score == bestPosition(input_.comparison);
      QCOMPARE(rowTexts(*rows[i + 1]).at(7).toStdString(), toBestText(score, is_best));
    }
    evaluation::MethodScore score;
    score.rms_to_best = 0.5;
    score.rms_to_best_low90 = -0.1;
    score.rms_to_best_high90 = 1.2;
    QCOMPARE(toBestText(score, false), std::string("+0.500 (-0.100 to 1.20), as good"));
    score.rms_to_best_low90 = 0.1;
    QCOMPARE(toBestText(score, false), std::string("+0.500 (0.100 to 1.20)"));
    QCOMPARE(toBestText(score, true), std::string("best"));
  }

  void regionAndFieldAreTold() {
    ReportInput input = input_;
    evaluation::FoldBackCell cell;
    cell.center_m = {0.25, -0.5, 1.0};
    cell.determinant = -2.0;
    cell.one_to_one = false;
    cell.nodes = {3, 4, 8, 9, 28, 29, 33, 34};
    input.comparison.fold_back->cells.push_back(cell);
    input.comparison.coverage->holes.push_back({{0.5, 0.25, -1.0}, 0.4});
    const auto page = parsed(input);
    for (const std::string& text :
         {input.comparison.coverage->text, input.comparison.fold_back->text, input.comparison.orientation_cover->text,
          input.comparison.position_dependence->text, input.comparison.orientation_dependence->text,
          resamplingText(input.comparison),
          "cell between " + input.comparison.names.list(cell.nodes, 8) + " around (0.250, -0.500, 1.000) m",
          std::string("hole around (0.500, 0.250, -1.000) m, 0.400 m from the nearest place")})
      QVERIFY2(!text.empty() && page->text.contains(QString::fromStdString(text)), text.c_str());
  }

  void learningCurvesAreDrawn() {
    QVERIFY(parsed(input_)->all("svg").empty());
    ReportInput input = input_;
    input.learning_curves = {{"affine", {}, {{10, 3.0, 2.0, 4.0}, {40, 1.0, 0.9, 1.2}, {80, 0.8, 0.8, 0.8}}},
                             {"hmq", {}, {{40, 0.5, 0.4, 0.6}, {80, 0.1, 0.1, 0.1}}},
                             {"nothing fitted", {}, {}}};
    const auto page = parsed(input);
    QCOMPARE(page->all("svg").size(), std::size_t(1));
    const auto curves = page->all("polyline");
    QCOMPARE(curves.size(), std::size_t(2));  // Best first.
    QCOMPARE(curves.front()->attributes["points"].split(' ', Qt::SkipEmptyParts).size(), 2);
    const QStringList affine = curves.back()->attributes["points"].split(' ', Qt::SkipEmptyParts);
    QCOMPARE(affine.size(), 3);
    double last_x = 0.0;
    double last_y = 0.0;
    for (const QString& point : affine) {
      const double x = point.section(',', 0, 0).toDouble();
      const double y = point.section(',', 1, 1).toDouble();
      QVERIFY(x > last_x && x < 900.0 && y > last_y && y < 440.0);  // To the right, and down as the error falls.
      last_x = x;
      last_y = y;
    }
    QVERIFY(
        page->all("svg").front()->text.contains(QString::fromStdString(correctors::positionLabel("hmq") + " 0.100")));
  }

  void tablesWithoutOrientationSayIt() {
    SyntheticOptions options;
    options.has_orientation = false;
    options.smooth_distortion_m = 0.02;
    const auto page = parsed(reportOf(syntheticTable(options), fewMethods()));
    QVERIFY(page->text.contains("reported no orientation"));
  }

  void tablesWithFewOrientationsSayIt() {
    SyntheticOptions options;
    options.smooth_distortion_m = 0.02;
    CalibrationTable table = syntheticTable(options);
    table.nodes[3].has_orientation = false;
    const auto page = parsed(reportOf(table, fewMethods()));
    QVERIFY(!page->text.contains("reported no orientation"));
    QVERIFY(page->text.contains("1 of " + QString::number(table.nodes.size()) + " rows have no orientation"));
  }

  void theSameInputGivesTheSamePage() { QCOMPARE(htmlReport(input_), htmlReport(input_)); }

  void writesTheFileOrSaysWhyNot() {
    const QTemporaryDir folder;
    const std::filesystem::path path = folder.filePath("report.html").toStdString();
    FT_VERIFY_OK(writeHtmlReport(input_, path));
    std::ifstream in(path, std::ios::binary);
    std::stringstream bytes;
    bytes << in.rdbuf();
    QCOMPARE(bytes.str(), htmlReport(input_));
    const auto refused = writeHtmlReport(input_, path / "below" / "report.html");
    QVERIFY(!refused);
    FT_VERIFY_MATCH(holdsAll(refused.error().message, {"report.html"}));
  }

 private:
  ReportInput input_;
};

FIELDTRUE_TEST(ReportTest)
#include "report_test.moc"
