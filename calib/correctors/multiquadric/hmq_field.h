#pragma once

#include <Eigen/Core>
#include <new>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "calib/core/error.h"
#include "calib/core/json_reader.h"
#include "calib/core/run_control.h"
#include "calib/correctors/numerics/aligned_vector.h"

namespace fieldtrue::correctors {

/// Hardy's multiquadric through values at scattered centres, without a polynomial tail: f(p) = sum_j alpha_j w_j(p),
/// w_j(p) = sqrt(|p - p_j|^2 + R^2).
/// @source Hardy 1971; Zachmann 1997; survey by Kindratenko, section 3.5, eq. 16-18
class MultiquadricField {
 public:
  /// Solves eq. 18.
  /// @param name stands in messages
  /// @param centers_m tracked positions, tracker frame [m]
  /// @param node place of each centre, for messages
  /// @param index its grid index; empty for scattered places
  /// @param values one row a centre, one column an output
  /// @error kDegenerate when two centres coincide or rounding would exceed a micrometre; kUnsupported beyond 10,000
  ///        centres; kCancelled
  static Result<MultiquadricField> fit(const std::string& name, std::span<const Eigen::Vector3d> centers_m,
                                       std::span<const int> node, std::span<const std::array<int, 3>> index,
                                       const Eigen::MatrixXd& values, double r2_m2, const RunControl& control);

  /// Of coefficients found elsewhere. @param alpha one row a centre, one column an output
  MultiquadricField(std::span<const Eigen::Vector3d> centers_m, const Eigen::MatrixXd& alpha, double r2_m2);

  std::size_t size() const { return x_m_.size(); }
  std::size_t outputs() const { return outputs_; }
  double r2_m2() const { return r2_m2_; }
  Eigen::Vector3d center_m(std::size_t j) const { return {x_m_[j], y_m_[j], z_m_[j]}; }
  const double* alpha(std::size_t output) const { return alpha_[output].data(); }

  /// f(p), one number an output. @param f length outputs()
  void value(const Eigen::Vector3d& p_m, std::span<double> f) const;
  /// f of three outputs at many points.
  void value3(std::span<const Eigen::Vector3d> p_m, std::span<Eigen::Vector3d> f) const;
  /// d f / d p of three outputs: rows outputs, columns coordinates.
  Eigen::Matrix3d gradient3(const Eigen::Vector3d& p_m) const;

  nlohmann::json toJson() const;
  static MultiquadricField fromJson(const JsonReader& json, std::size_t outputs);

 private:
  MultiquadricField() = default;

  double r2_m2_ = 0.0;
  std::size_t outputs_ = 0;
  AlignedVector<double> x_m_, y_m_, z_m_;
  std::vector<AlignedVector<double>> alpha_;  ///< One array an output.
};

}  // namespace fieldtrue::correctors
