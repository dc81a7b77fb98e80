#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "calib/core/error.h"
#include "calib/core/json_reader.h"
#include "calib/core/run_control.h"
#include "calib/correctors/base/fit_checks.h"

namespace fieldtrue::correctors {

/// Hardy's multiquadric through values at scattered centres, without a polynomial tail: f(p) = sum_j alpha_j w_j(p),
/// w_j(p) = sqrt(|p - p_j|^2 + R^2).
/// @source Hardy 1971; Zachmann 1997; survey by Kindratenko, section 3.5, eq. 16-18
class MultiquadricField {
 public:
  /// One number an output, the elements of a matrix at most; takes no memory from the heap, as no correction may.
  using Outputs = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 9, 1>;

  /// Solves eq. 18 at the tracked positions of places.
  /// @param name stands in messages
  /// @param values one row a place, one column an output
  /// @error kDegenerate when two places were tracked at one position or rounding would exceed a micrometre;
  ///        kUnsupported beyond 10,000 places; kCancelled
  static Result<MultiquadricField> fit(const std::string& name, const Places& places, const Eigen::MatrixXd& values,
                                       double r2_m2, const RunControl& control);

  /// Of coefficients found elsewhere.
  /// @param centers_m tracker frame, one row a centre [m]
  /// @param alpha one row a centre, one column an output
  MultiquadricField(Eigen::MatrixX3d centers_m, Eigen::MatrixXd alpha, double r2_m2);

  double r2_m2() const { return r2_m2_; }
  const Eigen::MatrixX3d& centers_m() const { return centers_m_; }
  const Eigen::MatrixXd& alpha() const { return alpha_; }

  /// f(p), one number an output.
  Outputs value(const Eigen::Vector3d& p_m) const;
  /// f(p) of three outputs.
  Eigen::Vector3d value3(const Eigen::Vector3d& p_m) const;
  /// d f / d p of three outputs: rows outputs, columns coordinates.
  Eigen::Matrix3d gradient3(const Eigen::Vector3d& p_m) const;

  nlohmann::json toJson() const;
  static MultiquadricField fromJson(const JsonReader& json, Eigen::Index outputs);

 private:
  Eigen::MatrixX3d centers_m_;
  Eigen::MatrixXd alpha_;
  double r2_m2_ = 0.0;
};

}  // namespace fieldtrue::correctors
