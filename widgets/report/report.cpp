#include "widgets/report/report.h"

#include <algorithm>
#include <set>

#include "calib/core/file_io.h"
#include "widgets/report/gap_section.h"
#include "widgets/report/html_writer.h"
#include "widgets/report/numbers.h"
#include "widgets/report/report_curves.h"
#include "widgets/report/report_data.h"
#include "widgets/report/report_pictures.h"
#include "widgets/report/report_region.h"
#include "widgets/report/report_style.h"
#include "widgets/report/report_tables.h"

namespace fieldtrue {
namespace {

std::string alignText(AlignMode align) {
  return align == AlignMode::kRigid
             ? "rigid: the rigid part between rig and tracker is fitted again in every fold, and "
               "every error, before included, is what is left after it"
             : "none: the table's frame is taken as the tracker's";
}

/// "RMS 41.2 mm before, 3.20 mm after (90 % interval 2.80 to 3.60 mm), on 100 places the fit did not see."
std::string leadText(const Comparison& comparison) {
  const ErrorStats& before = comparison.before_position_mm;
  std::string text = "Position RMS " + errorFigure(before.rms) + " mm before";
  if (const MethodScore* best = bestPosition(comparison)) {
    text += ", " + errorFigure(best->stats.rms) + " mm after " + positionLabel(best->method) + " (90 % interval " +
            errorFigure(best->stats.rms_low90) + " to " + errorFigure(best->stats.rms_high90) + " mm)";
  }
  return text + ", on " + std::to_string(comparison.places.size()) + " places the fit did not see.";
}

void writeVerdict(HtmlWriter& html, const ReportInput& input) {
  html.open("header");
  html.element("p", input.comparison.verdict.text, {{"class", "verdict"}});
  html.element("p", leadText(input.comparison), {{"class", "lead"}});
  html.element("h1", "Calibration report: " + input.source);
  html.close();
}

std::string asDataUrl(const QImage& image) {
  return "data:image/png;base64," + pngBytes(image).toBase64().toStdString();
}

void writePicture(HtmlWriter& html, const ReportPicture& picture) {
  html.open("figure", {{"id", picture.id}});
  html.open("picture");
  html.emptyElement("source",
                    {{"media", "screen and (prefers-color-scheme: dark)"}, {"srcset", asDataUrl(picture.dark)}});
  html.emptyElement("img", {{"src", asDataUrl(picture.light)}, {"alt", picture.caption}});
  html.close();
  html.element("figcaption", picture.caption);
  html.close();
}

void writePictures(HtmlWriter& html, const ReportInput& input, const std::vector<PlaceSummary>& places) {
  const ReportPictures pictures = drawReportPictures(input, places);
  html.element("h2", "Error field");
  if (!pictures.missing.empty()) {
    html.element("p", "Pictures could not be drawn: " + pictures.missing + ".", {{"class", "notice"}});
  }
  if (pictures.drawn.empty()) return;
  html.open("div", {{"class", "pictures"}});
  for (const ReportPicture& picture : pictures.drawn) writePicture(html, picture);
  html.close();
}

void writeMethods(HtmlWriter& html, const Comparison& comparison) {
  html.element("h2", "Methods");
  html.element("h3", "Position");
  writePositionTable(html, comparison);
  html.element("h3", "Orientation");
  if (comparison.before_orientation_deg) {
    writeOrientationTable(html, comparison);
  } else {
    html.element("p", "The tracker reported no orientation.");
  }
}

void writeNotes(HtmlWriter& html, const ReportInput& input) {
  std::vector<std::string> notes = input.notes;
  notes.insert(notes.end(), input.comparison.notes.begin(), input.comparison.notes.end());
  for (const auto* scores : {&input.comparison.position, &input.comparison.orientation}) {
    for (const MethodScore& score : *scores) {
      for (const std::string& note : score.notes) notes.push_back(score.method + ": " + note);
    }
  }
  if (notes.empty()) return;
  html.element("h2", "Remarks");
  html.open("ul");
  for (const std::string& note : notes) html.element("li", note);
  html.close();
}

std::string optionalNumber(const std::optional<double>& value, const std::string& unit, double factor = 1.0) {
  return value ? significantText(factor * *value) + unit : std::string();
}

void writeMeasured(HtmlWriter& html, const ReportInput& input) {
  const Comparison& comparison = input.comparison;
  const MeasurementSummary summary = measurementSummary(input.table);
  html.element("h2", "What was measured");
  FactList facts(html);
  facts.add("Places", std::to_string(comparison.n_places) + ", of which " + std::to_string(comparison.places.size()) +
                          " were scored by fits that did not see them");
  facts.add("Rows", std::to_string(summary.n_rows) + ", " + std::to_string(summary.n_skipped_rows) + " skipped");
  facts.add("Sensors", std::to_string(summary.n_sensors));
  facts.add("Samples", std::to_string(summary.n_used) + " used, " + std::to_string(summary.n_rejected) + " rejected");
  facts.add("Orientation", summary.has_orientation ? "recorded" : "not recorded");
  facts.add("SD of one sample", optionalNumber(summary.sd_mm, " mm") +
                                    (summary.sd_deg ? ", " + significantText(*summary.sd_deg) + " deg" : ""));
  facts.add("Lag-1 autocorrelation", summary.autocorrelation ? decimalText(*summary.autocorrelation, 2) : "");
  facts.add("Noise floor", floorText(comparison));
  facts.add("Trueness", truenessText(comparison));
  facts.add("Position lattice of the tracker", optionalNumber(input.table.metadata.quantum_m, " mm", 1000.0));
  facts.add("Jig tolerance", optionalNumber(input.table.metadata.jig_tolerance_m, " mm", 1000.0));
  facts.add("Duration", optionalNumber(summary.duration_s, " s"));
}

void writeMethodSettings(FactList& facts, const char* kind, const std::vector<MethodScore>& scores) {
  std::string text;
  for (const MethodScore& score : scores) {
    const std::string settings = settingsText(score.settings);
    text += (text.empty() ? "" : "; ") + score.method + (settings.empty() ? "" : " (" + settings + ")");
  }
  facts.add(kind, text);
}

void writeProvenance(HtmlWriter& html, const ReportInput& input) {
  const Comparison& comparison = input.comparison;
  const TableMetadata& metadata = input.table.metadata;
  html.element("h2", "Provenance");
  FactList facts(html);
  facts.add("Software", std::string("Fieldtrue ") + FIELDTRUE_VERSION);
  facts.add("Report made", input.made_at);
  facts.add("File", input.source);
  facts.add("Recorded", metadata.date.value_or(""));
  facts.add("Tracker", metadata.tracker.value_or("not stated"));
  facts.add("Excitation", metadata.excitation.value_or(""));
  facts.add("Carrier", optionalNumber(metadata.carrier_hz, " Hz"));
  facts.add("Rate", optionalNumber(metadata.rate_hz, " Hz"));
  facts.add("Rig", metadata.rig.value_or("not stated"));
  facts.add("Frame of the truth", metadata.frame);
  facts.add("Plan", input.plan);
  for (const auto& [key, value] : metadata.other) facts.add(key, value);
  facts.add("Validation", toText(comparison.validation));
  facts.add("Alignment", alignText(comparison.align));
  facts.add("Seed", std::to_string(input.seed));
  writeMethodSettings(facts, "Position methods", comparison.position);
  writeMethodSettings(facts, "Orientation methods", comparison.orientation);
}

}  // namespace

std::string htmlReport(const ReportInput& input) {
  const std::vector<PlaceSummary> places = placeSummaries(input);
  HtmlWriter html("Calibration report: " + input.source, kReportStyle);
  writeVerdict(html, input);
  writePictures(html, input, places);
  writeMethods(html, input.comparison);
  writeLearningCurves(html, input.learning_curves);
  writeRegion(html, input.comparison);
  if (input.gap) writeGapSection(html, *input.gap, input.with_pictures, &input.table);
  writeMeasured(html, input);
  html.element("h2", "Places, worst first");
  writePlaceTables(html, places);
  writeNotes(html, input);
  writeProvenance(html, input);
  return html.finish().toStdString();
}

Result<void> writeHtmlReport(const ReportInput& input, const std::filesystem::path& path) {
  const std::string page = htmlReport(input);
  return writeFileAtomically(path, [&](std::ostream& out) { out << page; });
}

}  // namespace fieldtrue
