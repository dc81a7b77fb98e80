#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/identify/linearized_model.h"
#include "calib/identify/origin.h"
#include "calib/identify/refine.h"

namespace fieldtrue::identify {

/// What a model's residuals still hold that smooth physics could make, whatever its name: gradients of regular solid
/// harmonics (anything outside the grid), the transmitter's and the sensor's coils, a bent rig, a drift in time. No
/// noise level needs to be known: it is what this flexible fit leaves.
struct Structure {
  ResidualScale scale;     ///< Of the whitened residuals that are left: 1 where the stated noise is right.
  double energy = 0.0;     ///< Sum of squares that it explains beyond what noise alone would, in noise variances.
  double energy_sd = 0.0;  ///< Of that sum when there is nothing to explain.
  double p_value = 1.0;    ///< F test (Paulson 1942).
  int n_parameters = 0;
  GapOrigin origin;            ///< Shares by Shapley's rule over the four groups.
  std::vector<Vector6d> left;  ///< Whitened residuals after the flexible fit, by row, widened alike.
  /// The same, each row widened by its own leverage: the expected square is that of its noise, also where rows that
  /// stand out were given little weight.
  /// @source MacKinnon & White 1985, J. Econometrics 29 305 (HC2)
  std::vector<Vector6d> noise;
};

/// @param with_origin whether to split the energy by origin (16 fits instead of one)
Structure findStructure(const Linearized& at, const GapRows& rows, bool with_origin);

/// Robust scale of the first three components, 1 where they are normal with unit variance.
double normalScaleOf(std::span<const Vector6d> left);

/// Gradients of the regular solid harmonics of degree 1 to `degree` at a place: degree (degree + 2) columns.
/// @param p place over a length of the order of the region, from its middle
Eigen::Matrix3Xd harmonicGradients(const Eigen::Vector3d& p, int degree);

}  // namespace fieldtrue::identify
