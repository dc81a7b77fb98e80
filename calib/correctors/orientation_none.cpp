#include "calib/correctors/orientation_none.h"

#include <nlohmann/json.hpp>

namespace fieldtrue {
namespace {

class NoOrientationCorrection : public OrientationModel {
 public:
  Eigen::Quaterniond correct(const Eigen::Vector3d&, const Eigen::Quaterniond& q_tracked) const override {
    return q_tracked;
  }
  nlohmann::json parameters() const override { return nlohmann::json::object(); }
};

/// Needs no orientations: a table of positions alone gets this one.
Result<std::unique_ptr<OrientationModel>> fitNone(const FitData&, const Settings&, const RunControl&) {
  return std::make_unique<NoOrientationCorrection>();
}

Result<std::unique_ptr<OrientationModel>> loadNone(const nlohmann::json&) {
  return std::make_unique<NoOrientationCorrection>();
}

}  // namespace

OrientationMethod noneOrientation() {
  return {"none", "No correction", "The tracker as it is, after the alignment if one is fitted", {}, fitNone, loadNone};
}

}  // namespace fieldtrue
