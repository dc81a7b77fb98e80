#include <algorithm>
#include <cmath>

#include "calib/core/json_reader.h"
#include "calib/core/statistics.h"
#include "calib/core/units.h"
#include "calib/correctors/base/error_rotation.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/base/fit_names.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/polynomial/polynomial_choice.h"

namespace fieldtrue::correctors {
namespace {

const std::string kEulerLabel = "Euler polynomial";
/// Up to this angle errors are fitted as they are, as Kindratenko does; above, relative to their mean, which keeps
/// azimuth and roll away from the jump at 180 degrees and elevation from the pole at 90.
constexpr double kDirectEulerLimit_rad = kPi / 3.0;
/// Nearer to the pole azimuth and roll of neighbouring places have nothing to do with each other.
constexpr double kPoleLimit_rad = 80.0 / 180.0 * kPi;

/// Euler angles (azimuth, elevation, roll: about Z, the new Y, the new X) of the error rotation as polynomials of
/// position. Errors are composed as rotations, never by adding angles, so the poles of the sensor's own orientation do
/// no harm: M M^e of the survey is the frame `sensor`, and with zero true orientation both frames are the same.
class EulerErrorRotation : public ErrorRotationModel {
 public:
  EulerErrorRotation(ErrorFrame frame, const Eigen::Quaterniond& q_reference, ChosenPolynomial angles)
      : ErrorRotationModel(frame), q_reference_(q_reference), angles_(std::move(angles)) {}

  int coefficients() const override { return angles_.field.terms(); }
  std::string note() const override { return angles_.note(); }

 protected:
  Eigen::Quaterniond errorRotation(const Eigen::Vector3d& p_tracked_m) const override {
    return (q_reference_ * rotationFromEuler(angles_.field.value(p_tracked_m))).normalized();
  }
  nlohmann::json errorParameters() const override {
    return {{"q_reference_wxyz", jsonOf(q_reference_)}, {"azimuth_elevation_roll", angles_.toJson()}};
  }

 private:
  Eigen::Quaterniond q_reference_;
  ChosenPolynomial angles_;
};

std::vector<Eigen::Vector3d> eulerAngles_rad(const std::vector<Eigen::Quaterniond>& q_error,
                                             const Eigen::Quaterniond& q_reference) {
  std::vector<Eigen::Vector3d> angles_rad;
  angles_rad.reserve(q_error.size());
  for (const Eigen::Quaterniond& q : q_error) angles_rad.push_back(eulerFromRotation_rad(q_reference.conjugate() * q));
  return angles_rad;
}

Result<void> checkPoles(const FitData& data, const std::vector<Eigen::Vector3d>& angles_rad) {
  for (std::size_t row = 0; row < angles_rad.size(); ++row) {
    const double elevation_rad = std::abs(angles_rad[row].y());
    if (elevation_rad > kPoleLimit_rad)
      return fail(ErrorCode::kDegenerate,
                  kEulerLabel + ": the error at " + rowName(data, row) + " is turned " +
                      std::to_string(std::lround(elevation_rad / kPi * 180.0)) +
                      " degrees in elevation from the mean error; Euler angles mean nothing near 90, a method that "
                      "models quaternions or matrices is needed");
  }
  return {};
}

Result<std::unique_ptr<OrientationModel>> fitPolynomialEuler(const FitData& data, const Settings& settings,
                                                             const RunControl& control) {
  FT_TRY_VOID(checkOrientations(data, kEulerLabel));
  const ErrorFrame frame = errorFrame(settings);
  const std::vector<Eigen::Quaterniond> q_error = errorRotations(data, frame);
  const bool direct = std::all_of(q_error.begin(), q_error.end(), [](const Eigen::Quaterniond& q) {
    return angleBetween_rad(q, Eigen::Quaterniond::Identity()) < kDirectEulerLimit_rad;
  });
  const Eigen::Quaterniond q_reference = direct ? Eigen::Quaterniond::Identity() : canonical(meanRotation(q_error));
  std::vector<Eigen::Vector3d> angles_rad = eulerAngles_rad(q_error, q_reference);
  FT_TRY_VOID(checkPoles(data, angles_rad));
  return fitChosenPolynomial({kEulerLabel, data, std::move(angles_rad)}, settings, control)
      .map([&](ChosenPolynomial angles) -> std::unique_ptr<OrientationModel> {
        return std::make_unique<EulerErrorRotation>(frame, q_reference, std::move(angles));
      });
}

}  // namespace

std::unique_ptr<OrientationModel> readPolynomialEulerOrientation(const JsonReader& parameters) {
  return std::make_unique<EulerErrorRotation>(errorFrameFrom(parameters), parameters["q_reference_wxyz"].quaternion(),
                                              ChosenPolynomial::fromJson(parameters["azimuth_elevation_roll"]));
}

OrientationMethod polynomialEulerOrientation() {
  return {.id = "polynomial_euler",
          .label = "Euler angle polynomial",
          .source = "Kindratenko 1999; survey by Kindratenko, section 4.2",
          .settings = {degreeSetting(), errorFrameSetting()},
          .fit = fitPolynomialEuler,
          .read = readPolynomialEulerOrientation};
}

}  // namespace fieldtrue::correctors
