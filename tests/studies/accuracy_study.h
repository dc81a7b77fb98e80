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

/// How often calibrations made on one half of the places and judged on the other are wrongly applied to the real
/// recordings of anser_duplo (skipped without FIELDTRUE_REAL_DATA), and rightly to the mixed room.
nlohmann::json applyStudy(const StudyOptions& options);

}  // namespace fieldtrue::testing
