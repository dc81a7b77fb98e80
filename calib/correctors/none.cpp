#include "calib/correctors/none.h"

#include <nlohmann/json.hpp>

#include "calib/correctors/fit_checks.h"

namespace fieldtrue {
namespace {

class NoPositionCorrection : public PositionModel {
 public:
  Eigen::Vector3d displacement_m(const Eigen::Vector3d&) const override { return Eigen::Vector3d::Zero(); }
  Eigen::Matrix3d jacobian(const Eigen::Vector3d&) const override { return Eigen::Matrix3d::Identity(); }
  nlohmann::json parameters() const override { return nlohmann::json::object(); }
};

Result<std::unique_ptr<PositionModel>> fitNone(const FitData& data, const Settings&, const RunControl&) {
  if (auto checked = checkPositions(data, "No correction"); !checked) return tl::unexpected(checked.error());
  return std::make_unique<NoPositionCorrection>();
}

Result<std::unique_ptr<PositionModel>> loadNone(const nlohmann::json&) {
  return std::make_unique<NoPositionCorrection>();
}

}  // namespace

PositionMethod nonePosition() {
  return {"none", "No correction", "The tracker as it is, after the alignment if one is fitted", {}, fitNone, loadNone};
}

}  // namespace fieldtrue
