#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/gap/judgement.h"
#include "calib/gap/report.h"

namespace fieldtrue::gap {

struct ReplicateOptions {
  int wanted = 50;
  int fewest = 20;        ///< Made however long they take.
  double most_s = 600.0;  ///< No more are begun after that.
  std::uint64_t seed = 1;
  int most_effects = 4;
};

using BelievedEffects = std::function<std::vector<std::unique_ptr<field::PhysicalEffect>>()>;

/// The recording made again under what was found: the same places in the same order, the effects, the smooth rest
/// without a name, and noise drawn anew by the law that the residuals follow; each diagnosed as this one was. Then half
/// as many under the runner-up.
/// @param candidates of the report, best first
/// @source parametric bootstrap: Efron and Tibshirani 1993, An Introduction to the Bootstrap, section 6.5
Replicates replicate(const identify::GapSearch& search, const Judgement& judgement,
                     const std::vector<GapCandidate>& candidates, const BelievedEffects& believed,
                     const ReplicateOptions& options, const RunControl& control);

}  // namespace fieldtrue::gap
