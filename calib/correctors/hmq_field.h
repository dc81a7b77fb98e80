#pragma once

#include <Eigen/Core>
#include <new>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "calib/core/error.h"
#include "calib/core/run_control.h"

namespace fieldtrue {

/// Puts an array where a cache line begins, so that no register's worth of it lies across two.
template <class T>
struct CacheLineAllocator {
  using value_type = T;
  static constexpr std::align_val_t kAlignment{64};

  CacheLineAllocator() = default;
  template <class U>
  explicit CacheLineAllocator(const CacheLineAllocator<U>&) {}
  T* allocate(std::size_t count) { return static_cast<T*>(::operator new(count * sizeof(T), kAlignment)); }
  void deallocate(T* values, std::size_t) { ::operator delete(values, kAlignment); }
  bool operator==(const CacheLineAllocator&) const = default;
};

template <class T>
using AlignedVector = std::vector<T, CacheLineAllocator<T>>;

/// Hardy's multiquadric through values at scattered centres, without a polynomial tail: f(p) = sum_j alpha_j w_j(p),
/// w_j(p) = sqrt(|p - p_j|^2 + R^2).
/// @source Hardy 1971; Zachmann 1997; survey by Kindratenko, section 3.5, eq. 16-18
class MultiquadricField {
 public:
  /// Solves eq. 18.
  /// @param name stands in messages
  /// @param centers_m tracked positions, tracker frame [m]
  /// @param node place of each centre, for messages
  /// @param values one row a centre, one column an output
  /// @error kDegenerate when two centres coincide or rounding would exceed a micrometre; kUnsupported beyond 10,000
  ///        centres; kCancelled
  static Result<MultiquadricField> fit(const std::string& name, std::span<const Eigen::Vector3d> centers_m,
                                       std::span<const int> node, const Eigen::MatrixXd& values, double r2_m2,
                                       const RunControl& control);

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
  /// Throws nlohmann::json::exception for other JSON: call inside `guarded`.
  static MultiquadricField fromJson(const nlohmann::json& json, std::size_t outputs);

 private:
  MultiquadricField() = default;

  double r2_m2_ = 0.0;
  std::size_t outputs_ = 0;
  AlignedVector<double> x_m_, y_m_, z_m_;
  std::vector<AlignedVector<double>> alpha_;  ///< One array an output.
};

/// A field of three outputs in single precision, for speed: half the memory, twice the numbers in a register.
class SingleMultiquadricField {
 public:
  explicit SingleMultiquadricField(const MultiquadricField& field);

  /// f at many points.
  void value3(std::span<const Eigen::Vector3d> p_m, std::span<Eigen::Vector3d> f) const;

  /// Largest difference from the field in double precision at its centres and at seeded points of their bounding box.
  double largestDeviation(const MultiquadricField& field, std::size_t n_points) const;

 private:
  Eigen::Vector3d origin_m_ = Eigen::Vector3d::Zero();
  float r2_m2_ = 0.0F;
  AlignedVector<float> x_m_, y_m_, z_m_, alpha_x_, alpha_y_, alpha_z_;
};

}  // namespace fieldtrue
