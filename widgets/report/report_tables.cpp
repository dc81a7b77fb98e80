#include "widgets/report/report_tables.h"

#include <algorithm>
#include <functional>
#include <span>

#include "calib/core/number_text.h"
#include "calib/correctors/method_label.h"
#include "calib/evaluation/error_stats.h"
#include "widgets/report/numbers.h"

namespace fieldtrue::widgets {
namespace {

constexpr std::size_t kWorstPlaces = 10;

void writeHead(HtmlWriter& html, std::initializer_list<const char*> columns) {
  html.open("thead");
  html.open("tr");
  for (const char* column : columns) html.element("th", column, {{"scope", "col"}});
  html.close();
  html.close();
}

void number(HtmlWriter& html, const std::string& text) { html.element("td", text, {{"class", "number"}}); }
/// Several numbers, which may stand in lines below each other where there is little room.
void range(HtmlWriter& html, const std::string& text) { html.element("td", text, {{"class", "range"}}); }

void writeStats(HtmlWriter& html, const evaluation::ErrorStats& stats) {
  number(html, errorFigure(stats.mean));
  number(html, errorFigure(stats.median));
  number(html, errorFigure(stats.rms));
  range(html, errorFigure(stats.rms_low90) + " to " + errorFigure(stats.rms_high90));
  number(html, errorFigure(stats.p95));
  number(html, errorFigure(stats.max));
}

/// The scores of one kind of method as a table.
struct ScoreTable {
  const char* unit;
  const std::vector<evaluation::MethodScore>& scores;
  const evaluation::ErrorStats& before;
  const evaluation::MethodScore* best;  ///< None when nothing beats the input.
  std::string (*label)(const std::string& id, const Settings& settings);
  bool with_common_places;  ///< Whether the RMS over the places that all methods cover is a column.

  int columns() const { return with_common_places ? 13 : 12; }
};

void writeName(HtmlWriter& html, const std::string& label, const std::string& mark) {
  html.open("th", {{"scope", "row"}});
  html.text(label);
  if (!mark.empty()) html.element("span", mark, {{"class", "mark"}});
  html.close();
}

void writeBefore(HtmlWriter& html, const ScoreTable& table) {
  html.open("tr", {{"class", "before"}});
  writeName(html, "Before", {});
  writeStats(html, table.before);
  for (int i = 7; i < table.columns(); ++i) number(html, {});
  html.close();
}

void writeScore(HtmlWriter& html, const ScoreTable& table, const evaluation::MethodScore& score) {
  if (score.skipped) {
    html.open("tr", {{"class", "skipped"}});
    writeName(html, table.label(score.method, score.settings), {});
    html.element("td", "not used: " + *score.skipped, {{"colspan", std::to_string(table.columns() - 1)}});
    html.close();
    return;
  }
  const bool best = &score == table.best;
  const bool worse = score.stats.rms > table.before.rms;
  html.open("tr", {{"class", best ? "best" : worse ? "worse" : "plain"}});
  writeName(html, table.label(score.method, score.settings), best ? "best" : worse ? "worse than before" : "");
  writeStats(html, score.stats);
  range(html, toBestText(score, best));
  number(html, std::to_string(score.n_uncovered));
  if (table.with_common_places) number(html, errorFigure(score.rms_common_mm));
  number(html, errorFigure(score.in_sample_rms));
  number(html, durationText(score.fit_s));
  number(html, durationText(score.eval_ns * 1e-9));
  html.close();
}

void writeScoreTable(HtmlWriter& html, const ScoreTable& table) {
  html.open("div", {{"class", "wide"}});
  html.open("table");
  html.element("caption",
               std::string("Held-out errors in ") + table.unit + ": on places the fits did not see, unless stated");
  if (table.with_common_places) {
    writeHead(html, {"Method", "Mean", "Median", "RMS", "90 % interval of the RMS", "95 %", "Max", "To the best (90 %)",
                     "Places left out", "RMS where all cover", "RMS on its own places", "One fit", "One correction"});
  } else {
    writeHead(html, {"Method", "Mean", "Median", "RMS", "90 % interval of the RMS", "95 %", "Max", "To the best (90 %)",
                     "Places left out", "RMS on its own places", "One fit", "One correction"});
  }
  html.open("tbody");
  writeBefore(html, table);
  for (const evaluation::MethodScore& score : table.scores) writeScore(html, table, score);
  html.close();
  html.close();
  html.close();
}

void writePlaces(HtmlWriter& html, std::span<const PlaceSummary> places) {
  html.open("div", {{"class", "wide"}});
  html.open("table");
  writeHead(html, {"Place", "Node", "x (m)", "y (m)", "z (m)", "Error before (mm)", "Error after (mm)", "SD (mm)",
                   "Samples", "Rejected"});
  html.open("tbody");
  for (const PlaceSummary& place : places) {
    html.open("tr");
    writeName(html, place.name, place.validation ? "validation" : "");
    number(html, std::to_string(place.node));
    for (int axis = 0; axis < 3; ++axis) number(html, fixedText(place.p_true_m[axis], 3));
    number(html, errorFigure(place.before_mm));
    number(html, errorFigure(place.after_mm));
    number(html, place.sd_mm ? errorFigure(*place.sd_mm) : "not known");
    number(html, std::to_string(place.n_used));
    number(html, std::to_string(place.n_rejected));
    html.close();
  }
  html.close();
  html.close();
  html.close();
}

}  // namespace

void writePositionTable(HtmlWriter& html, const evaluation::Comparison& comparison) {
  writeScoreTable(html, {"mm", comparison.position, comparison.before_position_mm, bestPosition(comparison),
                         correctors::positionLabel, true});
}

void writeOrientationTable(HtmlWriter& html, const evaluation::Comparison& comparison) {
  if (!comparison.before_orientation_deg) return;
  writeScoreTable(html, {"degrees", comparison.orientation, *comparison.before_orientation_deg,
                         bestOrientation(comparison), correctors::orientationLabel, false});
}

void writePlaceTables(HtmlWriter& html, std::vector<PlaceSummary> places) {
  std::stable_sort(places.begin(), places.end(),
                   [](const PlaceSummary& a, const PlaceSummary& b) { return a.after_mm > b.after_mm; });
  const std::span<const PlaceSummary> all(places);
  const std::size_t n_worst = std::min(kWorstPlaces, all.size());
  writePlaces(html, all.first(n_worst));
  if (n_worst == all.size()) return;
  html.open("details");
  html.element("summary", "The other " + std::to_string(all.size() - n_worst) + " places");
  writePlaces(html, all.subspan(n_worst));
  html.close();
}

void FactList::add(const std::string& name, const std::string& value) {
  if (value.empty()) return;
  html_.element("dt", name);
  html_.element("dd", value);
}

}  // namespace fieldtrue::widgets
