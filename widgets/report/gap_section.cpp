#include "widgets/report/gap_section.h"

#include <algorithm>
#include <map>
#include <sstream>

#include "calib/core/file_io.h"
#include "widgets/report/html_writer.h"
#include "widgets/report/numbers.h"
#include "widgets/report/report_style.h"
#include "widgets/views/field_scale.h"
#include "widgets/views/gap_bars.h"
#include "widgets/views/gap_bodies.h"
#include "widgets/views/picture.h"

namespace fieldtrue {
namespace {

constexpr QSize kFieldSize(900, 700);
constexpr int kChartWidth = 560;
constexpr int kRowHeight = 38;
constexpr int kNoteLine = 15;
constexpr std::size_t kNoteLetters = 92;

std::string dataUrl(const QImage& image) { return "data:image/png;base64," + pngBytes(image).toBase64().toStdString(); }

void writeField(HtmlWriter& html, const ErrorField& field, const char* id, const FieldScale& scale) {
  QString why;
  const auto draw = [&](bool dark) {
    return renderFieldPicture(field, scale.max_mm, scale.magnification, kFieldSize, dark, &why);
  };
  const QImage light = draw(false);
  const QImage dark = light.isNull() ? QImage() : draw(true);
  if (light.isNull() || dark.isNull()) {
    html.element("p", "Picture could not be drawn: " + why.toStdString() + ".", {{"class", "notice"}});
    return;
  }
  const std::string caption = field.title.toStdString() + "; colours to " + significantText(scale.max_mm) +
                              " mm, arrows x" + significantText(scale.magnification, 2);
  html.open("figure", {{"id", id}});
  html.open("picture");
  html.emptyElement("source", {{"media", "screen and (prefers-color-scheme: dark)"}, {"srcset", dataUrl(dark)}});
  html.emptyElement("img", {{"src", dataUrl(light)}, {"alt", caption}});
  html.close();
  html.element("figcaption", caption);
  html.close();
}

void writeLine(HtmlWriter& html, double x1, double x2, double y1, double y2) {
  html.element("line", "",
               {{"x1", decimalText(x1, 1)},
                {"x2", decimalText(x2, 1)},
                {"y1", decimalText(y1, 1)},
                {"y2", decimalText(y2, 1)},
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
  html.element("text", bar.name, {{"x", "0"}, {"y", decimalText(top + 14, 1)}, {"fill", color}});
  html.element(
      "text", bar.text,
      {{"x", std::to_string(kChartWidth)}, {"y", decimalText(top + 14, 1)}, {"fill", color}, {"text-anchor", "end"}});
  html.element("rect", "",
               {{"x", "0"},
                {"y", decimalText(top + 20, 1)},
                {"width", decimalText(scale * bar.value, 1)},
                {"height", "10"},
                {"fill", bar.muted ? "var(--line)" : "var(--accent)"}});
  if (bar.low90 && bar.high90)
    writeLine(html, scale * std::max(0.0, *bar.low90), scale * *bar.high90, top + 25, top + 25);
  if (bar.floor) writeLine(html, scale * *bar.floor, scale * *bar.floor, top + 17, top + 33);
  double line_at = top + 43;
  for (const std::string& line : noteLines(bar)) {
    html.element("text", line,
                 {{"x", "0"}, {"y", decimalText(line_at, 1)}, {"fill", "var(--muted)"}, {"font-size", "11"}});
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

void writeFindings(HtmlWriter& html, const GapReport& report) {
  if (report.findings.empty()) return;
  html.element("h3", "What the readings themselves showed");
  html.open("ul");
  for (const GapFinding& finding : report.findings) html.element("li", finding.text);
  html.close();
}

void writeFields(HtmlWriter& html, const GapReport& report, bool with_pictures, const CalibrationTable* table) {
  if (!with_pictures) {
    html.element("p", "Pictures could not be drawn: they were not asked for.", {{"class", "notice"}});
    return;
  }
  const ErrorField before = gapField(report, false, table);
  const FieldScale scale = fieldScale(before);
  html.open("div", {{"class", "pictures"}});
  writeField(html, before, "gap-before", scale);
  writeField(html, gapField(report, true, table), "gap-after", scale);
  html.close();
}

void writeDiagnosis(HtmlWriter& html, const GapReport& report, bool with_pictures, const CalibrationTable* table) {
  html.element("p", report.text, {{"class", "lead"}});
  if (!report.next_measurement.empty()) html.element("p", "Next measurement: " + report.next_measurement);
  const std::string prediction = predictionText(report);
  if (!prediction.empty()) html.element("p", "To be checked: " + prediction);
  writeFields(html, report, with_pictures, table);
  html.open("div", {{"class", "pictures"}});
  for (const GapBarChart& chart : gapCharts(report)) writeChart(html, chart);
  html.close();
  writeFindings(html, report);
}

}  // namespace

ErrorField gapField(const GapReport& report, bool after, const CalibrationTable* table) {
  std::map<std::pair<int, int>, Eigen::Vector3d> places_m;
  if (table)
    for (const Node& row : table->nodes)
      places_m.emplace(std::pair(row.node, row.visit), row.reference_from_sensor.position_m);
  const Pose reference_from_tracker = inverse(report.tracker_from_reference);
  ErrorField field;
  field.title = after ? QStringLiteral("Gap with the causes added") : QStringLiteral("Gap as simulated now");
  field.reference_from_tracker = reference_from_tracker;
  field.bodies = believedBodies(report);
  for (const GapNode& node : report.nodes) {
    FieldArrow arrow;
    const auto place = places_m.find({node.node, node.visit});
    arrow.from_m = place != places_m.end() ? place->second : reference_from_tracker * node.place_m;
    arrow.error_m = reference_from_tracker.orientation * (after ? node.after_m : node.before_m);
    arrow.node = node.node;
    arrow.flagged = node.is_flagged;
    field.arrows.push_back(std::move(arrow));
  }
  return field;
}

void writeGapSection(HtmlWriter& html, const GapReport& report, bool with_pictures, const CalibrationTable* table) {
  html.element("h2", "Simulation and reality: " + gapHeadline(report));
  writeDiagnosis(html, report, with_pictures, table);
}

std::string gapHtml(const GapReport& report, bool with_pictures, const CalibrationTable* table) {
  HtmlWriter html("Simulation and reality", kReportStyle);
  html.element("p", gapHeadline(report), {{"class", "verdict"}});
  writeDiagnosis(html, report, with_pictures, table);
  return html.finish().toStdString();
}

Result<void> writeGapHtml(const GapReport& report, const std::filesystem::path& path, const CalibrationTable* table) {
  const std::string page = gapHtml(report, true, table);
  return writeFileAtomically(path, [&](std::ostream& out) { out << page; });
}

}  // namespace fieldtrue
