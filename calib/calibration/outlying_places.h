#pragma once

#include <cstddef>
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
  double weight = 1.0;  ///< Of its square, as a Student t law of four degrees of freedom weighs it.
};

/// Rows that stand apart, by more than one place in a million does of a normal law, of few rows by 7.7 SDs. A field is
/// smooth: it moves the places about a place alike, or they differ among each other too. Where the other rows show one,
/// or more than a tenth lie far off, only a row that is far beyond what a field does from place to place is told, or
/// none.
/// @source Lange, Little and Taylor 1989, J. Am. Stat. Assoc. 84 881 (t weights)
std::vector<OutlyingRow> outlyingRows(std::span<const Node> nodes, const Pose& reference_from_tracker);

/// Which places these are, what was made of them and what to do; "" where there are none.
/// @param is_fitted whether the alignment was, else it was known
std::string outlyingNote(std::span<const Node> nodes, const Pose& reference_from_tracker, bool is_fitted);

}  // namespace fieldtrue::calibration
