#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/core/calibration_table.h"
#include "calib/core/pose.h"

namespace fieldtrue::calibration {

/// A row that lies off what the rows about it make of its place: a jig set down beside its mark, a reading gone astray,
/// a mark of another place.
struct OutlyingRow {
  std::size_t row = 0;
  double off_m = 0.0;   ///< From the middle of what the rows about it are off by.
  double square = 0.0;  ///< Of that, in units of the variance an axis that it was held against.
};

/// Rows that stand apart, by more than one place in a million does of a normal law; of few rows by 7.7 SDs, unless half
/// of them lie as near as the stated tolerance lets them. A field is smooth: it moves the places about a place alike,
/// or they differ among each other too. Where the other rows show one, or more than a tenth lie far off, only a row
/// that is far beyond what a field does from place to place is told, or none.
/// @param jig_tolerance_m SD per axis of placing, where it is stated
std::vector<OutlyingRow> outlyingRows(std::span<const Node> nodes, const Pose& reference_from_tracker,
                                      std::optional<double> jig_tolerance_m);

/// How much the square of each row counts in the alignment; empty where all count alike, since no row stands apart.
/// Where the other rows show a field, those that stand apart count less; where they show none, every row counts as a
/// Student t law of four degrees of freedom says of how far off it lies: what takes a few far off takes others less
/// far.
/// @source Lange, Little and Taylor 1989, J. Am. Stat. Assoc. 84 881 (t weights)
std::vector<double> alignmentWeights(std::span<const Node> nodes, const Pose& reference_from_tracker,
                                     std::optional<double> jig_tolerance_m);

/// Which places these are, what was made of them and what to do; "" where there are none.
/// @param is_fitted whether the alignment was, else it was known
std::string outlyingNote(std::span<const Node> nodes, const Pose& reference_from_tracker,
                         std::optional<double> jig_tolerance_m, bool is_fitted);

}  // namespace fieldtrue::calibration
