#include <algorithm>
#include <cmath>

#include "calib/core/json_reader.h"
#include "calib/core/statistics.h"
#include "calib/correctors/base/error_rotation.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/polynomial/polynomial_choice.h"

namespace fieldtrue::correctors {
namespace {

/// The vector part tells rotations apart below 180 degrees only. Up to this angle errors are fitted as they are, as
/// Ikits does; above, relative to their mean, which keeps w > 0 and so the sign continuous.
constexpr double kDirectLimit_rad = 1.5707963267948966;

class PolynomialErrorRotation : public ErrorRotationModel {
 public:
  PolynomialErrorRotation(ErrorFrame frame, const Eigen::Quaterniond& q_reference, ChosenPolynomial vector_part)
      : ErrorRotationModel(frame), q_reference_(q_reference), vector_part_(std::move(vector_part)) {}

  int coefficients() const override { return vector_part_.field.terms(); }
  std::string note() const override { return vector_part_.note(); }

 protected:
  Eigen::Quaterniond errorRotation(const Eigen::Vector3d& p_tracked_m) const override {
    const Eigen::Vector3d v = vector_part_.field.value(p_tracked_m);
    // Far outside the places the polynomial can leave the unit ball; there the nearest rotation is a half turn.
    const double w = std::sqrt(std::max(0.0, 1.0 - v.squaredNorm()));
    return (q_reference_ * Eigen::Quaterniond(w, v.x(), v.y(), v.z())).normalized();
  }
  nlohmann::json errorParameters() const override {
    return {{"q_reference_wxyz", jsonOf(q_reference_)}, {"vector_part", vector_part_.toJson()}};
  }

 private:
  Eigen::Quaterniond q_reference_;
  ChosenPolynomial vector_part_;
};

Result<std::unique_ptr<OrientationModel>> fitPolynomialQuaternion(const FitData& data, const Settings& settings,
                                                                  const RunControl& control) {
  const std::string label = "Quaternion polynomial";
  FT_TRY_VOID(checkOrientations(data, label));
  const ErrorFrame frame = errorFrame(settings);
  const std::vector<Eigen::Quaterniond> q_error = errorRotations(data, frame);
  const bool direct = std::all_of(q_error.begin(), q_error.end(), [](const Eigen::Quaterniond& q) {
    return angleBetween_rad(q, Eigen::Quaterniond::Identity()) < kDirectLimit_rad;
  });
  const Eigen::Quaterniond q_reference = direct ? Eigen::Quaterniond::Identity() : canonical(meanRotation(q_error));
  std::vector<Eigen::Vector3d> vector_parts(data.size());
  for (std::size_t i = 0; i < data.size(); ++i) vector_parts[i] = canonical(q_reference.conjugate() * q_error[i]).vec();
  return fitChosenPolynomial({label, data, std::move(vector_parts)}, settings, control)
      .map([&](ChosenPolynomial polynomial) -> std::unique_ptr<OrientationModel> {
        return std::make_unique<PolynomialErrorRotation>(frame, q_reference, std::move(polynomial));
      });
}

}  // namespace

std::unique_ptr<OrientationModel> readPolynomialQuaternionOrientation(const JsonReader& parameters) {
  return std::make_unique<PolynomialErrorRotation>(errorFrameFrom(parameters),
                                                   parameters["q_reference_wxyz"].quaternion(),
                                                   ChosenPolynomial::fromJson(parameters["vector_part"]));
}

OrientationMethod polynomialQuaternionOrientation() {
  return {.id = "polynomial_quaternion",
          .label = "Quaternion polynomial",
          .source = "Ikits, Brederson, Hansen, Hollerbach 2001; survey by Kindratenko, section 4.2",
          .settings = {degreeSetting(), errorFrameSetting()},
          .fit = fitPolynomialQuaternion,
          .read = readPolynomialQuaternionOrientation};
}

}  // namespace fieldtrue::correctors
