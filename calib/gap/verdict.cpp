#include "calib/gap/verdict.h"

#include <algorithm>
#include <cmath>

#include "calib/core/file_io.h"
#include "calib/core/units.h"
#include "calib/effects/registry.h"

namespace fieldtrue::gap {
namespace {

/// How much of the gap's amplitude scatters from place to place beyond what a person with a jig does, where no
/// tolerance is stated; 0 where it is not clearly beyond that. No effect of the catalogue explains it.
double scatterAboveBound(const identify::GapSearch& search, const identify::GapRows& stated, const GapReport& report,
                         double clearly) {
  const auto share = [&](double scatter, double bound, double gap_rms) {
    if (scatter <= clearly * bound) return 0.0;
    const double gap_excess = gap_rms * gap_rms / 3.0 - bound * bound;  // Per axis.
    const double left_excess = scatter * scatter - bound * bound;
    return gap_excess > left_excess ? std::sqrt(left_excess / gap_excess) : 1.0;
  };
  double most = 0.0;
  if (!stated.placing_sd_m)
    most = share(search.placingSd_m(), identify::kWorstPlacing_m, 1e-3 * report.position_rms_mm);
  if (!stated.placing_sd_rad && report.orientation_rms_deg) {
    const double gap_rad = *report.orientation_rms_deg / kDegPerRad;
    most = std::max(most, share(search.placingSd_rad(), identify::kWorstPlacing_rad, gap_rad));
  }
  return most;
}

std::string causesText(const GapReport& report) {
  std::string text;
  for (const SelectedEffect& effect : report.selected) {
    std::string name = effects::labelOf(effect.effect);
    for (const std::string& other : effect.equivalents)
      if (other != effect.effect) name += " or " + effects::labelOf(other) + " (this grid cannot tell)";
    text += (text.empty() ? "" : ", and ") + name;
  }
  return text;
}

constexpr double kPoorlyPredicted = 0.5;

/// The gap beside its floor: positions, and rotations too where these stand out more.
std::string gapText(const GapReport& report) {
  std::string text =
      shown(report.position_rms_mm) + " mm where noise alone would be " + shown(report.floor_position_mm) + " mm";
  const double turned_deg = report.orientation_rms_deg.value_or(0.0);
  const double floor_deg = report.floor_orientation_deg.value_or(0.0);
  const bool stands_out = turned_deg * report.floor_position_mm > report.position_rms_mm * floor_deg;
  if (stands_out && turned_deg > 2.0 * floor_deg)
    text += ", and " + shown(turned_deg) + " degrees where it would be " + shown(floor_deg);
  return text;
}

}  // namespace

LeftOver leftBy(const identify::GapSearch& search, const identify::GapModel& model, const identify::GapRows& rows) {
  const identify::Linearized at(search.physics(), model, search.whitening(), search.spaceBlocks());
  return {identify::findStructure(at, rows, false), identify::findTraces(at, rows)};
}

Evidence weigh(const identify::GapSearch& search, const identify::EffectSelection& selection,
               const HeldOutGap& held_out, const LeftOver& left, const identify::GapRows& stated,
               const GapReport& report) {
  constexpr double kSure = 1e-4;
  constexpr double kSureOfNothingNamed = 1e-6;  // F tests of many columns are a little too sure.
  constexpr double kClearlyAbove = 1.6;         // A floor stated 20 % too low is no gap, nor is one stated by guess.
  const bool has_trace = left.traces.front().p_value < kSureTrace;
  Evidence evidence;
  evidence.has_effect = !selection.ways.empty();
  evidence.has_structure = search.structureOfNone().p_value < kSureOfNothingNamed || has_trace;
  const double stated_m = stated.placing_sd_m.value_or(0.0);
  evidence.is_above_floor = stated_m > 0.0 && search.placingSd_m() > kClearlyAbove * stated_m;
  const double scattered = scatterAboveBound(search, stated, report, kClearlyAbove);
  if (scattered > 0.0) evidence.is_above_floor = true;
  if (!evidence.has_effect) return evidence;
  const identify::GapRows& rows = search.physics().rows();
  const double count = static_cast<double>(rows.rows.size()) * rows.channels();
  double sure_left = 0.0;
  if (left.structure.p_value < kSure) sure_left = std::max(0.0, held_out.left - 1.645 * held_out.left_sd);
  if (has_trace) sure_left = std::max(sure_left, left.traces.front().explained / count);
  evidence.fraction = std::max(scattered, std::sqrt(std::min(1.0, sure_left / std::max(held_out.before, 1e-12))));
  return evidence;
}

GapVerdict verdictOf(const Evidence& evidence) {
  if (!evidence.has_effect)
    return evidence.has_structure || evidence.is_above_floor ? GapVerdict::kUnexplained : GapVerdict::kNoGap;
  if (evidence.fraction <= 0.15) return GapVerdict::kExplained;
  return evidence.fraction <= 0.5 ? GapVerdict::kPartlyExplained : GapVerdict::kUnexplained;
}

std::string shown(double value) {
  const double scale = value >= 10.0 ? 1.0 : value >= 1.0 ? 10.0 : 100.0;
  return formatNumber(std::round(value * scale) / scale);
}

std::string verdictText(const GapReport& report) {
  const std::string gap = gapText(report);
  const std::string percent = shown(100.0 * std::max(0.0, 1.0 - report.remaining_fraction)) + " %";
  switch (report.verdict) {
    case GapVerdict::kNoGap:
      return "No gap: the recording agrees with the simulation within its noise (" + gap + ").";
    case GapVerdict::kExplained:
      return "The gap (" + gap + ") is explained by: " + causesText(report) +
             "; on places the fit did not see it takes " + percent + " of it away" +
             (report.remaining_fraction > kPoorlyPredicted
                  ? ", because these lie where nothing else tells of it; nothing is left where it was measured."
                  : ".");
    case GapVerdict::kPartlyExplained:
      return "The gap (" + gap + ") is partly explained by: " + causesText(report) + "; this takes " + percent +
             " of it away, the rest has another cause.";
    case GapVerdict::kUnexplained:
      return "There is a gap (" + gap + "), but no known effect explains it" +
             (report.selected.empty()
                  ? std::string(".")
                  : "; the nearest, " + causesText(report) + ", takes only " + percent + " of it away.");
  }
  return {};
}

}  // namespace fieldtrue::gap
