#include "calib/gap/report.h"

#include "calib/gap/verdict.h"
#include "calib/identify/thresholds.h"

namespace fieldtrue::gap {

std::string_view idOf(GapVerdict verdict) {
  switch (verdict) {
    case GapVerdict::kNoGap:
      return "no_gap";
    case GapVerdict::kExplained:
      return "explained";
    case GapVerdict::kPartlyExplained:
      return "partly_explained";
    case GapVerdict::kUnexplained:
      return "unexplained";
  }
  return {};
}

std::string_view idOf(Shape shape) {
  switch (shape) {
    case Shape::kUnclear:
      return "unclear";
    case Shape::kBody:
      return "body";
    case Shape::kFlatOrLoop:
      return "flat_or_loop";
    case Shape::kLongConductor:
      return "long_conductor";
    case Shape::kIronBar:
      return "iron_bar";
    case Shape::kIronSheet:
      return "iron_sheet";
  }
  return {};
}

bool isNameless(const std::string& effect) {
  return effect == "none" || effect == kUnnamedSmooth || effect == kUnnamedScattered;
}

bool isSurelyExplained(const GapReport& report) {
  const identify::Thresholds thresholds;
  const Remaining& left = report.remaining;
  return !report.selected.empty() && left.low90 && left.high90 && *left.high90 <= thresholds.partly_left &&
         *left.high90 - *left.low90 <= thresholds.unexplained_left - thresholds.partly_left;
}

std::string howFarOffText(const GapReport& report) {
  const Remaining& left = report.remaining;
  return "Half of the readings that no fit saw lie off by less than " + shown(left.p50_mm) +
         " mm, 90 % of them by less than " + shown(left.p90_mm) + " mm, 95 % by less than " + shown(left.p95_mm) +
         " mm, and the worst, " + report.names.of(left.worst_node) + ", by " + shown(left.worst_mm) +
         " mm; noise alone would be " + shown(report.floor_position_mm) + " mm RMS.";
}

}  // namespace fieldtrue::gap
