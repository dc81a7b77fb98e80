#include "calib/core/json_reader.h"
#include "calib/core/statistics.h"
#include "calib/correctors/base/error_rotation.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"

namespace fieldtrue::correctors {
namespace {

class ConstantErrorRotation : public ErrorRotationModel {
 public:
  ConstantErrorRotation(ErrorFrame frame, const Eigen::Quaterniond& q_error)
      : ErrorRotationModel(frame), q_error_(q_error) {}

 protected:
  Eigen::Quaterniond errorRotation(const Eigen::Vector3d&) const override { return q_error_; }
  nlohmann::json errorParameters() const override { return {{"q_error_wxyz", jsonOf(q_error_)}}; }

 private:
  Eigen::Quaterniond q_error_;
};

Result<std::unique_ptr<OrientationModel>> fitConstant(const FitData& data, const Settings& settings,
                                                      const RunControl&) {
  FT_TRY_VOID(checkOrientations(data, "Rigid orientation fit"));
  const ErrorFrame frame = errorFrame(settings);
  return std::make_unique<ConstantErrorRotation>(frame, canonical(meanRotation(errorRotations(data, frame))));
}

}  // namespace

std::unique_ptr<OrientationModel> readRigidOrientation(const JsonReader& parameters) {
  return std::make_unique<ConstantErrorRotation>(errorFrameFrom(parameters), parameters["q_error_wxyz"].quaternion());
}

OrientationMethod rigidOrientation() {
  return {.id = "rigid",
          .label = "Constant rotation",
          .source = "Markley, Cheng, Crassidis, Oshman 2007, eq. 12-13, over the error rotations",
          .settings = {errorFrameSetting()},
          .fit = fitConstant,
          .read = readRigidOrientation};
}

}  // namespace fieldtrue::correctors
