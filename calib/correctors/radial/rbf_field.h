#pragma once

#include <Eigen/Core>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/core/json_reader.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/radial/rbf_kernels.h"

namespace fieldtrue::correctors {

/// Coordinates in which a smooth field is fitted: u = per_m * axes^T (p - center), dimensionless. In a plane the third
/// is 0 everywhere: the field does not change along the normal.
struct FieldFrame {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  Eigen::Vector3d per_m = Eigen::Vector3d::Ones();
  int dimension = 3;

  /// Centred on the places, in units of `unit_m`: tracker axes in a volume, principal axes in a plane.
  static FieldFrame around(std::span<const Eigen::Vector3d> p_m, int dimension, double unit_m);

  Eigen::Vector3d local(const Eigen::Vector3d& p_m) const {
    return per_m.cwiseProduct(axes.transpose() * (p_m - center_m));
  }
  /// Matrix of the linear tail: rows places, columns 1, u, v and, in a volume, w.
  Eigen::MatrixXd tail(std::span<const Eigen::Vector3d> p_m) const;

  nlohmann::json toJson() const;
  static FieldFrame fromJson(const JsonReader& json);
};

/// Root mean squared distance of places from their mean [m]; 1 where they are all at one point.
double rmsSpread_m(std::span<const Eigen::Vector3d> p_m);

/// What multiplies kernels and tail: one column an output.
struct RadialSolution {
  Eigen::MatrixXd coefficients;  ///< One row a centre.
  Eigen::MatrixXd tail;          ///< One row a column of FieldFrame::tail.
};

/// A vector field d(p) = sum_j c_j phi(|u - u_j|) + t_0 + t_1 u + t_2 v + t_3 w with three outputs.
class RadialField {
 public:
  /// @param c2 shape c^2 of the multiquadrics in the frame's units
  RadialField(RadialKernel kernel, double c2, const FieldFrame& frame, std::span<const Eigen::Vector3d> centers_m,
              const RadialSolution& solution);

  Eigen::Vector3d value(const Eigen::Vector3d& p_m) const;
  /// d value / d p [1/m]: rows outputs, columns coordinates.
  Eigen::Matrix3d gradient(const Eigen::Vector3d& p_m) const;
  /// phi(|u - u_j|) of every centre.
  Eigen::VectorXd kernelValues(const Eigen::Vector3d& p_m) const;

  RadialKernel kernel() const { return kernel_; }
  const FieldFrame& frame() const { return frame_; }
  const std::vector<Eigen::Vector3d>& centers_m() const { return centers_m_; }

  nlohmann::json toJson() const;
  static RadialField fromJson(const JsonReader& json);

 private:
  RadialArrays arrays(std::size_t start, std::size_t count) const;

  RadialKernel kernel_;
  double c2_;
  FieldFrame frame_;
  std::vector<Eigen::Vector3d> centers_m_;
  std::vector<double> x_, y_, z_;  ///< Centres in the frame.
  Eigen::Matrix<double, Eigen::Dynamic, 3> coefficients_;
  Eigen::Matrix<double, 4, 3> tail_;
};

/// phi between all places, in the lower triangle.
Eigen::MatrixXd kernelMatrix(RadialKernel kernel, double c2, const FieldFrame& frame,
                             std::span<const Eigen::Vector3d> p_m);

/// Names of the kernels in files and settings.
std::string toText(RadialKernel kernel);
std::optional<RadialKernel> radialKernelFrom(const std::string& text);

/// Variance of each place's displacement, per axis [m2]: of its mean reading, averaged over its visits, and of placing,
/// which all its visits share. All 0 where the table states neither; a place that states no noise of its own gets the
/// median of the others.
Eigen::VectorXd placeNoise_m2(const FitData& data, const Places& places);

}  // namespace fieldtrue::correctors
