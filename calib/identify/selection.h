#pragma once

#include <vector>

#include "calib/identify/ranking.h"

namespace fieldtrue::identify {

/// The effects that together explain a recording best, found by adding, exchanging and dropping.
struct EffectSelection {
  std::vector<TriedEffect> first;         ///< All effects on their own, best first.
  std::vector<TriedEffect> alternatives;  ///< To the leading selected effect, with the others present; best first.
  RefinedModel model;                     ///< With all selected effects; the one that counts most stands first.
  std::vector<std::size_t> ways;          ///< Of the terms.
  double bic_gain = 0.0;                  ///< Against no effect.
};

struct EffectSelectionOptions {
  int most_effects = 4;
};

EffectSelection selectEffects(const GapSearch& search, const EffectSelectionOptions& options,
                              const RunControl& control);

/// Which of the selected effects leads, and its alternatives, where effects were taken out since they were selected; as
/// selectEffects leaves them.
void rankAnew(const GapSearch& search, EffectSelection& selection, const RunControl& control);

}  // namespace fieldtrue::identify
