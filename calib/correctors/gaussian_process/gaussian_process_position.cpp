#include "calib/correctors/gaussian_process/gaussian_process_position.h"

#include <cmath>
#include <mutex>

#include "calib/core/json_reader.h"
#include "calib/correctors/base/fit_memory.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/sensor_coils.h"
#include "calib/correctors/gaussian_process/gaussian_process_posterior.h"
#include "calib/correctors/gaussian_process/pose_process.h"

namespace fieldtrue::correctors {
namespace {

/// The posterior, factorised when it is first asked for: views ask, evaluation does not, and at 5,000 places it takes
/// seconds and 200 MB.
struct LazyPosterior {
  std::once_flag once;
  std::optional<GaussianProcessPosterior> posterior;
};

class GaussianProcessPosition : public PositionModel {
 public:
  GaussianProcessPosition(RadialField field, const GaussianProcessScales& scales, Eigen::VectorXd noise_m2,
                          std::string note)
      : field_(std::move(field)), scales_(scales), noise_m2_(std::move(noise_m2)), note_(std::move(note)) {}

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    return field_.value(p_tracked_m);
  }
  Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const override {
    return Eigen::Matrix3d::Identity() + field_.gradient(p_tracked_m);
  }
  /// 3-D, of the smooth field and of what the fit found neither smooth nor stated as noise.
  std::optional<double> uncertainty_m(const Eigen::Vector3d& p_tracked_m) const override {
    const GaussianProcessPosterior* known = posterior();
    if (known == nullptr) return std::nullopt;
    const double field_m2 = known->variance_m2(signal_m2(), covarianceWith(p_tracked_m), tailAt(p_tracked_m));
    return std::sqrt(3.0 * (field_m2 + scales_.nugget_sd_m * scales_.nugget_sd_m));
  }
  std::optional<Eigen::VectorXd> weightsAt(const Pose& tracked) const override {
    const GaussianProcessPosterior* known = posterior();
    if (known == nullptr) return std::nullopt;
    return known->weights(covarianceWith(tracked.position_m), tailAt(tracked.position_m));
  }
  std::string note() const override { return note_; }
  nlohmann::json parameters() const override {
    nlohmann::json json = field_.toJson();
    json["signal_sd_m"] = scales_.signal_sd_m;
    json["nugget_sd_m"] = scales_.nugget_sd_m;
    json["length_m"] = jsonOf(scales_.length_m);
    json["noise_m2"] = std::vector<double>(noise_m2_.begin(), noise_m2_.end());
    json["note"] = note_;
    return json;
  }

 private:
  double signal_m2() const { return scales_.signal_sd_m * scales_.signal_sd_m; }
  Eigen::VectorXd covarianceWith(const Eigen::Vector3d& p_m) const { return signal_m2() * field_.kernelValues(p_m); }
  Eigen::VectorXd tailAt(const Eigen::Vector3d& p_m) const {
    return field_.frame().tail(std::span(&p_m, 1)).row(0).transpose();
  }
  /// @return null where memory does not suffice
  const GaussianProcessPosterior* posterior() const {
    std::call_once(lazy_->once, [this] {
      const auto n = static_cast<double>(field_.centers_m().size());
      if (checkMemory("The uncertainty of a Gaussian process", kGaussianProcessMatrices * 8.0 * n * n))
        lazy_->posterior = GaussianProcessPosterior::of(
            field_.frame().tail(field_.centers_m()),
            covarianceMatrix(field_.kernel(), field_.frame(), scales_, field_.centers_m(), noise_m2_));
    });
    return lazy_->posterior ? &*lazy_->posterior : nullptr;
  }

  RadialField field_;
  GaussianProcessScales scales_;
  Eigen::VectorXd noise_m2_;
  std::string note_;
  std::unique_ptr<LazyPosterior> lazy_ = std::make_unique<LazyPosterior>();
};

}  // namespace

std::unique_ptr<PositionModel> makeGaussianProcess(RadialField field, const GaussianProcessScales& scales,
                                                   Eigen::VectorXd noise_m2, std::string note) {
  return std::make_unique<GaussianProcessPosition>(std::move(field), scales, std::move(noise_m2), std::move(note));
}

std::unique_ptr<PositionModel> readGaussianProcessPosition(const JsonReader& parameters) {
  if (parameters.has("coils")) return readCoils(parameters, readGaussianProcessPosition);
  if (parameters.has("pose")) return readPoses(parameters);
  RadialField field = RadialField::fromJson(parameters);
  const GaussianProcessScales scales{parameters["length_m"].vector3(), parameters["signal_sd_m"].number(),
                                     parameters["nugget_sd_m"].number()};
  if (!(scales.length_m.head(field.frame().dimension).minCoeff() > 0.0))
    parameters["length_m"].refuse("three lengths above 0");
  const auto stored_m2 = parameters["noise_m2"].numbers();
  if (stored_m2.size() != field.centers_m().size()) parameters["noise_m2"].refuse("one number for each centre");
  const Eigen::VectorXd noise_m2 =
      Eigen::Map<const Eigen::VectorXd>(stored_m2.data(), static_cast<Eigen::Index>(stored_m2.size()));
  return makeGaussianProcess(std::move(field), scales, noise_m2, parameters["note"].text());
}

}  // namespace fieldtrue::correctors
