#pragma once

#include <Eigen/Core>
#include <array>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <vector>

#include "calib/core/json_reader.h"
#include "calib/correctors/radial/rbf_field.h"

namespace fieldtrue::correctors {

/// The 64 (in a plane 16) basis functions that are not zero at a position.
struct SplineWeights {
  std::array<Eigen::Index, 64> index{};
  std::array<double, 64> value{};
  int count = 0;
};

/// A lattice of uniform cubic B-splines, one a knot, over a box in a frame [m].
class SplineLattice {
 public:
  /// The box of the places, cut into spans of about `span_m` along every axis, at least one.
  static SplineLattice around(std::span<const Eigen::Vector3d> p_m, const FieldFrame& frame, double span_m);

  Eigen::Index size() const;
  const FieldFrame& frame() const { return frame_; }
  const std::array<int, 3>& spans() const { return spans_; }
  /// Basis functions at a position of the frame inside the box. @param order 0 value, 1 slope, for each axis
  SplineWeights weights(const Eigen::Vector3d& u_m, const std::array<int, 3>& order) const;
  /// The nearest position in the box.
  Eigen::Vector3d clamped(const Eigen::Vector3d& u_m) const { return u_m.cwiseMax(low_m_).cwiseMin(high_m_); }
  /// Squared second differences of the coefficients along each axis and, twice, mixed ones, over powers of the spans:
  /// the bending energy, which is 0 for linear fields only.
  /// @source Eilers, Marx 1996; Duchon 1977 for the mixed terms
  Eigen::MatrixXd bendingPenalty() const;

  nlohmann::json toJson() const;
  static SplineLattice fromJson(const JsonReader& json);

 private:
  Eigen::Index functionsAlong(int axis) const;
  double span_m(int axis) const;

  FieldFrame frame_;
  Eigen::Vector3d low_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_m_ = Eigen::Vector3d::Ones();
  std::array<int, 3> spans_{1, 1, 1};  ///< 0 along the normal of a plane.
};

/// Field of a lattice and its coefficients about a linear trend, with three outputs; beyond the box it goes on as it
/// leaves it.
class SplineField {
 public:
  /// @param trend rows 1, u, v and, in a volume, w of the frame
  SplineField(SplineLattice lattice, const Eigen::MatrixXd& coefficients, const Eigen::MatrixXd& trend);

  Eigen::Vector3d value(const Eigen::Vector3d& p_m) const;
  /// d value / d p [1/m]: rows outputs, columns coordinates.
  Eigen::Matrix3d gradient(const Eigen::Vector3d& p_m) const;

  nlohmann::json toJson() const;
  static SplineField fromJson(const JsonReader& json);

 private:
  Eigen::Vector3d sum(const Eigen::Vector3d& u_m, const std::array<int, 3>& order) const;

  SplineLattice lattice_;
  Eigen::Matrix<double, 3, Eigen::Dynamic> coefficients_;  ///< One column a basis function.
  Eigen::Matrix<double, 4, 3> trend_;
};

}  // namespace fieldtrue::correctors
