#include "calib/correctors/local_linear.h"

#include "calib/correctors/local_interpolation.h"

namespace fieldtrue {
namespace {

Result<std::unique_ptr<PositionModel>> fitLocalLinear(const FitData& data, const Settings& settings,
                                                      const RunControl&) {
  return fitLocalPosition(data, weightRule(WeightKind::kBrysonLinear, settings), "Bryson's linear interpolation");
}

Result<std::unique_ptr<PositionModel>> loadLocalLinear(const nlohmann::json& parameters) {
  return loadLocalPosition(parameters, "local_linear");
}

}  // namespace

PositionMethod localLinearPosition() {
  return {"local_linear", "Local, linear (Bryson)", "Bryson 1992; survey by Kindratenko, section 3.3, eq. 8-10", {},
          fitLocalLinear, loadLocalLinear};
}

}  // namespace fieldtrue
