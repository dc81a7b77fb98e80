#include "widgets/report/report.h"

#include <algorithm>
#include <set>

#include "calib/calibration/alignment.h"
#include "calib/calibration/missing_orientations.h"
#include "calib/core/file_io.h"
#include "calib/core/number_text.h"
#include "calib/correctors/method_label.h"
#include "calib/evaluation/error_stats.h"
#include "calib/tables/metadata_keys.h"
#include "widgets/report/gap_section.h"
#include "widgets/report/html_writer.h"
#include "widgets/report/numbers.h"
#include "widgets/report/report_curves.h"
#include "widgets/report/report_data.h"
#include "widgets/report/report_pictures.h"
#include "widgets/report/report_region.h"
#include "widgets/report/report_style.h"
#include "widgets/report/report_tables.h"

namespace fieldtrue::widgets {
namespace {

std::string alignText(calibration::AlignMode align) {
  return align == calibration::AlignMode::kRigid
             ? "rigid: the rigid part between rig and tracker is fitted again in every fold, and "
               "every error, before included, is what is left after it"
             : "none: the table's frame is taken as the tracker's";
}

/// "41.2 mm RMS before, 3.20 mm after Affine (90 % interval 2.80 to 3.60 mm), on 100 places the fit did not see"
std::string gainText(const evaluation::Comparison& comparison, const evaluation::ErrorStats& before,
                     const evaluation::MethodScore* best, const std::string& label, const std::string& unit) {
  std::string text = errorFigure(before.rms) + " " + unit + " RMS before";
  if (best != nullptr)
    text += ", " + errorFigure(best->stats.rms) + " " + unit + " after " + label + " (90 % interval " +
            errorFigure(best->stats.rms_low90) + " to " + errorFigure(best->stats.rms_high90) + " " + unit + ")";
  return text + ", on " + std::to_string(comparison.places.size()) + " places the fit did not see";
}

std::string labelOf(const evaluation::MethodScore* score, std::string (*label)(const std::string&, const Settings&)) {
  return score == nullptr ? std::string() : label(score->method, score->settings);
}

/// What a reader takes away: the figures before and after, what to mind, what was measured with what.
void writeSummary(HtmlWriter& html, const ReportInput& input) {
  const evaluation::Comparison& comparison = input.comparison;
  const evaluation::MethodScore* position = bestPosition(comparison);
  const evaluation::MethodScore* orientation = bestOrientation(comparison);
  FactList facts(html);
  facts.add("Position", gainText(comparison, comparison.before_position_mm, position,
                                 labelOf(position, correctors::positionLabel), "mm"));
  if (comparison.before_orientation_deg)
    facts.add("Orientation", gainText(comparison, *comparison.before_orientation_deg, orientation,
                                      labelOf(orientation, correctors::orientationLabel), "deg"));
  facts.add("Mind", cautionText(comparison));
  facts.add("Not compared", notComparedText(comparison));
  facts.add("Noise floor", floorText(comparison));
  facts.add("Tracker", input.table.metadata.tracker.value_or("not stated"));
  if (const auto other = input.table.metadata.other.find(kOtherTracker); other != input.table.metadata.other.end())
    facts.add("Also recorded with", other->second + ": one calibration for both is wrong");
  facts.add("Recorded", input.table.metadata.date.value_or(""));
}

std::string titleOf(const ReportInput& input) {
  const std::string name = std::filesystem::path(input.source).filename().string();
  return name.empty() ? "Calibration report" : "Calibration report: " + name;
}

void writeVerdict(HtmlWriter& html, const ReportInput& input) {
  html.open("header");
  html.element("h1", titleOf(input));
  html.element("p", input.comparison.verdict.text, {{"class", "verdict"}});
  writeSummary(html, input);
  html.close();
}

void writeMethods(HtmlWriter& html, const ReportInput& input) {
  const evaluation::Comparison& comparison = input.comparison;
  html.element("h2", "Methods");
  html.element("h3", "Position");
  writePositionTable(html, comparison);
  html.element("h3", "Orientation");
  if (comparison.before_orientation_deg) {
    writeOrientationTable(html, comparison);
  } else {
    const std::string some = calibration::missingOrientationsNote(input.table.nodes);
    html.element("p", some.empty() ? "The tracker reported no orientation." : some);
  }
}

void writeNotes(HtmlWriter& html, const ReportInput& input) {
  std::vector<std::string> notes = input.notes;
  notes.insert(notes.end(), input.comparison.notes.begin(), input.comparison.notes.end());
  for (const evaluation::MethodScore& score : input.comparison.position)
    for (const std::string& note : score.notes)
      notes.push_back(correctors::positionLabel(score.method, score.settings) + ": " + note);
  for (const evaluation::MethodScore& score : input.comparison.orientation)
    for (const std::string& note : score.notes)
      notes.push_back("Orientation by " + correctors::orientationLabel(score.method, score.settings) + ": " + note);
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
  const evaluation::Comparison& comparison = input.comparison;
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
  facts.add("Lag-1 autocorrelation", summary.autocorrelation ? fixedText(*summary.autocorrelation, 2) : "");
  facts.add("Noise floor", floorText(comparison));
  facts.add("Trueness", truenessText(comparison));
  facts.add("By sensor", sensorsText(comparison));
  facts.add("Position lattice of the tracker", optionalNumber(input.table.metadata.quantum_m, " mm", 1000.0));
  facts.add("Jig tolerance", optionalNumber(input.table.metadata.jig_tolerance_m, " mm", 1000.0));
  facts.add("Duration", optionalNumber(summary.duration_s, " s"));
}

void writeMethodSettings(FactList& facts, const char* kind, const std::vector<evaluation::MethodScore>& scores,
                         std::string (*label)(const std::string& id, const Settings& settings)) {
  std::string text;
  for (const evaluation::MethodScore& score : scores) {
    const std::string settings = settingsText(score.settings);
    text += (text.empty() ? "" : "; ") + label(score.method, {}) + (settings.empty() ? "" : " (" + settings + ")");
  }
  facts.add(kind, text);
}

void writeProvenance(HtmlWriter& html, const ReportInput& input) {
  const evaluation::Comparison& comparison = input.comparison;
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
  facts.add("Validation", evaluation::toText(comparison.validation));
  facts.add("Alignment", alignText(comparison.align));
  facts.add("Seed", std::to_string(input.seed));
  writeMethodSettings(facts, "Position methods", comparison.position, correctors::positionLabel);
  writeMethodSettings(facts, "Orientation methods", comparison.orientation, correctors::orientationLabel);
}

}  // namespace

std::string htmlReport(const ReportInput& input) {
  const std::vector<PlaceSummary> places = placeSummaries(input);
  HtmlWriter html(titleOf(input), kReportStyle);
  writeVerdict(html, input);
  html.element("h2", "Error field");
  writePictures(html, reportPictures(input, places), input.draw);
  writeMethods(html, input);
  writeLearningCurves(html, input.learning_curves);
  writeRegion(html, input.comparison);
  if (input.gap) writeGapSection(html, *input.gap, input.draw, &input.table);
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

}  // namespace fieldtrue::widgets
