#include "widgets/report/gap_section.h"

#include <algorithm>
#include <sstream>

#include "calib/core/file_io.h"
#include "calib/core/number_text.h"
#include "calib/recording/finding.h"
#include "widgets/figures/field_scale.h"
#include "widgets/figures/gap_bars.h"
#include "widgets/figures/gap_field.h"
#include "widgets/report/html_writer.h"
#include "widgets/report/numbers.h"
#include "widgets/report/picture_section.h"
#include "widgets/report/report_style.h"

namespace fieldtrue::widgets {
namespace {

constexpr int kChartWidth = 560;
constexpr int kRowHeight = 38;
constexpr int kNoteLine = 15;
constexpr std::size_t kNoteLetters = 92;

CaptionedPicture picture(const char* id, const ErrorField& field, const FieldScale& scale) {
  const std::string caption = field.title.toStdString() + "; colours to " + significantText(scale.max_mm) +
                              " mm, arrows x" + significantText(scale.magnification, 2);
  return {id, caption, {FieldPicture{field, scale.max_mm, scale.magnification}, kFieldWidth_px, kFieldHeight_px}};
}

void writeLine(HtmlWriter& html, double x1, double x2, double y1, double y2) {
  html.element("line", "",
               {{"x1", fixedText(x1, 1)},
                {"x2", fixedText(x2, 1)},
                {"y1", fixedText(y1, 1)},
                {"y2", fixedText(y2, 1)},
                {"stroke", "currentColor"},
                {"stroke-width", "1.5"}});
}

/// A note in lines that fit under a bar; SVG does not wrap text.
std::vector<std::string> noteLines(const GapBar& bar) {
  std::vector<std::string> lines;
  std::istringstream words(bar.note);
  for (std::string word; words >> word;) {
    if (lines.empty() || lines.back().size() + 1 + word.size() > kNoteLetters)
      lines.push_back(word);
    else
      lines.back() += " " + word;
  }
  return lines;
}

int rowHeight(const GapBar& bar) { return kRowHeight + kNoteLine * static_cast<int>(noteLines(bar).size()); }

void writeBar(HtmlWriter& html, const GapBar& bar, double scale, double top) {
  const std::string color = bar.muted ? "var(--muted)" : "var(--text)";
  html.element("text", bar.name, {{"x", "0"}, {"y", fixedText(top + 14, 1)}, {"fill", color}});
  html.element(
      "text", bar.text,
      {{"x", std::to_string(kChartWidth)}, {"y", fixedText(top + 14, 1)}, {"fill", color}, {"text-anchor", "end"}});
  html.element("rect", "",
               {{"x", "0"},
                {"y", fixedText(top + 20, 1)},
                {"width", fixedText(scale * bar.value, 1)},
                {"height", "10"},
                {"fill", bar.muted ? "var(--line)" : "var(--accent)"}});
  if (bar.low90 && bar.high90)
    writeLine(html, scale * std::max(0.0, *bar.low90), scale * *bar.high90, top + 25, top + 25);
  if (bar.floor) writeLine(html, scale * *bar.floor, scale * *bar.floor, top + 17, top + 33);
  double line_at = top + 43;
  for (const std::string& line : noteLines(bar)) {
    html.element("text", line,
                 {{"x", "0"}, {"y", fixedText(line_at, 1)}, {"fill", "var(--muted)"}, {"font-size", "11"}});
    line_at += kNoteLine;
  }
}

void writeChart(HtmlWriter& html, const GapBarChart& chart) {
  int height = 0;
  for (const GapBar& bar : chart.bars) height += rowHeight(bar);
  html.open("figure", {{"id", "gap-" + chart.id}});
  html.open("svg", {{"xmlns", "http://www.w3.org/2000/svg"},
                    {"viewBox", "0 0 " + std::to_string(kChartWidth) + " " + std::to_string(height)},
                    {"role", "img"},
                    {"aria-label", chart.title},
                    {"font-size", "14"}});
  const double scale = kChartWidth / chart.maximum();
  double top = 0.0;
  for (const GapBar& bar : chart.bars) {
    writeBar(html, bar, scale, top);
    top += rowHeight(bar);
  }
  html.close();
  html.element("figcaption", chart.title);
  html.close();
}

void writeFindings(HtmlWriter& html, const gap::GapReport& report) {
  if (report.findings.empty()) return;
  html.element("h3", "What the readings themselves showed");
  html.open("ul");
  for (const recording::GapFinding& finding : report.findings) html.element("li", finding.text);
  html.close();
}

void writeFields(HtmlWriter& html, const gap::GapReport& report, const DrawPictures& draw,
                 const CalibrationTable* table) {
  const ErrorField before = gapField(report, false, table);
  const FieldScale scale = fieldScale(before);
  writePictures(
      html, {picture("gap-before", before, scale), picture("gap-after", gapField(report, true, table), scale)}, draw);
}

void writeDiagnosis(HtmlWriter& html, const gap::GapReport& report, const DrawPictures& draw,
                    const CalibrationTable* table) {
  html.element("p", report.text, {{"class", "lead"}});
  html.element("p", gap::howFarOffText(report));
  if (!report.next_measurement.empty()) html.element("p", "Next measurement: " + report.next_measurement);
  if (report.replicates) html.element("p", report.replicates->text);
  const std::string prediction = predictionText(report);
  if (!prediction.empty()) html.element("p", "To be checked: " + prediction);
  writeFields(html, report, draw, table);
  html.open("div", {{"class", "pictures"}});
  for (const GapBarChart& chart : gapCharts(report)) writeChart(html, chart);
  html.close();
  writeFindings(html, report);
}

}  // namespace

void writeGapSection(HtmlWriter& html, const gap::GapReport& report, const DrawPictures& draw,
                     const CalibrationTable* table) {
  html.element("h2", "Simulation and reality: " + gapHeadline(report));
  writeDiagnosis(html, report, draw, table);
}

std::string gapHtml(const gap::GapReport& report, const DrawPictures& draw, const CalibrationTable* table) {
  HtmlWriter html("Simulation and reality", kReportStyle);
  html.element("h1", "Simulation and reality");
  html.element("p", gapHeadline(report), {{"class", "verdict"}});
  writeDiagnosis(html, report, draw, table);
  return html.finish().toStdString();
}

Result<void> writeGapHtml(const gap::GapReport& report, const DrawPictures& draw, const std::filesystem::path& path,
                          const CalibrationTable* table) {
  const std::string page = gapHtml(report, draw, table);
  return writeFileAtomically(path, [&](std::ostream& out) { out << page; });
}

}  // namespace fieldtrue::widgets
