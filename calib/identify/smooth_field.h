#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

namespace fieldtrue::identify {

/// Where, how turned and when a reading was taken: all that a field without a name may depend on.
struct FieldPoint {
  Eigen::Vector3d place_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond turned = Eigen::Quaterniond::Identity();
  double time_s = 0.0;
};

/// How a field without a name varies. Sizes are SDs of each component, in the unit of what it describes.
struct SmoothLaw {
  double length_m = 1.0;  ///< Over which it varies from place to place.
  double time_s = 1.0;    ///< Over which it varies in time.
  double far_m = 1.0;     ///< Over which what varies in time varies from place to place.
  double by_place = 0.0;
  double by_turn = 0.0;  ///< Of the part that depends on place and on the sensor's turn together.
  double by_time = 0.0;

  bool isNothing() const { return by_place == 0.0 && by_turn == 0.0 && by_time == 0.0; }
};

/// Of each component of such a field at two points.
double covariance(const SmoothLaw& law, const FieldPoint& a, const FieldPoint& b);

/// What a field may depend on in one recording.
struct SmoothParts {
  bool turn = false;  ///< The sensor was turned in more than one way.
  bool time = false;
};

/// A smooth field of three components that nobody names: the sum of a part by place, one by place and turn, and one by
/// time, each a Gaussian process with Matern's kernel of order 5/2, seen through noise. It is the rival of every cause:
/// what it foretells needs no physics.
/// @source Rasmussen and Williams 2006, Gaussian Processes for Machine Learning, equations 2.23, 2.30 and 4.17; the
/// part by turn is a Gaussian of the chordal distance of rotations, so that q and -q are one
class SmoothField {
 public:
  /// @param values n x 3
  /// @param variances n, of the noise of each row's components
  SmoothField(std::vector<FieldPoint> points, const Eigen::MatrixX3d& values, const Eigen::VectorXd& variances,
              const SmoothLaw& law);

  Eigen::Vector3d at(const FieldPoint& point) const;
  /// Log of the density of the values, parameters of the law given.
  double logEvidence() const { return log_evidence_; }

 private:
  std::vector<FieldPoint> points_;
  SmoothLaw law_;
  Eigen::MatrixX3d weights_;
  double log_evidence_ = 0.0;
};

/// The law under which the values are likeliest, by turns over lengths and sizes on a grid of factors of two; of many
/// rows an even choice is taken.
SmoothLaw likeliestLaw(std::span<const FieldPoint> points, const Eigen::MatrixX3d& values,
                       const Eigen::VectorXd& variances, const SmoothParts& parts);

/// Every k-th of n indices such that at most `most` are left.
std::vector<std::size_t> evenChoice(std::size_t n, std::size_t most);

}  // namespace fieldtrue::identify
