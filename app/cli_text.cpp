#include "app/cli_text.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "app/cli_values.h"
#include "calib/calibration/alignment.h"
#include "calib/core/number_text.h"
#include "calib/core/units.h"
#include "calib/correctors/method_label.h"
#include "calib/evaluation/error_stats.h"
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

/// The rows of one kind of method.
struct ScoreTable {
  std::string title;
  const evaluation::ErrorStats& before;
  const std::vector<evaluation::MethodScore>& scores;
  std::optional<std::size_t> best_row;
  std::string (*name)(const evaluation::MethodScore& score);
};

std::string positionName(const evaluation::MethodScore& score) {
  return correctors::positionLabel(score.method, score.settings);
}
std::string orientationName(const evaluation::MethodScore& score) {
  return correctors::orientationLabel(score.method, score.settings);
}

Row statsRow(const std::string& name, const evaluation::ErrorStats& stats) {
  return {name,
          widgets::errorFigure(stats.rms),
          std::isfinite(stats.rms_low90)
              ? widgets::errorFigure(stats.rms_low90) + " to " + widgets::errorFigure(stats.rms_high90)
              : "-",
          widgets::errorFigure(stats.median),
          widgets::errorFigure(stats.p95),
          widgets::errorFigure(stats.max)};
}

Row scoreRow(const std::string& name, const evaluation::MethodScore& score, bool is_best) {
  if (score.skipped) return {name + "  not used: " + *score.skipped};
  Row row = statsRow(name, score.stats);
  row.push_back(widgets::toBestText(score, is_best));
  row.push_back(std::to_string(score.n_uncovered));
  row.push_back(widgets::durationText(score.fit_s));
  row.push_back(widgets::durationText(score.eval_ns * 1e-9));
  return row;
}

std::string scoreTable(const ScoreTable& table) {
  std::vector<Row> rows{{table.title, "RMS", "90 % interval", "median", "95 %", "max", "to the best (90 %)",
                         "uncovered", "fit", "evaluation"}};
  rows.push_back(statsRow("before", table.before));
  rows.back().resize(rows.front().size());
  for (std::size_t i = 0; i < table.scores.size(); ++i)
    rows.push_back(scoreRow(table.name(table.scores[i]), table.scores[i], table.best_row == i));
  return alignedColumns(rows);
}

/// What was found out besides the scores, a sentence a line.
std::string surroundingsText(const evaluation::Comparison& comparison) {
  std::string text;
  for (const std::string& line :
       {widgets::truenessText(comparison), comparison.coverage ? comparison.coverage->text : std::string(),
        comparison.fold_back ? comparison.fold_back->text : std::string(),
        comparison.orientation_cover ? comparison.orientation_cover->text : std::string(),
        comparison.position_dependence ? comparison.position_dependence->text : std::string(),
        comparison.orientation_dependence ? comparison.orientation_dependence->text : std::string(),
        widgets::sensorsText(comparison), widgets::resamplingText(comparison)})
    if (!line.empty()) text += line + "\n";
  return text;
}

void appendNotes(std::string& text, const std::string& who, const std::vector<std::string>& notes) {
  const std::string lead = who.empty() ? "" : who + ": ";
  for (const std::string& note : notes) text.append(lead).append(note).append("\n");
}

}  // namespace

std::string millimetres(double value_mm) { return std::isfinite(value_mm) ? fixedText(value_mm, 2) + " mm" : "-"; }

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

std::string fitText(const calibration::Corrector& corrector, calibration::AlignMode align, std::size_t n_unused) {
  const calibration::FitReport& report = corrector.report();
  const calibration::CorrectorChoice& choice = corrector.choice();
  std::string text = "Fitted " + correctors::positionLabel(choice.position_id, choice.position_settings) +
                     " (position) and " +
                     correctors::orientationLabel(choice.orientation_id, choice.orientation_settings) +
                     " (orientation) on " + std::to_string(report.n_nodes) + " rows, align " + toText(align) + ".\n";
  if (n_unused > 0) text += std::to_string(n_unused) + " validation or skipped rows were left out.\n";
  text += "In-sample position RMS: " + widgets::errorFigure(report.rms_before_mm) + " mm before, " +
          widgets::errorFigure(1000.0 * report.rms_m) + " mm after, largest " +
          widgets::errorFigure(1000.0 * report.max_m) + " mm.\n";
  if (report.orientation_rms_rad) {
    text += "In-sample orientation RMS: " + widgets::errorFigure(kDegPerRad * *report.orientation_rms_rad) +
            " deg after.\n";
  }
  text += "These are errors on the rows the fit saw; compare tells how it does on others.\n";
  appendNotes(text, "", report.notes);
  return text;
}

std::string learningText(const std::vector<evaluation::LearningCurve>& curves) {
  std::vector<int> counts;
  for (const evaluation::LearningCurve& curve : curves)
    for (const evaluation::LearningPoint& point : curve.points)
      if (std::find(counts.begin(), counts.end(), point.n_places) == counts.end()) counts.push_back(point.n_places);
  std::sort(counts.begin(), counts.end());
  if (counts.empty()) return {};
  std::vector<Row> rows{{"RMS (mm) by places fitted to"}};
  rows.front().resize(counts.size() + 1);
  for (std::size_t i = 0; i < counts.size(); ++i) rows.front()[i + 1] = std::to_string(counts[i]);
  for (const evaluation::LearningCurve& curve : curves) {
    Row row(counts.size() + 1, "-");
    row.front() = correctors::positionLabel(curve.method, curve.settings);
    for (const evaluation::LearningPoint& point : curve.points) {
      const auto column = std::find(counts.begin(), counts.end(), point.n_places) - counts.begin();
      row[static_cast<std::size_t>(column) + 1] = widgets::errorFigure(point.rms);
    }
    rows.push_back(std::move(row));
  }
  return "\n" + alignedColumns(rows);
}

std::string comparisonText(const evaluation::Comparison& comparison,
                           const std::vector<evaluation::LearningCurve>& curves) {
  std::string text = std::to_string(comparison.places.size()) + " places scored by " + toText(comparison.validation) +
                     ", align " + toText(comparison.align) + ". Noise floor " + widgets::floorText(comparison);
  text += ".\n\n" + scoreTable({"position (mm)", comparison.before_position_mm, comparison.position,
                                comparison.best_position_row, positionName});
  if (comparison.before_orientation_deg)
    text += "\n" + scoreTable({"orientation (deg)", *comparison.before_orientation_deg, comparison.orientation,
                               comparison.best_orientation_row, orientationName});
  text += learningText(curves);
  std::string notes;
  appendNotes(notes, "", comparison.notes);
  for (const evaluation::MethodScore& score : comparison.position) appendNotes(notes, positionName(score), score.notes);
  for (const evaluation::MethodScore& score : comparison.orientation)
    appendNotes(notes, "orientation by " + orientationName(score), score.notes);
  if (!notes.empty()) text += "\n" + notes;
  const std::string surroundings = surroundingsText(comparison);
  if (!surroundings.empty()) text += "\n" + surroundings;
  return text + "\n" + comparison.verdict.text + "\n";
}

}  // namespace fieldtrue::cli
