#include <nlohmann/json.hpp>

#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"

namespace fieldtrue::correctors {
namespace {

class NoOrientationCorrection : public OrientationModel {
 public:
  Eigen::Quaterniond correct(const Eigen::Vector3d&, const Eigen::Quaterniond& q_tracked) const override {
    return q_tracked;
  }
  nlohmann::json parameters() const override { return nlohmann::json::object(); }
};

/// Needs no orientations: a table of positions alone gets this one.
Result<std::unique_ptr<OrientationModel>> fitNoOrientation(const FitData&, const Settings&, const RunControl&) {
  return std::make_unique<NoOrientationCorrection>();
}

}  // namespace

std::unique_ptr<OrientationModel> readNoneOrientation(const JsonReader&) {
  return std::make_unique<NoOrientationCorrection>();
}

OrientationMethod noneOrientation() {
  return {.id = "none",
          .label = "No correction",
          .source = "The tracker as it is, after the alignment if one is fitted",
          .settings = {},
          .fit = fitNoOrientation,
          .read = readNoneOrientation};
}

}  // namespace fieldtrue::correctors
