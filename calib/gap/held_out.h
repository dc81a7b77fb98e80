#pragma once

#include <optional>
#include <vector>

#include "calib/identify/search.h"

namespace fieldtrue::gap {

/// How the gap shrinks on places that no fit saw, as each effect of a selection is added. All numbers are whitened:
/// mean squares per channel in units of the noise's.
struct HeldOutGap {
  double before = 0.0;              ///< Mean square of the gap beyond noise, no effect.
  std::vector<double> after;        ///< With the first 1, 2, ... effects.
  std::vector<double> after_low90;  ///< Places drawn anew (bootstrap).
  std::vector<double> after_high90;
  double before_low90 = 0.0;
  double before_high90 = 0.0;
  double left = 0.0;     ///< Mean square of structure that the last model leaves.
  double left_sd = 0.0;  ///< Of that number when nothing is left.

  double fractionAfter(std::size_t effects) const;  ///< Amplitude left over amplitude before.
};

/// Sum of the squares that a model leaves, whitened.
double whitenedSquares(const identify::GapSearch& search, const identify::GapModel& model);

/// Refits the whole sequence with each block of places held out, every searched parameter searched anew.
/// @param structure of the residuals of the full model
HeldOutGap holdOut(const identify::GapSearch& search, const identify::EffectSelection& selection,
                   const identify::Structure& structure, const RunControl& control);

/// Share of the explained sum of squares of each selected effect, averaged over the orders of adding.
/// @source Shapley 1953, Contributions to the Theory of Games II 307
std::vector<double> creditShares(const identify::GapSearch& search, const identify::EffectSelection& selection);

}  // namespace fieldtrue::gap
