#pragma once

#include <array>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "calib/identify/search.h"
#include "calib/identify/smooth_field.h"

namespace fieldtrue::identify {

/// What one or more recordings read of one kind, positions [m] or rotations [rad], beside their own alignments.
struct FieldReadings {
  std::vector<FieldPoint> points;
  Eigen::MatrixX3d values;        ///< Tracked minus modelled, n x 3.
  Eigen::VectorXd variances;      ///< Of noise and placing together, each component.
  Eigen::VectorXd rig_variances;  ///< Of placing alone: the most that the rig itself may err by at a place.
  std::vector<int> places;        ///< Readings of equal number were taken at one place of one rig.
  std::vector<char> is_later;     ///< Of the later of two recordings.
  std::vector<char> sees_change;  ///< Whether it sees what the later recording alone sees: as is_later, if not dealt.
  /// What refitting the alignments would add to the values, per metre or radian: n x 3 each. Of each recording come
  /// first three shifts (not of rotations), then three turns about the tracker's origin, then three of each mount.
  std::vector<Eigen::MatrixX3d> free;
  std::size_t free_of_earlier = 0;  ///< How many of `free` are the earlier one's, of two recordings.

  std::size_t size() const { return points.size(); }
  FieldReadings only(std::span<const std::size_t> rows) const;
};

/// The readings of a recording beside an alignment; places are numbered as its table numbers them.
FieldReadings readingsOf(const GapSearch& search, const GapAlignment& alignment, bool rotation);
/// An earlier and a later recording as one.
/// @param places_of_later of each reading of the later one: the number of the earlier one's place, or one of its own
FieldReadings joined(const FieldReadings& earlier, const FieldReadings& later, std::span<const int> places_of_later);

/// How two recordings of one field hang together.
struct SharedLaw {
  SmoothLaw field;
  double rig_share = 0.0;                           ///< Of the placing's variance: the same at each visit of a place.
  std::array<double, 2> noise_factor = {1.0, 1.0};  ///< On the SD stated, of the earlier and of the later recording.

  double noiseFactor(bool of_later) const { return noise_factor[of_later ? 1 : 0]; }
};

/// What only the later recording sees: a smooth field, of a place and its surroundings alone where it has a reach.
struct ChangeLaw {
  SmoothLaw field;
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();
  double reach_m = std::numeric_limits<double>::infinity();  ///< From the middle, where e^-1/2 of its size is left.
};
double covariance(const ChangeLaw& law, const FieldPoint& a, const FieldPoint& b);

/// Readings of one or two recordings as a field that both share, seen through noise and their own alignments; and,
/// where asked for, a field that only the later one sees.
/// @source Rasmussen and Williams 2006, equations 2.30 and 2.45 (explicit basis functions under a wide prior)
class SharedField {
 public:
  /// @param change of the field that only the later recording sees; none = nothing changed
  SharedField(const FieldReadings& readings, const SharedLaw& law, const std::optional<ChangeLaw>& change = {});

  double logEvidence() const { return log_evidence_; }
  /// How much of each of FieldReadings::free there is.
  const Eigen::VectorXd& refitted() const { return refitted_; }
  /// What the earlier recording would have read at a place, its alignment apart, and how uncertain that is.
  /// @param place as in FieldReadings::places; -1 = one where it was not
  Eigen::Vector3d sharedAt(const FieldPoint& point, int place) const;
  double sharedVarianceAt(const FieldPoint& point, int place) const;
  /// What only the later recording saw.
  Eigen::Vector3d changeAt(const FieldPoint& point) const;
  /// Variances of a change along its own directions, each over what else scatters there.
  Eigen::ArrayXd visibilityOf(const ChangeLaw& change) const;

 private:
  /// The alignments, and the density of the readings under them.
  void refit();
  Eigen::VectorXd sharedWith(const FieldPoint& point, int place) const;

  const FieldReadings& readings_;
  SharedLaw law_;
  std::optional<ChangeLaw> change_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::MatrixX3d weights_;
  Eigen::VectorXd refitted_;
  double log_evidence_ = 0.0;
};

}  // namespace fieldtrue::identify
