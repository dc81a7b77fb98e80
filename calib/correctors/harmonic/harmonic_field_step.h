#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calib/core/run_control.h"
#include "calib/correctors/harmonic/harmonic_field_evidence.h"
#include "calib/correctors/harmonic/harmonic_field_linear.h"
#include "calib/correctors/harmonic/harmonic_field_sites.h"

namespace fieldtrue::correctors {

/// Sources that a step has chosen.
struct Chosen {
  std::vector<Eigen::Index> sites;  ///< Into the candidates.
  std::vector<TensorAmplitudes> tensors;
  std::vector<double> variances;  ///< Prior variance of each tensor.
};

/// The linear model of one step, rows whitened, unknowns scaled so that each source moves the places by about its
/// amplitude.
struct Linearisation {
  Eigen::MatrixXd design;                          ///< d corrected / d amplitude, 3 rows a place.
  Eigen::Matrix<double, Eigen::Dynamic, 6> rigid;  ///< d corrected / d (shift, turn) that does the same to the truth.
  Eigen::VectorXd y;                               ///< True minus corrected, plus what the present amplitudes do.
  Eigen::VectorXd present_effect;                  ///< What the present amplitudes do.
  std::vector<double> scale;                       ///< Of each source: amplitude over tensor.
};

/// Candidates that stand among the places get columns of nothing, so that they are not chosen again.
/// @param chosen present sources, into the same sites
/// @param box of the places
/// @param center_m about which the truth turns
Linearisation linearised(std::span<const PlaceRow> rows, std::span<const Site> sites, const Chosen& chosen,
                         const Box& box, const Eigen::Vector3d& center_m, const RunControl& control);

/// What a selection among a step's columns stands for.
Chosen chosenBy(const GroupSelection& selection, const Linearisation& linear);

/// Prior variances of sources as a selection among a step's columns counts them.
std::vector<double> variancesIn(const Linearisation& linear, const Chosen& chosen);

/// Part of the way from one choice to another: the sources of both.
/// @param share of the way, 0 to 1
Chosen blended(const Chosen& before, const Chosen& after, double share);

}  // namespace fieldtrue::correctors
