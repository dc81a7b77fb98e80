#pragma once

#include <nlohmann/json_fwd.hpp>

namespace fieldtrue::testing {

struct StudyOptions {
  int seeds = 20;
  int threads = 1;
  int stride = 1;  ///< Of the grid; above 1 only for a quick look.
};

/// Every method in the six rooms, its error against the simulator's exact truth and against places of the jig; what
/// cross-validation on the fit nodes picks among the survey's methods and among those that came after. Prints Markdown
/// tables on stdout and progress on stderr.
nlohmann::json accuracyStudy(const StudyOptions& options);

/// How often calibrations made on one half of the places and judged on a quarter are applied to the real recordings of
/// anser_duplo (left out without FIELDTRUE_REAL_DATA) and to the mixed room, and how often wrongly: without a gain on
/// the quarter that neither had seen.
nlohmann::json applyStudy(const StudyOptions& options);

}  // namespace fieldtrue::testing
