#include "app/cli_gap_text.h"

#include <algorithm>
#include <cmath>

#include "app/cli_text.h"
#include "calib/core/number_text.h"
#include "calib/identify/thresholds.h"
#include "calib/recording/finding.h"
#include "widgets/report/numbers.h"

namespace fieldtrue::cli {
namespace {

using Row = std::vector<std::string>;

constexpr std::size_t kMostCandidates = 8;
constexpr std::size_t kMostPairs = 30;
constexpr double kSmallestProbability = 5e-4;
/// Pairs less alike than this are told apart without trouble.
constexpr double kSmallestR2 = 0.1;

std::string percent(double fraction) { return std::isfinite(fraction) ? fixedText(100.0 * fraction, 0) + " %" : "-"; }

std::string interval(const std::optional<double>& low, const std::optional<double>& high, double factor, int decimals) {
  if (!low || !high) return "";
  return fixedText(factor * *low, decimals) + " to " + fixedText(factor * *high, decimals);
}

std::string joined(const std::vector<std::string>& texts, const std::string& skipped) {
  std::string list;
  for (const std::string& text : texts) {
    if (text != skipped) list += (list.empty() ? "" : ", ") + text;
  }
  return list;
}

std::string gapLine(const gap::GapReport& report) {
  std::string text = (report.against ? "Difference from what the earlier recording foretells " : "Gap ") +
                     millimetres(report.position_rms_mm) + " RMS over " + std::to_string(report.input.places) +
                     " places, floor " + millimetres(report.floor_position_mm);
  if (report.orientation_rms_deg) {
    text += "; orientation " + fixedText(*report.orientation_rms_deg, 3) + " deg";
    if (report.floor_orientation_deg) text += ", floor " + fixedText(*report.floor_orientation_deg, 3) + " deg";
  }
  const auto flagged =
      std::count_if(report.nodes.begin(), report.nodes.end(), [](const gap::GapNode& node) { return node.is_flagged; });
  if (flagged > 0)
    text += "; " + std::to_string(flagged) + (flagged == 1 ? " row stands out of it" : " rows stand out of it");
  return text + ".\n";
}

std::string findingsText(const gap::GapReport& report) {
  std::string text;
  for (const recording::GapFinding& finding : report.findings) {
    text += (finding.effect.empty() ? "" : finding.effect + ": ") + finding.text + "\n";
  }
  return text;
}

std::string placeText(const gap::GapCandidate& candidate) {
  if (!candidate.location_m) return "";
  const Eigen::Vector3d& p_m = *candidate.location_m;
  return "(" + fixedText(p_m.x(), 2) + ", " + fixedText(p_m.y(), 2) + ", " + fixedText(p_m.z(), 2) + ") m";
}

std::string candidatesText(const gap::GapReport& report) {
  std::vector<Row> rows{{"cause", "probability", "BIC gain", "gap left",
                         report.remaining.is_of_rotation ? "rotation shrinks by" : "shrinks by", "at",
                         "looks like here"}};
  for (const gap::GapCandidate& candidate : report.candidates) {
    if (rows.size() > kMostCandidates || candidate.probability < kSmallestProbability) break;
    const bool is_none = candidate.effect == "none";
    rows.push_back({candidate.effect + (candidate.is_plausible ? "" : " (not plausible: " + candidate.doubt + ")"),
                    percent(candidate.probability), fixedText(candidate.bic_gain, 1),
                    is_none ? "" : millimetres(candidate.shrinkage.after_mm),
                    is_none ? "" : percent(candidate.shrinkage.fraction), placeText(candidate),
                    joined(candidate.equivalents, candidate.effect)});
  }
  return rows.size() > 1 ? alignedColumns(rows) : "";
}

std::string sequenceText(const gap::GapReport& report) {
  if (report.sequence.size() < 2) return "";
  const bool of_rotation = report.remaining.is_of_rotation;
  std::vector<Row> rows{
      {"held out", "gap above the floor", of_rotation ? "90 % interval [deg]" : "90 % interval [mm]"}};
  for (const gap::GapStep& step : report.sequence) {
    rows.push_back({step.effect.empty() ? "start" : "+ " + step.effect,
                    of_rotation ? fixedText(step.excess_deg.value_or(0.0), 3) + " deg" : millimetres(step.excess_mm),
                    of_rotation ? interval(step.low90_deg, step.high90_deg, 1.0, 3)
                                : interval(step.low90_mm, step.high90_mm, 1.0, 2)});
  }
  return alignedColumns(rows);
}

std::string remainingText(const gap::GapReport& report) {
  if (report.selected.empty() && report.verdict == gap::GapVerdict::kNoGap) return "";
  std::string text = "What remains on places not seen: " + millimetres(report.remaining.position_rms_mm) +
                     " RMS; of the square above the floor " +
                     (report.remaining.is_of_rotation ? "(of rotation, which tells more here) " : "") +
                     percent(report.remaining.fraction) + " of the start";
  if (!report.remaining.where.empty()) {
    std::vector<int> named = report.remaining.where;
    named.resize(std::min<std::size_t>(named.size(), 8));
    text += ", most at " + report.names.listInOrder(named, 8);
  }
  return text + ".\n" + gap::howFarOffText(report) + "\n";
}

/// Where an effect is that was named more than once.
std::string placeText(const gap::GapReport& report, const gap::Prediction& prediction) {
  const auto n_alike = std::count_if(report.selected.begin(), report.selected.end(),
                                     [&](const gap::SelectedEffect& one) { return one.effect == prediction.effect; });
  if (n_alike < 2 || prediction.selected >= report.selected.size()) return {};
  const auto& at_m = report.selected[prediction.selected].location_m;
  if (!at_m) return {};
  return " at (" + fixedText(at_m->x(), 2) + ", " + fixedText(at_m->y(), 2) + ", " + fixedText(at_m->z(), 2) + ") m";
}

std::string predictionsText(const gap::GapReport& report) {
  std::string text;
  for (const gap::Prediction& prediction : report.predictions) {
    text += "Without " + prediction.effect + placeText(report, prediction) + " " + report.names.of(prediction.node) +
            " should go from " + fixedText(prediction.now_mm, 1) + " to " + fixedText(prediction.then_mm, 1) + " +- " +
            fixedText(prediction.then_sd_mm, 1) + " mm.\n";
  }
  return text;
}

/// How sure the name is: odds over the next candidate, and the replicates where they were made.
std::string trustText(const gap::GapReport& report) {
  std::string text;
  if (report.odds_over_next && !report.selected.empty() && report.candidates.size() > 1)
    text = "Odds over the next candidate, " + report.candidates[1].effect + ": " +
           (*report.odds_over_next > 1000.0 ? std::string("more than 1000") : fixedText(*report.odds_over_next, 1)) +
           " to 1.\n";
  if (report.replicates) text += "Made again: " + report.replicates->text + "\n";
  return text;
}

/// Blocks with an empty line between them; empty ones are left out.
std::string blocks(const std::vector<std::string>& texts) {
  std::string all;
  for (const std::string& text : texts) {
    if (!text.empty()) all += (all.empty() ? "" : "\n") + text;
  }
  return all;
}

}  // namespace

std::string gapText(const gap::GapReport& report) {
  const std::string next = report.next_measurement.empty() ? "" : "Next: " + report.next_measurement + "\n";
  return blocks({std::string(gap::idOf(report.verdict)) + ": " + report.text + "\n" + gapLine(report),
                 findingsText(report), candidatesText(report), sequenceText(report),
                 remainingText(report) + predictionsText(report), next, trustText(report)});
}

std::string isolabilityText(const gap::Isolability& isolability) {
  std::vector<gap::IsolabilityPair> pairs = isolability.pairs;
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const gap::IsolabilityPair& a, const gap::IsolabilityPair& b) { return a.r2 > b.r2; });
  const identify::Thresholds thresholds;
  std::vector<Row> rows{{"effect", "and effect", "R2", "told apart from", ""}};
  for (const gap::IsolabilityPair& pair : pairs) {
    if (pair.r2 < kSmallestR2 || rows.size() > kMostPairs) break;
    const std::string told = pair.r2 > thresholds.same_on_design   ? "cannot be told apart"
                             : pair.r2 > thresholds.hard_on_design ? "hard to tell apart"
                                                                   : "";
    const std::string from = pair.told_apart_from ? fixedText(*pair.told_apart_from, 1) + " x noise" : "no strength";
    rows.push_back({pair.a, pair.b, fixedText(pair.r2, 3), from, told});
  }
  const std::size_t apart = pairs.size() + 1 - rows.size();
  std::string text = rows.size() > 1 ? alignedColumns(rows) : "";
  text += std::to_string(apart) + (rows.size() > 1 ? " more pairs" : " pairs") + " are told apart well on this grid.\n";
  std::string advice;
  for (const std::string& warning : isolability.warnings) advice += warning + "\n";
  return blocks({text, advice});
}

}  // namespace fieldtrue::cli
