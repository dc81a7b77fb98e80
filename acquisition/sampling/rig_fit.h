#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "calib/core/calibration_table.h"

namespace fieldtrue::acquisition {

/// The finished takes held against one rigid rig, in spite of wrong ones among them.
///
/// Takes that belong together lie, moved rigidly, near their places. A bent field moves neighbours alike, so a take is
/// judged by what its neighbours leave, not by how far it is off: what it is off beyond them may be a part of the pitch
/// and three times the neighbours' own scatter. A sensor that stood at another place is off by a pitch at least.
class RigFit {
 public:
  RigFit() = default;
  /// @param done finished takes; skipped ones are left out
  /// @param pitch_m distance between neighbouring places
  /// @param known the relation, where it is a fact; otherwise it is fitted so that most takes agree
  RigFit(std::span<const Node> done, double pitch_m, const std::optional<Pose>& known = {});

  /// At least 4 takes, not on one line, most of which agree: good enough to say where a sensor stands.
  bool usable() const { return usable_; }
  const Pose& reference_from_tracker() const { return reference_from_tracker_; }

  /// How far a reading is from a place, less what the takes around the place are off [m].
  double off_m(const Eigen::Vector3d& tracked_m, const Eigen::Vector3d& true_m) const;
  /// How far a reading may be off there before it does not fit [m].
  double limit_m(const Eigen::Vector3d& true_m) const;

  struct Misfit {
    std::size_t take;  ///< Number among the finished takes, skipped ones not counted.
    double off_m;
  };
  /// The takes that do not fit the others.
  std::vector<Misfit> misfits() const;

 private:
  struct Around {
    Eigen::Vector3d bend_m = Eigen::Vector3d::Zero();  ///< What the takes nearby are off, their median.
    double scatter_m = 0.0;                            ///< How much they differ in that.
    double nearest_m = 0.0;
  };
  Around around(const Eigen::Vector3d& true_m, std::optional<std::size_t> without) const;
  double limitOf(const Around& around) const;
  void fitMost();
  void setResiduals();

  std::vector<Eigen::Vector3d> tracked_m_, true_m_;
  std::vector<Eigen::Vector3d> residual_m_;
  Pose reference_from_tracker_;
  double pitch_m_ = 0.3;
  double typical_m_ = 0.0;  ///< Median residual.
  bool usable_ = false;
};

}  // namespace fieldtrue::acquisition
