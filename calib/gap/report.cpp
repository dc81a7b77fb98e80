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

bool isNameless(const std::string& effect) {
  return effect == "none" || effect == kUnnamedSmooth || effect == kUnnamedScattered;
}

}  // namespace fieldtrue::gap
