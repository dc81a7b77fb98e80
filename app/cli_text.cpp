#include "app/cli_text.h"

#include <algorithm>
#include <numbers>

#include "app/cli_values.h"
#include "widgets/report/numbers.h"
#include "widgets/report/report_data.h"

namespace fieldtrue::cli {
namespace {

using Row = std::vector<std::string>;

/// Columns a terminal shows: bytes that do not continue a UTF-8 character.
std::size_t width(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

void appendStats(Row& row, const ErrorStats& stats) {
  for (const double value : {stats.mean, stats.median, stats.rms}) row.push_back(errorFigure(value));
  row.push_back(errorFigure(stats.rms_low90) + "-" + errorFigure(stats.rms_high90));
  for (const double value : {stats.p95, stats.max}) row.push_back(errorFigure(value));
}

Row scoreRow(const MethodScore& score) {
  std::string settings = settingsText(score.settings);
  settings.erase(std::remove(settings.begin(), settings.end(), ' '), settings.end());
  const std::string name = score.method + (settings.empty() ? "" : ":" + settings);
  if (score.skipped) return {name + "  not used: " + *score.skipped};
  Row row{name};
  appendStats(row, score.stats);
  row.push_back(std::to_string(score.n_uncovered));
  row.push_back(errorFigure(score.in_sample_rms));
  row.push_back(durationText(score.fit_s));
  row.push_back(durationText(score.eval_ns * 1e-9));
  return row;
}

std::string scoreTable(const std::string& title, const ErrorStats& before, const std::vector<MethodScore>& scores) {
  std::vector<Row> rows{{title, "mean", "median", "RMS", "90 % interval", "95 %", "max", "uncovered", "in-sample RMS",
                         "fit", "evaluation"}};
  Row before_row{"before"};
  appendStats(before_row, before);
  before_row.resize(rows.front().size());
  rows.push_back(std::move(before_row));
  for (const MethodScore& score : scores) rows.push_back(scoreRow(score));
  return alignedColumns(rows);
}

void appendNotes(std::string& text, const std::string& who, const std::vector<std::string>& notes) {
  for (const std::string& note : notes) text += (who.empty() ? "" : who + ": ") + note + "\n";
}

}  // namespace

std::string alignedColumns(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths;
  for (const Row& row : rows) {
    if (row.size() < 2) continue;
    if (widths.size() < row.size()) widths.resize(row.size());
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width(row[i]));
  }
  std::string text;
  for (const Row& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string padding(row.size() < 2 ? 0 : widths[i] - width(row[i]), ' ');
      line += i == 0 ? row[i] + padding : "  " + padding + row[i];
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

std::string fitText(const Corrector& corrector, AlignMode align, std::size_t n_unused) {
  constexpr double kDegPerRad = 180.0 / std::numbers::pi;
  const FitReport& report = corrector.report();
  std::string text = "Fitted " + corrector.choice().position_id + " (position) and " +
                     corrector.choice().orientation_id + " (orientation) on " + std::to_string(report.n_nodes) +
                     " rows, align " + toText(align) + ".\n";
  if (n_unused > 0) text += std::to_string(n_unused) + " validation or skipped rows were left out.\n";
  text += "In-sample position RMS: " + errorFigure(report.rms_before_mm) + " mm before, " +
          errorFigure(1000.0 * report.rms_m) + " mm after, largest " + errorFigure(1000.0 * report.max_m) + " mm.\n";
  if (report.orientation_rms_rad) {
    text += "In-sample orientation RMS: " + errorFigure(kDegPerRad * *report.orientation_rms_rad) + " deg after.\n";
  }
  text += "These are errors on the rows the fit saw; compare tells how it does on others.\n";
  appendNotes(text, "", report.notes);
  return text;
}

std::string comparisonText(const Comparison& comparison) {
  std::string text = std::to_string(comparison.places.size()) + " places scored by " + toText(comparison.validation) +
                     ", align " + toText(comparison.align) + ". Noise floor " + floorText(comparison);
  text += ".\n\n" + scoreTable("position (mm)", comparison.before_position_mm, comparison.position);
  if (comparison.before_orientation_deg) {
    text += "\n" + scoreTable("orientation (deg)", *comparison.before_orientation_deg, comparison.orientation);
  }
  std::string notes;
  appendNotes(notes, "", comparison.notes);
  for (const auto* scores : {&comparison.position, &comparison.orientation}) {
    for (const MethodScore& score : *scores) appendNotes(notes, score.method, score.notes);
  }
  if (!notes.empty()) text += "\n" + notes;
  return text + "\n" + comparison.verdict.text + "\n";
}

}  // namespace fieldtrue::cli
