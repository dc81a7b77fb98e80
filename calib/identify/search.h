#pragma once

#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/core/run_control.h"
#include "calib/identify/joint_fit.h"
#include "calib/identify/structure.h"

namespace fieldtrue::identify {

/// One way to fit one effect.
struct EffectWay {
  const effects::Effect* effect = nullptr;
  std::shared_ptr<const effects::EffectFit> fit;
  bool needs_time = false;  ///< Held out by blocks of time, not of space.
};

/// Whether the rig's tolerance is taken as stated or as the flexible fit of the residuals shows it.
enum class NoiseFrom { kResiduals, kStated };

/// What is common to all models of one recording, and the search among them.
class GapSearch {
 public:
  /// @param rows outlives the search
  GapSearch(const GapRows& rows, std::vector<std::unique_ptr<field::PhysicalEffect>> believed,
            NoiseFrom noise = NoiseFrom::kResiduals, const Thresholds& thresholds = {}, const RunControl& control = {});
  GapSearch(const GapSearch&) = delete;
  GapSearch& operator=(const GapSearch&) = delete;

  const GapPhysics& physics() const { return physics_; }
  const Thresholds& thresholds() const { return thresholds_; }
  /// Decides by others from here on; noise and alignment depend on none.
  void decideBy(const Thresholds& thresholds) { thresholds_ = thresholds; }
  const Whitening& whitening() const { return whitening_; }
  const ResidualLaw& law() const { return law_; }
  std::span<const EffectWay> ways() const { return ways_; }
  /// Where a model without the effect that bends the readings most is looked at from when effects are added to it: its
  /// own alignment follows the bent readings; what stands in its place is that of the likeliest single effect.
  GapModel seenFrom(const GapModel& model) const;
  std::span<const int> spaceBlocks() const { return space_blocks_; }
  std::span<const int> timeBlocksOfRows() const { return time_blocks_; }
  const RefinedModel& none() const { return none_; }
  const Structure& structureOfNone() const { return structure_; }
  /// Whitened residuals that a flexible fit leaves, by row: beside the likeliest single effect where readings are bent
  /// strongly, for a flexible fit alone does not follow such an effect.
  std::span<const Vector6d> noiseLeft() const { return noise_left_; }
  const effects::FitDesign& design() const { return design_; }
  double placingSd_m() const { return placing_sd_m_; }
  double placingSd_rad() const { return placing_sd_rad_; }
  /// RMS over the rows of the noise that the whitening takes positions to have: one whitened unit [mm].
  double whitenedUnit_mm() const;
  /// What of the placing counts as noise: no more than a person with a jig errs by, or than what is stated a good deal
  /// too small.
  double floorPlacingSd_m() const;
  double floorPlacingSd_rad() const;
  /// How far readings lie from where they should without any further effect, median, as a share of the spread of the
  /// sensors' places (RMS about their middle).
  double shareAstray() const;
  /// Whether readings are of their places at all: no sensor's are mirror images of them, and half of them lie near.
  bool belongTogether() const;

  /// Criterion of a model, and its parameters fitted together from a start.
  /// @param used per row, which rows count; empty = all
  double bicOf(const GapModel& model, std::span<const char> used = {}) const;
  /// What was asked for before is known.
  GapModel fitted(const GapModel& start, std::span<const char> used = {}) const;
  RefinedModel withCovariance(const GapModel& fitted) const;
  RefinedModel refined(const GapModel& start) const { return withCovariance(fitted(start)); }
  /// All but one parameter refitted, counted as in RefinedModel::covariance.
  GapModel fittedWithout(const GapModel& start, Eigen::Index frozen) const;

 private:
  enum class Channel { kPosition, kRotation };
  struct Known {
    GapModel start;
    std::vector<char> used;
    GapModel fitted;
  };

  Structure settleNoise(RefinedModel& about);
  double placingFrom(Channel channel, double present) const;
  void settleWays();
  std::optional<GapModel> settleVantage(const RunControl& control);
  bool isBent(const GapModel& model) const;
  std::vector<GapModel> simplestBesideAlignment(const RunControl& control) const;

  const GapRows& rows_;
  Thresholds thresholds_;
  GapPhysics physics_;
  std::vector<int> space_blocks_;
  std::vector<int> time_blocks_;
  double placing_sd_m_ = 0.0;
  double placing_sd_rad_ = 0.0;
  Whitening whitening_;
  ResidualLaw law_;
  RefinedModel none_;
  GapAlignment vantage_;  ///< Of the likeliest single effect where readings are bent strongly, else of no effect.
  Structure structure_;
  std::vector<Vector6d> noise_left_;
  std::vector<field::SensorSetting> settings_;
  effects::FitDesign design_;
  std::vector<EffectWay> ways_;
  mutable std::mutex known_mutex_;
  mutable std::list<Known> known_;  ///< Of fitted(); the parts of a diagnosis ask for many models more than once.
};

}  // namespace fieldtrue::identify
