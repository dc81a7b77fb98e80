#include "calib/correctors/local_bump.h"

#include "calib/correctors/local_interpolation.h"

namespace fieldtrue {
namespace {

Result<std::unique_ptr<PositionModel>> fitLocalBump(const FitData& data, const Settings& settings, const RunControl&) {
  return fitLocalPosition(data, weightRule(WeightKind::kBrysonBump, settings), "Bryson's bump interpolation");
}

Result<std::unique_ptr<PositionModel>> loadLocalBump(const nlohmann::json& parameters) {
  return loadLocalPosition(parameters, "local_bump");
}

}  // namespace

PositionMethod localBumpPosition() {
  return {"local_bump",
          "Local, bump (Bryson)",
          "Bryson 1992; survey by Kindratenko, section 3.3, eq. 8-10",
          {lengthUnitSetting(), bumpEndSetting()},
          fitLocalBump,
          loadLocalBump};
}

}  // namespace fieldtrue
