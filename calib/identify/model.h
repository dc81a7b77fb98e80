#pragma once

#include <Eigen/Core>
#include <iterator>
#include <memory>
#include <span>
#include <vector>

#include "calib/effects/effect_row.h"
#include "calib/effects/registry.h"
#include "calib/identify/rows.h"

namespace fieldtrue::identify {

/// The rig in the tracker's frame, and the sensor in its holder: refitted inside every model, never an effect.
struct GapAlignment {
  Pose tracker_from_reference;
  /// Of each sensor: the rig's pose times this is the sensor's.
  std::vector<Pose> mount_from_sensor = std::vector<Pose>(1);
};

/// One fitted effect in a model.
struct GapTerm {
  const effects::Effect* effect = nullptr;
  std::shared_ptr<const effects::EffectFit> fit;
  Eigen::VectorXd searched;
  Eigen::VectorXd linear;
};

/// A model of the recording: alignment and effects.
struct GapModel {
  GapAlignment alignment;
  std::vector<GapTerm> terms;
};

/// Whether two models are the same, to the bit.
bool isSame(const GapModel& a, const GapModel& b);
/// Parameters of a model's terms, searched ones too; the alignment's do not count.
Eigen::Index parametersOf(const GapModel& model);
/// The model with one term fewer.
GapModel withoutTerm(GapModel model, std::size_t term);

/// What a tracker reports of rows, and how far the reports are from a model.
class GapPhysics {
 public:
  /// @param believed effects that the scene already has
  GapPhysics(const GapRows& rows, std::vector<std::unique_ptr<field::PhysicalEffect>> believed)
      : rows_(rows), believed_(std::make_move_iterator(believed.begin()), std::make_move_iterator(believed.end())) {}

  /// The same tracker at other rows, which outlive it.
  GapPhysics at(const GapRows& rows) const { return GapPhysics(believed_, rows); }

  const GapRows& rows() const { return rows_; }
  std::size_t size() const { return rows_.rows.size(); }
  std::vector<field::SensorSetting> settings(const GapAlignment& alignment) const;
  /// Sum of all effects' responses at the settings.
  std::vector<field::EffectResponse> responses(const GapModel& model,
                                               std::span<const field::SensorSetting> settings) const;
  /// Tracked minus modelled position [m] and rotation vector from modelled to tracked [rad], tracker frame, per row.
  /// Rows the model cannot solve get a residual of 1 m and 1 rad.
  std::vector<Vector6d> residuals(const GapModel& model) const { return residuals(predictions(model)); }
  std::vector<Vector6d> residuals(std::span<const Pose> predicted) const;
  std::vector<Pose> predictions(const GapModel& model) const;

 private:
  using Believed = std::vector<std::shared_ptr<const field::PhysicalEffect>>;
  GapPhysics(Believed believed, const GapRows& rows) : rows_(rows), believed_(std::move(believed)) {}

  const GapRows& rows_;
  Believed believed_;
};

/// Mean orientation of each sensor in its holder, an alignment of the rig given.
std::vector<Eigen::Quaterniond> meanMountings(const GapRows& rows, const Pose& tracker_from_reference);

/// The start of every search: rigid alignment of positions and the mean mounting.
GapAlignment initialAlignment(const GapRows& rows);

}  // namespace fieldtrue::identify
