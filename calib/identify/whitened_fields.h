#pragma once

#include <cstddef>

namespace fieldtrue::identify {

/// Rows of a recording and what parameters change at each: pointers into what its owner keeps.
struct FieldChanges {
  const double* white_by_field;  ///< Of each row a 6x9 matrix, column-major: whitened pose by field.
  const double* field_per_m3;    ///< Of each row and parameter a 3x3 matrix, column-major, `stride` numbers apart.
  std::size_t stride;
  std::size_t n_rows;
  std::size_t n_parameters;
  std::size_t n_channels;  ///< 3 or 6 numbers a row that count.
};

/// Writes the whitened changes of the pose: a column for each parameter, `leading` numbers apart, rows one after the
/// other.
void whitenFields(const FieldChanges& changes, double* columns, std::size_t leading);

}  // namespace fieldtrue::identify
