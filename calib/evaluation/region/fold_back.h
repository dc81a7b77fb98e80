#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/calibration/corrector.h"

namespace fieldtrue::evaluation {

/// One probe of the map over the calibrated volume.
struct FoldBackCell {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();  ///< True position, reference frame [m].
  double size_m = 0.0;                                 ///< Edge of the cube it stands for.
  /// Of d tracked / d true: 0 or below, the field folds back and no correction is unique; far below 1, readings hardly
  /// change with the place and the correction multiplies their noise.
  double determinant = 1.0;
  double condition = 1.0;  ///< Ratio of its largest to smallest singular value.
  bool one_to_one = true;
  bool is_near_fold = false;  ///< One to one, but its determinant is small, by more than jig and noise explain.
  std::vector<int> nodes;     ///< Places at the corners of the cell, where it is a cell of the grid.
};

/// How many of what was looked at fold back.
struct FoldCount {
  std::size_t n_folded = 0;
  std::size_t n_judged = 0;
  /// No room of known physics and no real recording comes near a quarter.
  bool isTooMany() const { return 4 * n_folded > n_judged; }
};

/// Whether the tracked position determines the true one over the volume.
/// @source survey by Kindratenko, section 2.3
struct FoldBack {
  std::vector<FoldBackCell> cells;
  int n_folded = 0;
  int n_near_fold = 0;
  /// Of the measured places, where they make no cell of a grid but span a volume: places, and those around which the
  /// linear map from the true positions of the nearest ones to their readings turns them inside out.
  int n_places = 0;
  int n_places_folded = 0;
  double worst_condition = 1.0;
  std::optional<double> smallest_determinant;             ///< Of the field: the cells of the grid; none without any.
  std::optional<double> smallest_correction_determinant;  ///< Of the points between the places; none without any.
  std::string text;                                       ///< One sentence, with the worst cell named.
};

/// Grid cells judged by the measured nodes themselves (sign of the Jacobian of true to tracked at the eight corners and
/// the centre); and, between the nodes, the corrector's Jacobian on a lattice.
/// @param corrector its table is what is judged
FoldBack foldBackOf(const calibration::Corrector& corrector);

/// Of the measured places themselves: cells of the grid, or places where they make none.
FoldCount foldsOfPlaces(const FoldBack& fold_back);
/// Of the correction: points between the places.
FoldCount foldsOfCorrection(const FoldBack& fold_back);
/// The correction sends different readings to one place, and nothing of the measured places does.
bool foldsByItself(const FoldBack& fold_back);

nlohmann::json toJson(const FoldBack& fold_back);

}  // namespace fieldtrue::evaluation
