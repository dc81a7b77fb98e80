#include <nlohmann/json.hpp>

#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"

namespace fieldtrue::correctors {
namespace {

class NoPositionCorrection : public PositionModel {
 public:
  Eigen::Vector3d displacement_m(const Eigen::Vector3d&) const override { return Eigen::Vector3d::Zero(); }
  Eigen::Matrix3d jacobian(const Eigen::Vector3d&) const override { return Eigen::Matrix3d::Identity(); }
  nlohmann::json parameters() const override { return nlohmann::json::object(); }
};

/// Nothing is fitted, so nothing changes but whether there is anything left to fit to.
class NothingHeldOut : public HoldOutFits<PositionModel> {
 public:
  explicit NothingHeldOut(std::size_t n_rows) : n_rows_(n_rows) {}

  Result<std::unique_ptr<PositionModel>> without(std::span<const std::size_t> rows, const Pose&) const override {
    if (rows.size() >= n_rows_) return fail(ErrorCode::kTooFewNodes, "No correction needs measured places, got none");
    return std::make_unique<NoPositionCorrection>();
  }

 private:
  std::size_t n_rows_;
};

Result<std::unique_ptr<PositionModel>> fitNone(const FitData& data, const Settings&, const RunControl&) {
  FT_TRY_VOID(checkPositions(data, "No correction"));
  return std::make_unique<NoPositionCorrection>();
}

Result<std::unique_ptr<HoldOutFits<PositionModel>>> holdOutNone(const FitData& data, const Settings&,
                                                                const RunControl&) {
  FT_TRY_VOID(checkPositions(data, "No correction"));
  return std::make_unique<NothingHeldOut>(data.size());
}

}  // namespace

std::unique_ptr<PositionModel> readNonePosition(const JsonReader&) { return std::make_unique<NoPositionCorrection>(); }

PositionMethod nonePosition() {
  return {.id = "none",
          .label = "No correction",
          .source = "The tracker as it is, after the alignment if one is fitted",
          .settings = {},
          .fit = fitNone,
          .read = readNonePosition,
          .hold_out = holdOutNone,
          .origin = MethodOrigin::kBaseline,
          .tries = {{"", 0}}};
}

}  // namespace fieldtrue::correctors
