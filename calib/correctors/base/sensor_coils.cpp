#include "calib/correctors/base/sensor_coils.h"

#include <cmath>

namespace fieldtrue::correctors {
namespace {

Eigen::Matrix3d matrixOf(const CoilStrain& e) {
  Eigen::Matrix3d strain;
  strain << e[0], e[3], e[4], e[3], e[1], e[5], e[4], e[5], e[2];
  return strain;
}

/// True minus tracked, for a strain in the transmitter's axes.
Eigen::Vector3d shiftOf_m(const Eigen::Matrix3d& strain, const Eigen::Vector3d& p_m) {
  const double range_m = p_m.norm();
  if (!(range_m > 0.0)) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d n = p_m / range_m;
  const Eigen::Vector3d across = strain * n - n.dot(strain * n) * n;
  return range_m * ((3.0 * n.dot(strain * n) + strain.trace()) / 18.0 * n + 4.0 / 3.0 * across);
}

/// The rotation vector, up to a factor.
Eigen::Vector3d turnOf(const Eigen::Matrix3d& strain, const Eigen::Vector3d& p_m) {
  const Eigen::Vector3d n = p_m.stableNormalized();
  return n.cross(strain * n);
}

Eigen::Vector3d effectOf(CoilEffect effect, const Eigen::Matrix3d& strain, const Eigen::Vector3d& p_m) {
  return effect == CoilEffect::kShift ? shiftOf_m(strain, p_m) : turnOf(strain, p_m);
}

Eigen::Matrix3d turned(const Eigen::Matrix3d& strain, const Eigen::Quaterniond& q) {
  const Eigen::Matrix3d r = q.normalized().toRotationMatrix();
  return r * strain * r.transpose();
}

class CoilsPosition : public PositionModel {
 public:
  /// @param mean_strain over the orientations that were fitted, transmitter's axes
  CoilsPosition(std::unique_ptr<PositionModel> model, const SensorCoils& coils, CoilDesign design,
                const Eigen::Matrix3d& mean_strain)
      : model_(std::move(model)), coils_(coils), design_(std::move(design)), mean_strain_(mean_strain) {}

  bool takesOrientation() const override { return true; }
  Eigen::Vector3d displacementAt_m(const Pose& tracked) const override {
    return model_->displacementAt_m(tracked) + coils_.at(tracked);
  }
  void correctPoses(std::span<const Pose> tracked, std::span<Eigen::Vector3d> p_corrected_m) const override {
    model_->correctPoses(tracked, p_corrected_m);
    for (std::size_t i = 0; i < tracked.size(); ++i) p_corrected_m[i] += coils_.at(tracked[i]);
  }
  Result<std::unique_ptr<PositionModel>> onLattices(const LatticeMaker& maker, double max_deviation_m) const override {
    FT_TRY(auto model, model_->onLattices(maker, max_deviation_m));
    return std::make_unique<CoilsPosition>(std::move(model), coils_, CoilDesign(0, 18), mean_strain_);
  }
  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    return model_->displacement_m(p_tracked_m) + effectOf(coils_.effect, mean_strain_, p_tracked_m);
  }
  std::optional<double> uncertaintyAt_m(const Pose& tracked) const override {
    const auto sd_m = model_->uncertaintyAt_m(tracked);
    const auto weights = design_.rows() > 0 ? model_->weightsAt(tracked) : std::nullopt;
    if (!sd_m || !weights || weights->size() != design_.rows()) return sd_m;
    const Eigen::Matrix<double, 18, 1> taken = design_.transpose() * *weights;
    const Eigen::Matrix<double, 3, 6> left = coilDerivative(coils_.effect, tracked) - taken.reshaped(3, 6);
    return std::sqrt(*sd_m * *sd_m + (left * coils_.covariance * left.transpose()).trace() +
                     3.0 * coils_.left_sd_m * coils_.left_sd_m);
  }
  /// Of the mean over the orientations that were fitted.
  std::optional<double> uncertainty_m(const Eigen::Vector3d& p_tracked_m) const override {
    return model_->uncertainty_m(p_tracked_m);
  }
  bool covers(const Eigen::Vector3d& p_tracked_m) const override { return model_->covers(p_tracked_m); }
  std::string note() const override { return model_->note(); }
  nlohmann::json parameters() const override {
    return {{"coils",
             {{"effect", coils_.effect == CoilEffect::kShift ? "shift" : "turn"},
              {"strain", std::vector<double>(coils_.strain.begin(), coils_.strain.end())},
              {"covariance", jsonOf(Eigen::MatrixXd(coils_.covariance))},
              {"left_sd_m", coils_.left_sd_m},
              {"design", jsonOf(Eigen::MatrixXd(design_))},
              {"mean_strain", jsonOf(Eigen::MatrixXd(mean_strain_))}}},
            {"without_coils", model_->parameters()}};
  }

 private:
  std::unique_ptr<PositionModel> model_;
  SensorCoils coils_;
  CoilDesign design_;
  Eigen::Matrix3d mean_strain_;
};

}  // namespace

Eigen::Matrix<double, 3, 6> coilDerivative(CoilEffect effect, const Pose& tracked) {
  Eigen::Matrix<double, 3, 6> derivative;
  for (int k = 0; k < 6; ++k)
    derivative.col(k) =
        effectOf(effect, turned(matrixOf(CoilStrain::Unit(k)), tracked.orientation), tracked.position_m);
  return derivative;
}

Eigen::Vector3d SensorCoils::at(const Pose& tracked) const {
  return effectOf(effect, turned(matrixOf(strain), tracked.orientation), tracked.position_m);
}

FitData withoutCoils(FitData data, const SensorCoils& coils) {
  for (std::size_t row = 0; row < data.size(); ++row)
    data.p_true_m[row] -= coils.at({data.p_tracked_m[row], data.q_tracked[row]});
  return data;
}

std::unique_ptr<PositionModel> withCoils(std::unique_ptr<PositionModel> model, const SensorCoils& coils,
                                         CoilDesign design, std::span<const Eigen::Quaterniond> q) {
  Eigen::Matrix3d mean_strain = Eigen::Matrix3d::Zero();
  for (const Eigen::Quaterniond& one : q)
    mean_strain += turned(matrixOf(coils.strain), one) / static_cast<double>(q.size());
  return std::make_unique<CoilsPosition>(std::move(model), coils, std::move(design), mean_strain);
}

std::unique_ptr<PositionModel> readCoils(const JsonReader& parameters,
                                         std::unique_ptr<PositionModel> (*base)(const JsonReader&)) {
  const JsonReader from = parameters["coils"];
  const std::vector<double> strain = from["strain"].numbers();
  const Eigen::MatrixXd covariance = from["covariance"].matrix(6);
  if (strain.size() != 6) from["strain"].refuse("six numbers");
  if (covariance.rows() != 6) from["covariance"].refuse("six rows");
  const Eigen::MatrixXd design = from["design"].matrix(18);
  SensorCoils coils;
  coils.effect = from["effect"].oneOf({"shift", "turn"}) == "turn" ? CoilEffect::kTurn : CoilEffect::kShift;
  coils.strain = Eigen::Map<const CoilStrain>(strain.data());
  coils.covariance = covariance;
  coils.left_sd_m = from["left_sd_m"].number();
  return std::make_unique<CoilsPosition>(base(parameters["without_coils"]), coils, design,
                                         from["mean_strain"].matrix3());
}

}  // namespace fieldtrue::correctors
