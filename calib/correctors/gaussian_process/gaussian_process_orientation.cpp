#include "calib/core/json_reader.h"
#include "calib/core/statistics.h"
#include "calib/correctors/base/error_rotation.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/gaussian_process/gaussian_process.h"

namespace fieldtrue::correctors {
namespace {

class GaussianProcessOrientation : public ErrorRotationModel {
 public:
  /// @param vector_rad its displacement is the rotation vector of the error beyond q_mean
  GaussianProcessOrientation(ErrorFrame frame, const Eigen::Quaterniond& q_mean,
                             std::unique_ptr<PositionModel> vector_rad)
      : ErrorRotationModel(frame), q_mean_(q_mean), vector_rad_(std::move(vector_rad)) {}

  bool takesOrientation() const override { return vector_rad_->takesOrientation(); }
  std::string note() const override {
    return takesOrientation() ? "The error rotation is a function of the whole tracked pose." : "";
  }

 protected:
  Eigen::Quaterniond errorRotation(const Eigen::Vector3d& p_tracked_m) const override {
    return beyondMean(vector_rad_->displacement_m(p_tracked_m));
  }
  Eigen::Quaterniond errorRotationAt(const Pose& tracked) const override {
    return beyondMean(vector_rad_->displacementAt_m(tracked));
  }
  nlohmann::json errorParameters() const override {
    return {{"q_mean_wxyz", jsonOf(q_mean_)}, {"vector_rad", vector_rad_->parameters()}};
  }

 private:
  Eigen::Quaterniond beyondMean(const Eigen::Vector3d& vector_rad) const {
    return q_mean_ * rotationFromVector(vector_rad);
  }

  Eigen::Quaterniond q_mean_;
  std::unique_ptr<PositionModel> vector_rad_;
};

Result<std::unique_ptr<OrientationModel>> fitOrientation(const FitData& data, const Settings& settings,
                                                         const RunControl& control) {
  FT_TRY_VOID(checkOrientations(data, "Gaussian process"));
  const ErrorFrame frame = errorFrame(settings);
  const std::vector<Eigen::Quaterniond> q_error = errorRotations(data, frame);
  const Eigen::Quaterniond q_mean = canonical(meanRotation(q_error));
  std::vector<Eigen::Vector3d> vectors_rad;
  for (const Eigen::Quaterniond& q : q_error) vectors_rad.push_back(rotationVector_rad(q_mean.conjugate() * q));
  // Seen from the sensor the axis that coils turn about is another one in every orientation.
  const auto coils = frame == ErrorFrame::kTracker ? std::optional(CoilEffect::kTurn) : std::nullopt;
  FT_TRY(auto process, fitProcessOf(data, vectors_rad, coils, settings, control));
  return std::make_unique<GaussianProcessOrientation>(frame, q_mean, std::move(process));
}

std::vector<Setting> orientationSettings() {
  std::vector<Setting> settings = gaussianProcessSettings();
  settings.push_back(errorFrameSetting());
  return settings;
}

}  // namespace

std::unique_ptr<OrientationModel> readGaussianProcessOrientation(const JsonReader& parameters) {
  return std::make_unique<GaussianProcessOrientation>(errorFrameFrom(parameters),
                                                      parameters["q_mean_wxyz"].quaternion(),
                                                      readGaussianProcessPosition(parameters["vector_rad"]));
}

/// The rotation vector of the error, beyond the mean error, as a Gaussian process over positions or, where the evidence
/// and the places left out ask for it, over poses.
OrientationMethod gaussianProcessOrientation() {
  return {.id = "gaussian_process",
          .label = "Gaussian process",
          .source = "As gaussian_process for positions, over rotation vectors about the mean error rotation",
          .settings = orientationSettings(),
          .fit = fitOrientation,
          .read = readGaussianProcessOrientation,
          .cost = FitCost::kCostly,
          .tuning = Tuning::kAlways,
          .origin = MethodOrigin::kLater};
}

}  // namespace fieldtrue::correctors
