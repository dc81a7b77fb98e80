#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/polynomial/polynomial_position.h"

namespace fieldtrue::correctors {
namespace {

const std::string kName = "Affine fit";
const PolynomialDegree kLinear{1, {}};

Result<std::unique_ptr<PositionModel>> fitAffine(const FitData& data, const Settings&, const RunControl&) {
  return fitPolynomialPosition(data, kLinear, kName);
}

Result<std::unique_ptr<HoldOutFits<PositionModel>>> holdOutAffine(const FitData& data, const Settings&,
                                                                  const RunControl&) {
  return holdOutPolynomialPosition(data, kLinear, kName);
}

}  // namespace

PositionMethod affinePosition() {
  return {.id = "affine",
          .label = "Affine",
          .source = "Survey by Kindratenko, section 3.4, eq. 14 with r = 1",
          .settings = {},
          .fit = fitAffine,
          .read = readPolynomialPosition,
          .hold_out = holdOutAffine,
          .origin = MethodOrigin::kBaseline,
          .tries = {{"", 2}}};
}

}  // namespace fieldtrue::correctors
