#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calib/core/json_reader.h"
#include "calib/core/settings.h"
#include "calib/correctors/cells/hexahedral_cells.h"

namespace fieldtrue::correctors {

/// The weight functions by which the eight corners of a cell share in a correction.
enum class WeightKind {
  kBrysonLinear,        ///< Product of the distances to the other corners (eq. 10).
  kBrysonBump,          ///< exp(-d) up to d_max (eq. 10).
  kKindratenkoLinear,   ///< 1 - d / d_max (eq. 11).
  kKindratenkoSquares,  ///< 1 - d^2 / d_max^2 (eq. 11).
  kKindratenkoLog,      ///< -ln(d / d_max) (eq. 11).
  kBriggs,              ///< 1 / d^2 divided by the sum of the eight (eq. 13, normalised as it must have been meant).
  kBriggsAsPublished    ///< 1 / d^2 times the sum of d^2 (eq. 13 to the letter): adds up to 64 and more, not to 1.
};

struct WeightRule {
  WeightKind kind = WeightKind::kKindratenkoLinear;
  double length_unit_m = 0.3048;  ///< In which the bump's d is counted.
  std::optional<double> d_max_m;  ///< Of the bump; none = the smallest distance between two corners of the cell.
};

/// The lengths of a cell that the weights refer to.
struct CellLengths {
  double smallest_distance_m = 0.0;  ///< Between any two corners.
  double longest_diagonal_m = 0.0;   ///< Of the four through the cell.
};

CellLengths cellLengths(const HexahedralCells& cells, std::size_t cell);

/// Weights of the corners at distances from them.
///
/// They add up to 1, except those of kBriggsAsPublished. At a corner (within 1 nm) that corner has all the weight,
/// where the formula is infinite (kKindratenkoLog, kBriggs) and for all of Kindratenko's, whose d_max reaches past the
/// nearest corner in a flat cell. Where all weights vanish, such as in the centre of a cube with Kindratenko's, every
/// corner has one eighth.
/// @param d_m distance to each corner [m]
/// @source Kindratenko 2000, A survey of electromagnetic position tracker calibration techniques, section 3.3,
///         eq. 9-11 and 13
std::array<double, 8> cornerWeights(const WeightRule& rule, const CellLengths& lengths,
                                    const std::array<double, 8>& d_m);

/// `length_unit_m`, in which the bump's d is counted, default one foot: Bryson measured at every 12 inches and gives
/// no unit; in feet the distances in his cells are near 1, so that the weights fall by a factor of e over a cell.
Setting lengthUnitSetting();

/// `d_max_m`, where the bump's weights end; `auto` is the smallest distance between two corners of the cell, the
/// largest that Bryson allows.
Setting bumpEndSetting();

/// The kind of a name: linear, quadratic, log, bryson_linear, bryson_bump, briggs, briggs_as_published (FT_CHECK).
WeightKind weightKind(const std::string& name);

/// With the values of the two settings above, where they are among the settings.
WeightRule weightRule(WeightKind kind, const Settings& settings);

/// {"weights": name, "length_unit_m": number, "d_max_m": number or "auto"}
nlohmann::json toJson(const WeightRule& rule);
WeightRule weightRuleFrom(const JsonReader& json);

/// Says where a bump reaches past the nearest corner, so that the correction misses its places; empty when nowhere.
std::string bumpNote(const WeightRule& rule, const HexahedralCells& cells);

}  // namespace fieldtrue::correctors
