#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "calib/core/run_control.h"
#include "calib/identify/linearized_model.h"

namespace fieldtrue::identify {

/// The best places of one fit's coarse grid.
struct ScanResult {
  struct Start {
    Eigen::VectorXd searched;
    double gain = 0.0;  ///< Fall of the sum of squares, all rows.
  };
  std::vector<Start> best;            ///< Of all rows, best first, at most `kept`.
  std::vector<Start> without_block;   ///< Best by the rows outside each hold-out block.
  std::vector<double> held_out_gain;  ///< Fall of the held-out sum of squares of each block, at that start.
};

/// The starts of such a fit moved to the given centres, one for each of its other coarse values.
std::vector<Eigen::VectorXd> startsAt(const effects::EffectFit& fit, std::span<const Eigen::Vector3d> centers_m);

/// Tries starts of fits, their linear parameters and those of a linearised model refitted, on all rows and with each
/// block held out: the cross products of each block are summed once, so a hold-out costs no pass over the rows.
class Scanner {
 public:
  /// @param at outlives it
  explicit Scanner(const Linearized& at);

  /// @param kept how many starts are told, of all rows
  ScanResult scan(const effects::EffectFit& fit, std::vector<Eigen::VectorXd> starts, std::size_t kept,
                  const RunControl& control) const;

  /// Fall of the held-out sum of squares over all blocks where each block's other rows settle the searched parameters
  /// themselves, from the given ones: what the coarse grid is too coarse to tell.
  double heldOutGainFrom(const effects::EffectFit& fit, const Eigen::VectorXd& searched) const;

 private:
  class Products;
  std::shared_ptr<const Products> products_;
};

}  // namespace fieldtrue::identify
