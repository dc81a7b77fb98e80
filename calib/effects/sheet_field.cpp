#include "calib/effects/sheet_field.h"

#include <cmath>

#include "calib/core/clones.h"

namespace fieldtrue::effects {
namespace {

/// Adds a vector of one place, times the strength of each coil.
FIELDTRUE_INLINE void add(double x, double y, double z, const double* strength, std::size_t place, std::size_t count,
                          double* __restrict sum) {
  for (std::size_t coil = 0; coil < 3; ++coil) {
    sum[coil * count + place] += x * strength[coil];
    sum[(3 + coil) * count + place] += y * strength[coil];
    sum[(6 + coil) * count + place] += z * strength[coil];
  }
}

}  // namespace

FIELDTRUE_CLONES
void addDipole(const SheetSource& source, const SheetField& field) {
  const double* __restrict x_m = field.x_m;
  const double* __restrict y_m = field.y_m;
  const double* __restrict z_m = field.z_m;
  double* __restrict sum = field.per_m3;
  const double strength[3] = {source.strength[0], source.strength[1], source.strength[2]};
  const double at_x = source.x_m, at_y = source.y_m;
  const std::size_t count = field.count;
  FIELDTRUE_STEPS_APART
  for (std::size_t i = 0; i < count; ++i) {
    const double dx = x_m[i] - at_x, dy = y_m[i] - at_y, dz = z_m[i];
    const double r2 = dx * dx + (dy * dy + dz * dz);
    const double per_r5 = 1.0 / (r2 * r2 * std::sqrt(r2));
    const double thrice = 3.0 * dz;
    add(per_r5 * (thrice * dx), per_r5 * (thrice * dy), per_r5 * (thrice * dz - r2), strength, i, count, sum);
  }
}

FIELDTRUE_CLONES
void addCharge(const SheetSource& source, const SheetField& field) {
  const double* __restrict x_m = field.x_m;
  const double* __restrict y_m = field.y_m;
  const double* __restrict z_m = field.z_m;
  double* __restrict sum = field.per_m3;
  const double strength[3] = {source.strength[0], source.strength[1], source.strength[2]};
  const double at_x = source.x_m, at_y = source.y_m;
  const std::size_t count = field.count;
  FIELDTRUE_STEPS_APART
  for (std::size_t i = 0; i < count; ++i) {
    const double dx = x_m[i] - at_x, dy = y_m[i] - at_y, dz = z_m[i];
    const double r2 = dx * dx + (dy * dy + dz * dz);
    const double per_r3 = 1.0 / (r2 * std::sqrt(r2));
    add(per_r3 * dx, per_r3 * dy, per_r3 * dz, strength, i, count, sum);
  }
}

}  // namespace fieldtrue::effects
