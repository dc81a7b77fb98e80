#include "calib/gap/report.h"

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

}  // namespace fieldtrue::gap
