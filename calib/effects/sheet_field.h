#pragma once

#include <cstddef>

namespace fieldtrue::effects {

/// The field matrix of a plane sheet's sources at many places, in the sheet's own frame.
struct SheetField {
  const double* x_m;
  const double* y_m;
  const double* z_m;
  std::size_t count;  ///< Of places.
  double* per_m3;     ///< Nine runs of `count`, the matrix by rows.
};

/// A dipole along the sheet's normal, or a charge: where it lies in the sheet, and its strength for each transmitter
/// coil.
struct SheetSource {
  double x_m;
  double y_m;
  const double* strength;
};

/// Adds the field of a dipole.
void addDipole(const SheetSource& source, const SheetField& field);
/// Adds the field of a charge.
void addCharge(const SheetSource& source, const SheetField& field);

}  // namespace fieldtrue::effects
