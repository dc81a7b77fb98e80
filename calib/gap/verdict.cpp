#include "calib/gap/verdict.h"

#include <algorithm>
#include <cmath>

#include "calib/core/file_io.h"
#include "calib/core/units.h"
#include "calib/effects/registry.h"
#include "calib/gap/candidates.h"
#include "calib/gap/where.h"

namespace fieldtrue::gap {
namespace {

/// What of a scatter stands above what may be noise, over what of the gap does; squares per axis.
double shareAbove(double scatter, double bound, double gap_rms, const identify::Thresholds& thresholds) {
  if (scatter <= thresholds.clearly_scattered * bound) return 0.0;
  const double gap_excess = gap_rms * gap_rms / 3.0 - bound * bound;
  const double left_excess = scatter * scatter - bound * bound;
  return gap_excess > left_excess ? left_excess / gap_excess : 1.0;
}

std::string causeText(const SelectedEffect& effect) {
  std::string name = effects::labelOf(effect.effect);
  for (const std::string& other : effect.equivalents)
    if (other != effect.effect) name += " or " + effects::labelOf(other);
  return effect.equivalents.size() > 1 ? name + " (these readings cannot tell)" : name;
}

/// Each once, with how many of them there are.
std::string causesText(const GapReport& report) {
  std::vector<std::string> names;
  for (const SelectedEffect& effect : report.selected) names.push_back(causeText(effect));
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto here = names.begin() + static_cast<std::ptrdiff_t>(i);
    if (std::find(names.begin(), here, names[i]) != here) continue;
    const auto count = std::count(here, names.end(), names[i]);
    text += (text.empty() ? "" : ", and ") + names[i];
    if (count > 1) text += " (" + std::to_string(count) + " of them)";
  }
  return text;
}

/// RMS over the floor from which the size of the gap shows it: set by reason, chance alone gives it at fifty places in
/// one recording of twenty.
constexpr double kShownBySize = 1.1;

std::string plainText(double rms, double floor, const std::string& unit) {
  return shown(rms) + " " + unit + " where noise alone would be " + shown(floor) + " " + unit;
}

/// The gap beside its floor: of positions, of rotations too where these stand out more, or of rotations alone where
/// only these do.
std::string gapText(const GapReport& report) {
  const double turned_deg = report.orientation_rms_deg.value_or(0.0);
  const double floor_deg = report.floor_orientation_deg.value_or(0.0);
  if (report.position_rms_mm < kShownBySize * report.floor_position_mm) {
    if (turned_deg > kShownBySize * floor_deg) return "of rotation, " + plainText(turned_deg, floor_deg, "degrees");
    return shown(report.position_rms_mm) + " mm, as large as noise alone, but not scattered as noise is";
  }
  std::string text = plainText(report.position_rms_mm, report.floor_position_mm, "mm");
  const bool stands_out = turned_deg * report.floor_position_mm > report.position_rms_mm * floor_deg;
  if (stands_out && turned_deg > 2.0 * floor_deg)
    text += ", and " + shown(turned_deg) + " degrees where it would be " + shown(floor_deg);
  return text;
}

std::string namesText(const std::vector<std::string>& effects) {
  std::string text;
  for (const std::string& effect : effects) text += (text.empty() ? "" : " and ") + effects::labelOf(effect);
  return text;
}

constexpr const char* kNotSure = "these places cannot say how sure that is)";

/// The high end of what is left; where the start is not clear enough for a share of it, of what is left by itself.
std::optional<double> mostLeft_mm(const GapReport& report) {
  const Remaining& remaining = report.remaining;
  if (remaining.high90) return signedRoot_mm(1e-6 * *remaining.high90 * remaining.excess2_before_mm2);
  return report.sequence.empty() ? std::nullopt : report.sequence.back().high90_mm;
}

/// "on places the fit did not see, what stands above the noise goes from 13 mm to 0.4 mm (0.6 mm at most, 95 % sure)".
std::string fallText(const GapReport& report) {
  const Remaining& remaining = report.remaining;
  const auto mm = [&](double fraction) {
    const double excess_mm = signedRoot_mm(1e-6 * fraction * remaining.excess2_before_mm2);
    return excess_mm > 0.0 ? shown(excess_mm) + " mm" : std::string("nothing");
  };
  std::string text = "on places the fit did not see, ";
  if (remaining.is_of_rotation) {
    text += shown(100.0 * remaining.fraction) + " % of the square of what stands above the noise in rotation is left (";
  } else {
    text += "what stands above the noise goes from " + mm(1.0) + " to " + mm(remaining.fraction) + " (";
  }
  if (remaining.is_of_rotation)
    return text + (remaining.high90 ? shown(100.0 * *remaining.high90) + " % at most, 95 % sure)" : kNotSure);
  const std::optional<double> most_mm = mostLeft_mm(report);
  if (!most_mm) return text + kNotSure;
  return text + (*most_mm > 0.0 ? shown(*most_mm) + " mm at most, 95 % sure)" : "95 % sure)");
}

std::string reservedText(const GapReport& report) {
  const std::optional<double>& most_left = report.remaining.high90;
  const bool is_most = !most_left || *most_left > identify::Thresholds{}.unexplained_left;
  return ", as far as these places can tell; " + fallText(report) + ", so " +
         (is_most ? "more than half" : "a smaller part") + " may have another cause";
}

}  // namespace

