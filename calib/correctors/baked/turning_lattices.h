#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "calib/core/json_reader.h"
#include "calib/correctors/base/position_model.h"
#include "calib/correctors/radial/rbf_kernels.h"

namespace fieldtrue::correctors {

/// Functions of the orientation: a_r(q) = sum_j weights(j, r) kernel(chord(q, centers_j) / length_rad).
struct TurnBasis {
  RadialKernel kernel = RadialKernel::kMatern52;
  double length_rad = 1.0;
  std::vector<Eigen::Quaterniond> centers;
  Eigen::MatrixXd weights;
  Eigen::VectorXd mean;  ///< Of each function over the orientations that were fitted.

  static constexpr std::size_t kMostCenters = 256;
  static constexpr std::size_t kMostFunctions = 48;
  std::size_t size() const { return static_cast<std::size_t>(weights.cols()); }
  /// @param values out, size() of them; allocates nothing
  void evaluate(const Eigen::Quaterniond& q, double* values) const;
  nlohmann::json toJson() const;
  static TurnBasis fromJson(const JsonReader& json);
};

/// A correction that depends on how the sensor is turned, on lattices: a part that does not, and functions of position
/// that count as much as functions of the orientation say: d(p, q) = still(p) + sum_r a_r(q) turning_r(p).
class TurningLattices : public PositionModel {
 public:
  /// @param turning one a function of the basis, each a function of position
  TurningLattices(std::unique_ptr<PositionModel> still, std::vector<std::unique_ptr<PositionModel>> turning,
                  TurnBasis basis);

  bool takesOrientation() const override { return true; }
  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override;
  Eigen::Vector3d displacementAt_m(const Pose& tracked) const override;
  void correctPoses(std::span<const Pose> tracked, std::span<Eigen::Vector3d> p_corrected_m) const override;
  Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const override;
  /// As baked: of the mean over the orientations that were fitted.
  std::optional<double> uncertainty_m(const Eigen::Vector3d& p_tracked_m) const override {
    return still_->uncertainty_m(p_tracked_m);
  }
  bool covers(const Eigen::Vector3d& p_tracked_m) const override;
  std::string note() const override;
  nlohmann::json parameters() const override;

  static std::unique_ptr<PositionModel> fromJson(const JsonReader& parameters);

 private:
  std::unique_ptr<PositionModel> still_;
  std::vector<std::unique_ptr<PositionModel>> turning_;
  TurnBasis basis_;
};

}  // namespace fieldtrue::correctors
