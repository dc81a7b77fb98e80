#pragma once

#include <cstddef>
#include <span>

namespace fieldtrue::correctors {

/// A cubic B-spline on a lattice, as plain arrays. Coefficient (i, j, k) is four floats, three of a displacement [m]
/// and one more, at 4 (k + counts[2] (j + counts[1] i)); it belongs to origin + spacing (i, j, k). The spline stands
/// where all 64 coefficients around a position are there: from 1 to counts - 2 along each axis.
struct LatticeArrays {
  const float* coefficients = nullptr;
  double origin_m[3] = {0.0, 0.0, 0.0};
  double spacing_m = 1.0;
  int counts[3] = {0, 0, 0};  ///< At least 4 each.
};

/// Values of the spline at many points, with two continuous derivatives. Points beside the lattice take the value of
/// its nearest edge.
/// @param p_m points one after the other, x y z [m]
/// @param values out, four numbers a point
void latticeValues(const LatticeArrays& lattice, const double* p_m, std::size_t n_points, float* values);

/// The cell that holds a coordinate along one axis, kept within the lattice, and where in it.
/// @return index of the coefficient at the cell's lower face, from 1 to counts - 3
int latticeCell(const LatticeArrays& lattice, int axis, double x_m, double* fraction);

/// One way to compute latticeValues, for one instruction set.
struct LatticeKernel {
  const char* name = "";
  void (*values)(const LatticeArrays&, const double*, std::size_t, float*) = nullptr;
};

/// Those that this processor can run, fastest first; the last one, `plain`, runs everywhere.
std::span<const LatticeKernel> latticeKernels();

}  // namespace fieldtrue::correctors