double scatteredShare(const identify::GapSearch& search, const identify::GapRows& stated, const GapReport& report) {
  const identify::Thresholds& thresholds = search.thresholds();
  double share = shareAbove(search.placingSd_m(), identify::worstPlacing_m(stated, thresholds),
                            1e-3 * report.position_rms_mm, thresholds);
  if (report.orientation_rms_deg)
    share = std::max(share, shareAbove(search.placingSd_rad(), identify::worstPlacing_rad(stated, thresholds),
                                       *report.orientation_rms_deg / kDegPerRad, thresholds));
  return share;
}

bool hasGap(const identify::GapSearch& search, const Judgement& judgement, double scattered_share) {
  const identify::Thresholds& thresholds = search.thresholds();
  const std::vector<identify::TriedEffect>& first = judgement.selection.first;
  const bool is_any_sure = std::any_of(first.begin(), first.end(), [&](const auto& one) {
    return one.is_refined && one.bic_gain > thresholds.sure_unselected;
  });
  return !judgement.selection.ways.empty() || scattered_share > 0.0 || is_any_sure || !judgement.far.strays.empty() ||
         search.structureOfNone().p_value < thresholds.sure_of_structure ||
         judgement.unnamed_nats > thresholds.sure_nats;
}

GapVerdict verdictOf(const HowFar& far, bool has_effect, bool has_gap, const identify::Thresholds& thresholds) {
  if (!has_effect) return has_gap ? GapVerdict::kUnexplained : GapVerdict::kNoGap;
  // Where no interval can be told nothing is sure: the figure itself must do.
  const double surely_left = far.remaining().low90.value_or(far.remaining().value);
  if (surely_left > thresholds.unexplained_left) return GapVerdict::kUnexplained;
  return surely_left > thresholds.partly_left ? GapVerdict::kPartlyExplained : GapVerdict::kExplained;
}

bool decide(const identify::GapSearch& search, const Judgement& judgement, std::optional<bool> known_gap,
            GapReport& report) {
  const identify::GapRows& rows = search.physics().rows();
  describeWhere(search, judgement.selection.model.model, report);
  report.floor_position_mm = 1e3 * std::sqrt(judgement.far.floor_m2);
  if (rows.has_orientation) report.floor_orientation_deg = kDegPerRad * std::sqrt(judgement.far.floor_rad2);
  const double scattered = std::max(scatteredShare(search, rows, report), judgement.far.strays_share);
  const bool has_gap = known_gap.value_or(hasGap(search, judgement, scattered));
  report.candidates = describeCandidates(search, judgement, has_gap, scattered);
  report.verdict = verdictOf(judgement.far, !judgement.selection.ways.empty(), has_gap, search.thresholds());
  return has_gap;
}

std::string shown(double value) {
  const double size = std::abs(value);
  const double scale = size >= 10.0 ? 1.0 : size >= 1.0 ? 10.0 : 100.0;
  return formatNumber(std::round(value * scale) / scale + 0.0);  // Never minus nothing.
}

std::string whyRefused(const Judgement& judgement) {
  switch (judgement.refusal) {
    case Refusal::kNone:
      return "";
    case Refusal::kForetellsNoBetter:
      return namesText(judgement.refused) +
             " would fit, but a smooth field without a name foretells places not seen as well, and " +
             (judgement.refused.size() > 1 ? "several causes at once must be far likelier than that" : "is as likely");
    case Refusal::kSmallShare:
      return namesText(judgement.refused) + " would fit, but takes only " + shown(100.0 * judgement.named_share) +
             " % of what a smooth field without a name takes beside it";
  }
  return "";
}

std::string verdictText(const GapReport& report, const std::string& thing) {
  const std::string gap = gapText(report);
  switch (report.verdict) {
    case GapVerdict::kNoGap:
      return "No " + thing + ": the recording agrees with the simulation within its noise (" +
             plainText(report.position_rms_mm, report.floor_position_mm, "mm") + ").";
    case GapVerdict::kExplained:
      return "The " + thing + " (" + gap + ") is explained by: " + causesText(report) +
             (isSurelyExplained(report) ? "; " + fallText(report) : reservedText(report)) + ".";
    case GapVerdict::kPartlyExplained:
      return "The " + thing + " (" + gap + ") is partly explained by: " + causesText(report) + "; " + fallText(report) +
             ", the rest has another cause.";
    case GapVerdict::kUnexplained:
      if (!report.selected.empty()) {
        return "There is a " + thing + " (" + gap + ") that no known effect explains; the nearest is " +
               causesText(report) + ": " + fallText(report) + ".";
      }
      if (!report.not_looked_for.empty())
        return "There is a " + thing + " (" + gap + "); its cause is not looked for: " + report.not_looked_for + ".";
      return "There is a " + thing + " (" + gap + ") that no known effect explains" +
             (report.rival.why.empty() ? "." : ": " + report.rival.why + ".");
  }
  return {};
}

}  // namespace fieldtrue::gap
