#pragma once

#include <array>
#include <vector>

#include "calib/core/run_control.h"
#include "calib/correctors/baked/baked_lattice.h"

namespace fieldtrue::correctors {

/// The box that a lattice's cells fill.
struct LatticeBox {
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_m = Eigen::Vector3d::Zero();
};

/// Cells along each axis that fill a box, at least one, and coefficients they need in all.
std::array<int, 3> latticeCellsFor(const LatticeBox& box, double spacing_m);
double latticeCoefficientsFor(const LatticeBox& box, double spacing_m);

/// Samples a correction on the lattice of a box and turns the samples into coefficients. The note is left empty.
/// @param with_uncertainty samples its uncertainty too
/// @error kCancelled
Result<LatticeParts> sampleLattice(const PositionModel& model, const LatticeBox& box, double spacing_m,
                                   bool with_uncertainty, const RunControl& control);

}  // namespace fieldtrue::correctors
