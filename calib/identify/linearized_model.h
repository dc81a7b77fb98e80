#pragma once

#include <Eigen/Core>
#include <limits>
#include <span>
#include <vector>

#include "calib/identify/model.h"

namespace fieldtrue::identify {

/// Orthonormal columns that span the given ones; as many as are independent, none for none.
Eigen::MatrixXd spanOf(Eigen::MatrixXd columns);

/// Turns a row's residual into one of unit variance per channel, as far as the noise is known.
struct Whitening {
  std::vector<Eigen::Matrix3d> position;  ///< Inverse Cholesky factor [1/m], per row.
  std::vector<double> rotation;           ///< [1/rad], per row.
};
Whitening makeWhitening(const GapRows& rows, double placing_sd_m, double placing_sd_rad);
/// Residuals [m, rad] in units of the noise.
std::vector<Vector6d> whitened(std::vector<Vector6d> residuals, const Whitening& whitening);

/// What is believable of a fit's linear parameters before any data: those of purely linear effects are about zero, as
/// far as is plausible; the only one of a searched effect lies within its bounds.
struct LinearPrior {
  Eigen::VectorXd precision;  ///< 1/variance, per parameter; 0 = anything.
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();

  double costOf(const Eigen::VectorXd& linear) const { return linear.cwiseAbs2().dot(precision); }
};
LinearPrior priorOf(const effects::EffectFit& fit);

/// Rows of one hold-out block, in the permuted order of a Linearized model.
struct Segment {
  Eigen::Index begin = 0;  ///< First residual.
  Eigen::Index count = 0;
};

/// Whether poses are moved so far that they do not follow the field linearly: by several times the noise, or at a tenth
/// of the rows by so much that what a linear model misses, about the share by which the field is bent, is noise and
/// more.
/// @param moved of each row
bool isBentStrongly(const GapRows& rows, std::span<const Vector6d> moved, const Whitening& whitening);

/// Where the tracker's response is taken: at the model's pose, or, where poses are bent by many times their noise, half
/// way from there to the reported one. What is half way follows the noise: a flexible fit would explain the noise by
/// it.
enum class ResponseAt { kModel, kHalfWayIfBent };

/// A model linearised about its present state: whitened residuals and what each parameter does to them. Rows are sorted
/// by hold-out block. Behind them stand as many residuals as the alignment's stated tolerances give; they belong to no
/// block.
class Linearized {
 public:
  /// @param block of each row, 0..n-1
  /// @param predicted GapPhysics::predictions of the state; empty = not known yet
  Linearized(const GapPhysics& physics, const GapModel& state, const Whitening& whitening, std::span<const int> block,
             ResponseAt response = ResponseAt::kModel, std::vector<Pose> predicted = {});

  /// The same with other residuals, whitened and sorted as residual() is: "what if the readings showed this?"
  Linearized withResidual(Eigen::VectorXd residual) const;

  Eigen::Index size() const { return residual_.size(); }
  const Eigen::VectorXd& residual() const { return residual_; }
  /// Alignment, mounting, and the terms of the state: linear parameters and searched ones.
  const Eigen::MatrixXd& nuisance() const { return nuisance_; }
  std::span<const Segment> segments() const { return segments_; }
  std::span<const field::SensorSetting> settings() const { return settings_; }  ///< Permuted.
  std::span<const std::size_t> order() const { return order_; }                 ///< Row at each permuted place.
  int channels() const { return channels_; }
  int nAlignment() const { return n_alignment_; }

  /// d residual / d linear parameter, whitened, sign such that residual ~ columns * x.
  Eigen::MatrixXd columns(const effects::EffectFit& fit, const Eigen::VectorXd& searched) const;
  /// The same for responses given per row and parameter, the parameter running fastest.
  Eigen::MatrixXd columnsOf(std::span<const field::EffectResponse> responses, Eigen::Index parameters) const;

 private:
  void addAlignment(const GapRows& rows, const GapAlignment& alignment);
  void addTerms(const GapModel& state);
  void bend(const GapPhysics& physics, const GapModel& state, std::span<const Pose> reported);
  template <int kColumns>
  Eigen::Matrix<double, 6, kColumns> whiteOf(std::size_t k, const Eigen::Matrix<double, 6, kColumns>& change) const;
  Eigen::Matrix<double, 6, 1> whitenedPlacing(std::size_t k, const field::EffectResponse& response) const;

  int channels_ = 6;
  int n_alignment_ = 0;
  std::vector<std::size_t> order_;
  std::vector<field::SensorSetting> settings_;
  std::vector<Eigen::Matrix3d> white_position_;
  std::vector<double> white_rotation_;
  std::vector<Eigen::Matrix<double, 6, 9>> white_by_field_;
  std::vector<Eigen::Matrix<double, 6, 6>> white_by_placing_;  ///< Empty: what moves the sensor is reported as it is.
  std::vector<Segment> segments_;
  Eigen::Index n_prior_ = 0;
  Eigen::VectorXd residual_;
  Eigen::MatrixXd nuisance_;
};

/// Applies one step of the alignment's parameters (as ordered in Linearized::nuisance) to it.
/// @param center_m the rotation's fixed point, tracker frame
void applyAlignmentStep(const Eigen::VectorXd& step, const Eigen::Vector3d& center_m, const GapRows& rows,
                        GapAlignment& alignment);
/// Keeps an alignment that the rig states within what its tolerances allow; true where it had to be moved.
bool keepNearStated(const GapRows& rows, const Eigen::Vector3d& center_m, GapAlignment& alignment);
/// Minus twice the log likelihood of an alignment by the rig's stated tolerances; 0 where it states none.
double alignmentCost(const GapPhysics& physics, const GapAlignment& alignment);
/// How far an alignment that the rig states is from what it stated: shift of the centre [m], then rotation [rad].
Vector6d alignmentDeviation(const GapAlignment& alignment, const GapRows& rows, const Eigen::Vector3d& center_m);
/// Fixed point of the alignment's rotation: the middle of the places in the tracker frame.
Eigen::Vector3d alignmentCenter_m(std::span<const field::SensorSetting> settings);

}  // namespace fieldtrue::identify
