#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "calib/core/error.h"
#include "calib/core/run_control.h"

namespace fieldtrue {

/// Hardy's multiquadric through values at scattered centres, without a polynomial tail: f(p) = sum_j alpha_j w_j(p),
/// w_j(p) = sqrt(|p - p_j|^2 + R^2).
/// @source Hardy 1971; Zachmann 1997; survey by Kindratenko, section 3.5, eq. 16-18
class MultiquadricField {
 public:
  /// Solves eq. 18 by LU decomposition.
  /// @param name stands in messages
  /// @param centers_m tracked positions, tracker frame [m]
  /// @param node place of each centre, for messages
  /// @param values one row a centre, one column an output
  /// @error kDegenerate when two centres coincide or rounding would exceed a micrometre; kUnsupported beyond 10,000
  ///        centres; kCancelled
  static Result<MultiquadricField> fit(const std::string& name, std::span<const Eigen::Vector3d> centers_m,
                                       std::span<const int> node, const Eigen::MatrixXd& values, double r2_m2,
                                       const RunControl& control);

  std::size_t outputs() const { return outputs_; }
  /// f(p), one number an output. @param f length outputs()
  void value(const Eigen::Vector3d& p_m, std::span<double> f) const;
  /// f of three outputs at many points.
  void value3(std::span<const Eigen::Vector3d> p_m, std::span<Eigen::Vector3d> f) const;
  /// d f / d p of three outputs: rows outputs, columns coordinates.
  Eigen::Matrix3d gradient3(const Eigen::Vector3d& p_m) const;

  nlohmann::json toJson() const;
  /// Throws nlohmann::json::exception for other JSON: call inside `guarded`.
  static MultiquadricField fromJson(const nlohmann::json& json, std::size_t outputs);

 private:
  MultiquadricField() = default;
  const double* alpha(std::size_t output) const { return alpha_.data() + output * x_m_.size(); }

  double r2_m2_ = 0.0;
  std::size_t outputs_ = 0;
  std::vector<double> x_m_, y_m_, z_m_;
  std::vector<double> alpha_;  ///< Output after output.
};

}  // namespace fieldtrue
