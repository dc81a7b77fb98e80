#pragma once

#include <array>
#include <vector>

#include "calib/exporters/lattice_export.h"

namespace fieldtrue::exporters {

/// A lattice along the axes as numerical programs want it: the levels of each axis, and arrays over them, z fastest.
struct LatticeArrays {
  std::array<std::vector<double>, 3> axes_m;
  std::vector<Eigen::Vector3d> raw_m;
  std::vector<Eigen::Vector3d> corrected_m;
  std::vector<Eigen::Quaterniond> q;
  std::vector<double> uncertainty_m;
  std::vector<char> inside;

  static LatticeArrays of(const LatticeField& field);
  /// From the levels, `corrected_m` and, where they are there, `q` and `inside`. @error kBadInput where the levels are
  /// not evenly spaced, or the sizes differ
  Result<LatticeField> lattice() const;
};

/// What these formats share; write and read are left to the format.
LatticeForm arraysForm(double bytes_per_point);

}  // namespace fieldtrue::exporters
