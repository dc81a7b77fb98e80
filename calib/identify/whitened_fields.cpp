#include "calib/identify/whitened_fields.h"

#include "calib/core/clones.h"

namespace fieldtrue::identify {

FIELDTRUE_CLONES
void whitenFields(const FieldChanges& changes, double* columns, std::size_t leading) {
  constexpr std::size_t kPosition = 3, kPose = 6, kField = 9;
  const std::size_t n_rows = changes.n_rows, n_parameters = changes.n_parameters, n_channels = changes.n_channels;
  for (std::size_t k = 0; k < n_rows; ++k) {
    const double* white = changes.white_by_field + kPose * kField * k;
    for (std::size_t j = 0; j < n_parameters; ++j) {
      const double* field = changes.field_per_m3 + changes.stride * (k * n_parameters + j);
      double sum[kPose] = {};
      for (std::size_t i = 0; i < kField; ++i)
        for (std::size_t r = 0; r < kPose; ++r) sum[r] += white[kPose * i + r] * field[i];
      double* out = columns + j * leading + k * n_channels;
      // Counted by constants: a call to copy a few numbers costs as much as their sums.
      for (std::size_t r = 0; r < kPosition; ++r) out[r] = sum[r];
      if (n_channels == kPose)
        for (std::size_t r = kPosition; r < kPose; ++r) out[r] = sum[r];
    }
  }
}

}  // namespace fieldtrue::identify
