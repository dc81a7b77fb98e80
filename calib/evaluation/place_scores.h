#pragma once

#include <span>
#include <utility>
#include <vector>

#include "calib/evaluation/candidate.h"

namespace fieldtrue::evaluation {

/// Scores and coverage of rows, gathered by place.
struct PlaceScores {
  std::vector<double> errors;               ///< RMS over the rows of a place.
  std::vector<Eigen::Vector3d> residual_m;  ///< Mean over them.
  std::vector<bool> covered;                ///< All of them.
};

/// @param places node numbers, in the order wanted
/// @param nodes, scores of each row; rows of places that are not wanted are left out
PlaceScores gatherByPlace(const std::vector<int>& places, std::span<const Node> nodes,
                          std::span<const RowScore> scores);

}  // namespace fieldtrue::evaluation
