#pragma once

#include <array>
#include <vector>

#include "calib/correctors/base/fit_data.h"

namespace fieldtrue::bench {

/// A grid of places over two metres, shaken and bent as a tracker would. The same for us and for every peer.
/// @param n places along each axis
correctors::FitData bentGrid(int n);

/// A grid whose tracked positions stand on it exactly and whose truth is bent, with grid index and orientation, so that
/// every method of the registry can be fitted to it.
correctors::FitData straightGrid(const std::array<int, 3>& counts);

/// Seeded points in the grids.
std::vector<Eigen::Vector3d> pointsWithin(std::size_t count);

}  // namespace fieldtrue::bench
