#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "calib/core/error.h"
#include "calib/correctors/base/fit_data.h"

namespace fieldtrue::correctors {

/// The distinct places of fit data: visits of one place averaged, in order of first appearance.
struct Places {
  std::vector<Eigen::Vector3d> p_tracked_m;  ///< Mean over the visits, tracker frame [m].
  std::vector<Eigen::Vector3d> p_true_m;     ///< Mean over the visits, tracker frame [m].
  std::vector<int> node;
  std::vector<std::array<int, 3>> index;       ///< Grid index; empty when the places are scattered.
  std::vector<std::vector<std::size_t>> rows;  ///< Rows of the fit data that were averaged.

  std::size_t size() const { return node.size(); }
};

/// Groups rows with the same node number whose true positions agree within 5 mm. Sensors of a bar that share a node
/// number but stand apart stay apart.
Places mergePlaces(const FitData& data);

/// Tracked and true positions of places: one row a place [m].
Eigen::MatrixXd positionMatrix(const Places& places);
Eigen::MatrixXd truthMatrix(const Places& places);

/// Levels of the grid along the axis that has fewest, of those with more than one; 0 where the places are on no grid.
int fewestLevels(const FitData& data);

/// What every fit asks of its data first: rows, and finite numbers in them.
/// @param method named in messages, e.g. "Affine fit"
/// @error kTooFewNodes without rows; kBadInput naming the place whose numbers are not finite
Result<void> checkPositions(const FitData& data, const std::string& method);

/// As checkPositions, and orientations are there and can be normalised.
/// @error kUnsupported without orientations
Result<void> checkOrientations(const FitData& data, const std::string& method);

/// @param dimension spread of the true positions
/// @error kDegenerate below 2
Result<void> checkSpread(const std::string& method, std::size_t n_places, int dimension);

/// What a method says about places that all lie in one plane.
std::string planeNote(const FitData& data, const std::string& how);

}  // namespace fieldtrue::correctors
