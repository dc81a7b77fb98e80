#pragma once

#include <span>
#include <string>
#include <vector>

#include "calib/core/run_control.h"
#include "calib/identify/selection.h"
#include "calib/identify/unnamed.h"

namespace fieldtrue::gap {

/// What a fit that did not see a row's place leaves of that row.
struct UnseenRow {
  double square_m2 = 0.0;    ///< Of the position's residual.
  double square_rad2 = 0.0;  ///< Of the rotation's.
  double whitened = 0.0;     ///< Over all channels, in units of the noise.
};

/// One row each, by fits without it.
struct UnseenScores {
  std::vector<std::vector<UnseenRow>> step;  ///< With the first 0, 1, ... effects that the fold's own rows chose.
  std::vector<UnseenRow> smooth;             ///< With a field without a name in place of effects.
  std::vector<UnseenRow> both;               ///< With the effects, and such a field for what they leave.
};

/// The laws of the field without a name, alone and beside the selected effects.
struct RivalLaws {
  identify::UnnamedLaws alone;
  identify::UnnamedLaws beside;
};

/// Folds of places drawn by lot, by row: what lies between places that were seen.
std::vector<int> scatteredBlocks(const identify::GapRows& rows);

/// Refits with each block of places left out: the alignment anew, the effects chosen and searched anew by the rows that
/// are left, as many as were selected at most.
/// @param blocks of each row, 0..n-1
UnseenScores scoreUnseen(const identify::GapSearch& search, const identify::EffectSelection& selection,
                         const identify::UnnamedRival& rival, const RivalLaws& laws, std::span<const int> blocks,
                         const RunControl& control);

}  // namespace fieldtrue::gap
