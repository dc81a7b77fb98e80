#include "app/cli_text.h"

#include <algorithm>
#include <numbers>
#include <optional>

#include "app/cli_values.h"
#include "calib/correctors/registry.h"
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
  const ErrorStats& before;
  const std::vector<MethodScore>& scores;
  std::optional<std::size_t> best_row;
  std::string (*name)(const MethodScore& score);
};

/// The method as one would ask for it, with the settings that are not at their defaults.
template <class Method>
std::string methodName(const MethodScore& score, const Result<const Method*>& method) {
  std::string settings = method ? givenSettingsText(score.settings, (*method)->settings) : settingsText(score.settings);
  settings.erase(std::remove(settings.begin(), settings.end(), ' '), settings.end());
  return score.method + (settings.empty() ? "" : ":" + settings);
}

std::string positionName(const MethodScore& score) { return methodName(score, findPositionMethod(score.method)); }
std::string orientationName(const MethodScore& score) { return methodName(score, findOrientationMethod(score.method)); }

Row statsRow(const std::string& name, const ErrorStats& stats) {
  return {name,
          errorFigure(stats.rms),
          errorFigure(stats.rms_low90) + " to " + errorFigure(stats.rms_high90),
          errorFigure(stats.median),
          errorFigure(stats.p95),
          errorFigure(stats.max)};
}

Row scoreRow(const std::string& name, const MethodScore& score, bool is_best) {
  if (score.skipped) return {name + "  not used: " + *score.skipped};
  Row row = statsRow(name, score.stats);
  row.push_back(toBestText(score, is_best));
  row.push_back(std::to_string(score.n_uncovered));
  row.push_back(durationText(score.fit_s));
  row.push_back(durationText(score.eval_ns * 1e-9));
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
std::string surroundingsText(const Comparison& comparison) {
  std::string text;
  for (const std::string& line :
       {truenessText(comparison), comparison.coverage ? comparison.coverage->text : std::string(),
        comparison.fold_back ? comparison.fold_back->text : std::string(),
        comparison.orientation_dependence ? comparison.orientation_dependence->text : std::string(),
        resamplingText(comparison)})
    if (!line.empty()) text += line + "\n";
  return text;
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

std::string learningText(const std::vector<LearningCurve>& curves) {
  std::vector<int> counts;
  for (const LearningCurve& curve : curves)
    for (const LearningPoint& point : curve.points)
      if (std::find(counts.begin(), counts.end(), point.n_places) == counts.end()) counts.push_back(point.n_places);
  std::sort(counts.begin(), counts.end());
  if (counts.empty()) return {};
  std::vector<Row> rows{{"RMS (mm) by places fitted to"}};
  rows.front().resize(counts.size() + 1);
  for (std::size_t i = 0; i < counts.size(); ++i) rows.front()[i + 1] = std::to_string(counts[i]);
  for (const LearningCurve& curve : curves) {
    Row row(counts.size() + 1, "-");
    row.front() = curve.method;
    for (const LearningPoint& point : curve.points) {
      const auto column = std::find(counts.begin(), counts.end(), point.n_places) - counts.begin();
      row[static_cast<std::size_t>(column) + 1] = errorFigure(point.rms);
    }
    rows.push_back(std::move(row));
  }
  return "\n" + alignedColumns(rows);
}

std::string comparisonText(const Comparison& comparison, const std::vector<LearningCurve>& curves) {
  std::string text = std::to_string(comparison.places.size()) + " places scored by " + toText(comparison.validation) +
                     ", align " + toText(comparison.align) + ". Noise floor " + floorText(comparison);
  text += ".\n\n" + scoreTable({"position (mm)", comparison.before_position_mm, comparison.position,
                                comparison.best_position_row, positionName});
  if (comparison.before_orientation_deg)
    text += "\n" + scoreTable({"orientation (deg)", *comparison.before_orientation_deg, comparison.orientation,
                               comparison.best_orientation_row, orientationName});
  text += learningText(curves);
  std::string notes;
  appendNotes(notes, "", comparison.notes);
  for (const auto* scores : {&comparison.position, &comparison.orientation}) {
    for (const MethodScore& score : *scores) appendNotes(notes, score.method, score.notes);
  }
  if (!notes.empty()) text += "\n" + notes;
  const std::string surroundings = surroundingsText(comparison);
  if (!surroundings.empty()) text += "\n" + surroundings;
  return text + "\n" + comparison.verdict.text + "\n";
}

}  // namespace fieldtrue::cli
