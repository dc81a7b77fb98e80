#pragma once

#include <span>
#include <vector>

#include "calib/identify/search.h"
#include "calib/identify/smooth_field.h"

namespace fieldtrue::identify {

/// Laws of a field without a name: of positions [m] and, where the recording has them, of rotations [rad].
struct UnnamedLaws {
  SmoothLaw position;
  SmoothLaw rotation;
};

/// Where, how turned and when each row was taken, tracker frame.
std::vector<FieldPoint> fieldPoints(const GapSearch& search, const GapAlignment& alignment);
/// Of the noise and the placing of each row's components, m^2 or rad^2; more where a row stands far out of what the
/// flexible fit leaves.
Eigen::VectorXd noiseVariances(const GapSearch& search, bool rotation);

/// The smooth rival of all causes on one recording: it needs no physics, only that neighbours err alike.
class UnnamedRival {
 public:
  /// @param search outlives it
  explicit UnnamedRival(const GapSearch& search);

  /// @param residuals tracked minus modelled [m, rad], one per row
  UnnamedLaws likeliestLaws(std::span<const Vector6d> residuals) const;
  /// Log density of the residuals under noise and such a field; of many rows an even choice, scaled to all.
  double logEvidence(std::span<const Vector6d> residuals, const UnnamedLaws& laws) const;
  /// What such a field is at every row, by the residuals of all.
  std::vector<Vector6d> foretold(const UnnamedLaws& laws, std::span<const Vector6d> residuals) const;
  /// Takes away from the rows that are not used what the used ones foretell of them, by the law that these like best.
  void takeAway(std::span<const UnnamedLaws> laws, std::span<const char> used, std::vector<Vector6d>& residuals) const;

 private:
  Eigen::MatrixX3d valuesOf(std::span<const Vector6d> residuals, std::span<const std::size_t> rows,
                            bool rotation) const;
  Eigen::VectorXd variancesOf(std::span<const std::size_t> rows, bool rotation) const;
  std::vector<FieldPoint> pointsOf(std::span<const std::size_t> rows) const;

  const GapRows& rows_;
  std::vector<FieldPoint> points_;
  Eigen::VectorXd variance_m2_;
  Eigen::VectorXd variance_rad2_;
  SmoothParts parts_;
};

}  // namespace fieldtrue::identify
