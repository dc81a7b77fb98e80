#include "calib/exporters/lattice_arrays.h"

#include <cmath>

namespace fieldtrue::exporters {
namespace {

constexpr double kEven = 1e-6;       ///< Of a step.
constexpr double kLeastNorm = 1e-6;  ///< Of a quaternion.

}  // namespace

LatticeArrays LatticeArrays::of(const LatticeField& field) {
  LatticeArrays arrays;
  const LatticePoints& points = field.points;
  for (int axis = 0; axis < 3; ++axis)
    for (int level = 0; level < points.counts[static_cast<std::size_t>(axis)]; ++level)
      arrays.axes_m[static_cast<std::size_t>(axis)].push_back(points.origin_m[axis] + level * points.pitch_m[axis]);
  for (int i = 0; i < points.counts[0]; ++i)
    for (int j = 0; j < points.counts[1]; ++j)
      for (int k = 0; k < points.counts[2]; ++k) {
        const std::size_t at = points.at(i, j, k);
        arrays.raw_m.push_back(points.point_m(i, j, k));
        arrays.corrected_m.emplace_back(arrays.raw_m.back() + field.displacement_m[at]);
        arrays.q.push_back(field.rotation[at]);
        arrays.uncertainty_m.push_back(field.uncertainty_m[at]);
        arrays.inside.push_back(field.inside[at]);
      }
  return arrays;
}

Result<LatticeField> LatticeArrays::lattice() const {
  LatticeField field;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<double>& levels_m = axes_m[axis];
    const auto a = static_cast<Eigen::Index>(axis);
    if (levels_m.size() < 2) return fail(ErrorCode::kBadInput, "each axis needs two levels");
    const double pitch_m = (levels_m.back() - levels_m.front()) / static_cast<double>(levels_m.size() - 1);
    for (std::size_t level = 0; level < levels_m.size(); ++level)
      if (!(std::abs(levels_m[level] - levels_m.front() - static_cast<double>(level) * pitch_m) < kEven * pitch_m))
        return fail(ErrorCode::kBadInput, "the levels along an axis are not evenly spaced");
    field.points.origin_m[a] = levels_m.front();
    field.points.pitch_m[a] = pitch_m;
    field.points.counts[axis] = static_cast<int>(levels_m.size());
  }
  if (corrected_m.size() != field.points.size())
    return fail(ErrorCode::kBadInput, std::to_string(corrected_m.size()) + " points do not fill a lattice of " +
                                          std::to_string(field.points.size()));
  field.displacement_m.resize(corrected_m.size());
  const bool is_turned = q.size() == corrected_m.size();
  if (is_turned) field.rotation.resize(q.size());
  for (std::size_t i = 0; is_turned && i < q.size(); ++i)
    if (!(q[i].norm() > kLeastNorm) || !q[i].coeffs().allFinite())
      return fail(ErrorCode::kBadInput, "the turn of point " + std::to_string(i) + " is no quaternion");
  if (!inside.empty() && inside.size() != corrected_m.size())
    return fail(ErrorCode::kBadInput, "it tells of " + std::to_string(inside.size()) +
                                          " points whether they lie inside, and has " +
                                          std::to_string(corrected_m.size()));
  field.inside.resize(inside.size());
  std::size_t next = 0;
  for (int i = 0; i < field.points.counts[0]; ++i)
    for (int j = 0; j < field.points.counts[1]; ++j)
      for (int k = 0; k < field.points.counts[2]; ++k) {
        const std::size_t at = field.points.at(i, j, k);
        field.displacement_m[at] = corrected_m[next] - field.points.point_m(i, j, k);
        if (is_turned) field.rotation[at] = q[next].normalized();
        if (!inside.empty()) field.inside[at] = inside[next];
        ++next;
      }
  return field;
}

LatticeForm arraysForm(double bytes_per_point) {
  LatticeForm form;
  form.unit = "metres";
  form.bytes_per_point = bytes_per_point;
  form.with_rotation = true;
  form.with_uncertainty = true;
  return form;
}

}  // namespace fieldtrue::exporters
