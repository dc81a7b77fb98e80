#include "calib/exporters/itk_parameters.h"

namespace fieldtrue::exporters {

ItkParameters ItkParameters::of(const ItkField& field) {
  ItkParameters itk;
  for (const int count : field.size) itk.fixed.push_back(count);
  for (const Eigen::Vector3d& v : {field.origin_mm, field.spacing_mm})
    itk.fixed.insert(itk.fixed.end(), v.begin(), v.end());
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) itk.fixed.push_back(field.direction(row, column));
  itk.parameters.reserve(3 * field.vectors_mm.size());
  for (const Eigen::Vector3d& v_mm : field.vectors_mm)
    itk.parameters.insert(itk.parameters.end(), v_mm.begin(), v_mm.end());
  return itk;
}

Result<ItkField> ItkParameters::field() const {
  constexpr std::size_t kFixed = 18;
  if (fixed.size() != kFixed || parameters.size() % 3 != 0)
    return fail(ErrorCode::kBadInput, "it needs 18 fixed parameters and three a point; there are " +
                                          std::to_string(fixed.size()) + " and " + std::to_string(parameters.size()));
  ItkField itk;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    if (!(fixed[axis] >= 1.0 && fixed[axis] < 1e6)) return fail(ErrorCode::kBadInput, "its sizes are out of range");
    itk.size[axis] = static_cast<int>(fixed[axis]);
    itk.origin_mm[a] = fixed[3 + axis];
    itk.spacing_mm[a] = fixed[6 + axis];
    for (std::size_t column = 0; column < 3; ++column)
      itk.direction(a, static_cast<Eigen::Index>(column)) = fixed[9 + 3 * axis + column];
  }
  for (std::size_t at = 0; at < parameters.size(); at += 3) itk.vectors_mm.emplace_back(&parameters[at]);
  return itk;
}

}  // namespace fieldtrue::exporters
