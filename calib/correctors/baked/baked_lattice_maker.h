#pragma once

#include <memory>
#include <span>

#include "calib/core/run_control.h"
#include "calib/correctors/baked/baked_lattice.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::correctors {

/// Bakes a correction to a lattice whose spacing is refined until the largest deviation from the correction stays below
/// the bound by a fifth, at 20,000 seeded points of the region, at the places and at the centre of every cell.
///
/// The lattice spans the bounding box of the places and twice the region's margin. Its coefficients come from samples
/// by the five-point filter (1, -10, 54, -10, 1)/36 along each axis, so that every cubic polynomial is reproduced and a
/// sharp bend reaches no farther than the samples around it. Samples that the correction does not cover are continued
/// from those that it does. Where the finest lattice misses the bound in no more than a fiftieth of the region, those
/// cells are left out: the lattice does not cover them, and its note says how much they are.
/// @param region where the lattice must hold
/// @param places_m tracked positions of the fit
/// @param max_deviation_m bound of |baked - correction| [m]
/// @error kDegenerate without a region; kUnsupported when 2,000,000 coefficients (32 MB) do not reach the bound;
///        kCancelled
Result<std::unique_ptr<BakedLattice>> bakeLattice(const PositionModel& model, const Region& region,
                                                  std::span<const Eigen::Vector3d> places_m, double max_deviation_m,
                                                  const RunControl& control);

}  // namespace fieldtrue::correctors
