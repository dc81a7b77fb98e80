#include <Eigen/SVD>
#include <cstdio>
#include <numbers>

#include "calib/core/json_reader.h"
#include "calib/core/statistics.h"
#include "calib/correctors/base/error_rotation.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/base/fit_memory.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/multiquadric/hmq_field.h"
#include "calib/correctors/multiquadric/hmq_r2.h"

namespace fieldtrue::correctors {
namespace {

using RowMatrix3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// The rotation nearest in the least-squares sense to a matrix, determinant +1.
Eigen::Quaterniond nearestRotation(const Eigen::Matrix3d& matrix) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0 ? -1.0 : 1.0;
  const Eigen::Matrix3d rotation =
      svd.matrixU() * Eigen::Vector3d(1.0, 1.0, sign).asDiagonal() * svd.matrixV().transpose();
  return Eigen::Quaterniond(rotation).normalized();
}

/// Zachmann interpolates the true orientation's matrix itself, which ties the correction to the orientation the sensor
/// had while it was measured. The error rotation's matrix is interpolated here instead: it is the same for every
/// orientation at a place, so sensors held otherwise are corrected too.
class HmqErrorRotation : public ErrorRotationModel {
 public:
  HmqErrorRotation(ErrorFrame frame, MultiquadricField elements, std::string note)
      : ErrorRotationModel(frame), elements_(std::move(elements)), note_(std::move(note)) {}

  std::string note() const override { return note_; }

 protected:
  Eigen::Quaterniond errorRotation(const Eigen::Vector3d& p_tracked_m) const override {
    return nearestRotation(RowMatrix3d(elements_.value(p_tracked_m).data()));
  }
  nlohmann::json errorParameters() const override {
    nlohmann::json json = elements_.toJson();
    json["note"] = note_;
    return json;
  }

 private:
  MultiquadricField elements_;
  std::string note_;
};

/// For small angles the nine elements of two rotations differ, as a vector, by the square root of two times their
/// angle.
std::string textInDegrees(double rms_elements) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g deg", 180.0 / std::numbers::pi * rms_elements / std::numbers::sqrt2);
  return text;
}

/// Error rotations of the visits of each place averaged, as matrix elements row after row.
Eigen::MatrixXd placeElements(const Places& places, const std::vector<Eigen::Quaterniond>& q_error) {
  Eigen::MatrixXd elements(static_cast<Eigen::Index>(places.size()), 9);
  for (std::size_t i = 0; i < places.size(); ++i) {
    std::vector<Eigen::Quaterniond> visits;
    for (const std::size_t row : places.rows[i]) visits.push_back(q_error[row]);
    const RowMatrix3d rotation = meanRotation(visits).toRotationMatrix();
    elements.row(static_cast<Eigen::Index>(i)) = Eigen::Map<const Eigen::Matrix<double, 1, 9>>(rotation.data());
  }
  return elements;
}

Result<std::unique_ptr<OrientationModel>> fitHmqMatrix(const FitData& data, const Settings& settings,
                                                       const RunControl& control) {
  const std::string name = "Multiquadric of rotations";
  FT_TRY_VOID(checkOrientations(data, name));
  const ErrorFrame frame = errorFrame(settings);
  const Places places = mergePlaces(data);
  FT_TRY_VOID(checkSpread(name, places.size(), data.dimension));
  FT_TRY(const auto memory, bookSquareMatrices(name, multiquadricMatrices(places.size()), places.size(), control));
  const Eigen::MatrixXd elements = placeElements(places, errorRotations(data, frame));
  FT_TRY(const auto r2, chooseR2(name, places, elements, settings, textInDegrees, control));
  FT_TRY(auto field, MultiquadricField::fit(name, places, elements, r2.r2_m2, control));
  std::string note = planeNote(data, "nothing is claimed off it");
  note += (note.empty() || r2.note.empty() ? "" : " ") + r2.note;
  return std::make_unique<HmqErrorRotation>(frame, std::move(field), note);
}

}  // namespace

std::unique_ptr<OrientationModel> readHmqMatrixOrientation(const JsonReader& parameters) {
  return std::make_unique<HmqErrorRotation>(errorFrameFrom(parameters), MultiquadricField::fromJson(parameters, 9),
                                            parameters["note"].text());
}

OrientationMethod hmqMatrixOrientation() {
  return {.id = "hmq_matrix",
          .label = "Multiquadric of rotations",
          .source = "Zachmann 2000; survey by Kindratenko, section 4.3",
          .settings = {r2Setting(), errorFrameSetting()},
          .fit = fitHmqMatrix,
          .read = readHmqMatrixOrientation};
}

}  // namespace fieldtrue::correctors
