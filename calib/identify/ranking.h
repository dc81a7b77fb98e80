#pragma once

#include <vector>

#include "calib/core/run_control.h"
#include "calib/identify/scan.h"
#include "calib/identify/search.h"

namespace fieldtrue::identify {

/// One effect tried on top of a model.
struct TriedEffect {
  std::size_t way = 0;  ///< Index into GapSearch::ways().
  GapModel model;
  bool is_refined = false;     ///< All parameters of the model are fitted together; else the new ones, linearised.
  double bic_gain = 0.0;       ///< Against the model without it.
  double held_out_gain = 0.0;  ///< Fall of the held-out sum of squares over all blocks, whitened.
  effects::FittedEffect fitted;
};

/// Every effect added to a model, best first; only the best way of each effect.
std::vector<TriedEffect> rankEffects(const GapSearch& search, const GapModel& base, const RunControl& control);

}  // namespace fieldtrue::identify
