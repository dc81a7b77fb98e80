#pragma once

#include <optional>
#include <span>
#include <vector>

#include "calib/gap/unseen.h"
#include "calib/identify/structure.h"

namespace fieldtrue::gap {

/// A figure with the 90 % interval that drawing other places would give it; an end that cannot be told is unset.
struct Bounded {
  double value = 0.0;
  std::optional<double> low90;
  std::optional<double> high90;
};

/// Which share of the recorded region each place stands for.
std::vector<double> regionShares(const identify::GapRows& rows);

/// How far the gap shrinks, as every figure, sentence and picture has it: mean squares over the recorded region, from
/// places that no fit saw, less the floor's, signed, by one estimator at the start and after each effect.
struct HowFar {
  double floor_m2 = 0.0;           ///< Mean square that noise and placing alone would give.
  double floor_rad2 = 0.0;         ///< 0 where there are no orientations.
  std::vector<Bounded> excess_m2;  ///< With the first 0, 1, ... effects.
  std::vector<Bounded> excess_rad2;
  std::vector<Bounded> left_of_start;   ///< Excess with the first 0, 1, ... effects over that without any.
  std::vector<Bounded> left_of_before;  ///< Over that with one effect fewer.
  bool by_rotation = false;             ///< The shares are of rotations, because only these stand out of the floor.
  double whitened_excess = 0.0;         ///< At the start, sum over rows and channels, in units of the noise.
  std::vector<double> size_m;           ///< Of the position's residual with all effects, by row.
  std::vector<std::size_t> strays;      ///< As of RowNoise.
  double strays_share = 0.0;            ///< Of the squares without any effect, theirs.

  const Bounded& remaining() const { return left_of_start.back(); }
};

/// Mean squares of what the flexible fit of everything smooth leaves of each row: noise, whatever its law.
struct RowNoise {
  std::vector<double> square_m2;
  std::vector<double> square_rad2;
  std::vector<double> whitened;
  /// Rows that lie farther off any smooth fit than noise of this law puts them: for noise what is allowed stands there.
  std::vector<std::size_t> strays;
};

/// No more of it is noise than GapSearch::floorPlacingSd_m and _rad allow; of readings that do not belong to their
/// places, which no smooth fit follows, as much as these allow is.
/// @param structure of a model's residuals
RowNoise noiseLeftBy(const identify::GapSearch& search, const identify::Structure& structure);

/// sign(x) sqrt|x| of a mean square, in mm.
double signedRoot_mm(double square_m2);

HowFar howFar(const UnseenScores& scores, const RowNoise& noise, const identify::GapRows& rows);

/// Mean of rows' values over the region, each place by the share of it that it stands for.
double meanOverRegion(const identify::GapRows& rows, const std::vector<double>& values);

/// Mean over places of a paired difference, with its 90 % interval by Student's t.
/// @param first, second one value a row
Bounded pairedDifference(const std::vector<UnseenRow>& first, const std::vector<UnseenRow>& second,
                         const identify::GapRows& rows);

/// The 90 % interval of a ratio of two means over places.
/// @source Fieller 1954, J. R. Stat. Soc. B 16 175
Bounded ratioOfMeans(std::span<const double> numerators, std::span<const double> denominators);

}  // namespace fieldtrue::gap
