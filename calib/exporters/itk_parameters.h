#pragma once

#include <vector>

#include "calib/exporters/itk_field.h"

namespace fieldtrue::exporters {

/// A displacement field as ITK's transform files hold it: 18 fixed numbers (size, origin, spacing, direction by rows)
/// and the vectors, flat.
struct ItkParameters {
  static constexpr const char* kType = "DisplacementFieldTransform_double_3_3";

  std::vector<double> fixed;
  std::vector<double> parameters;

  static ItkParameters of(const ItkField& field);
  /// @error kBadInput
  Result<ItkField> field() const;
};

}  // namespace fieldtrue::exporters
