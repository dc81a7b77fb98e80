#include "calib/correctors/affine.h"

#include "calib/correctors/polynomial_position.h"

namespace fieldtrue {
namespace {

Result<std::unique_ptr<PositionModel>> fitAffine(const FitData& data, const Settings&, const RunControl&) {
  return fitPolynomialPosition(data, 1, "Affine fit");
}

Result<std::unique_ptr<PositionModel>> loadAffine(const nlohmann::json& parameters) {
  return loadPolynomialPosition(parameters, "affine");
}

}  // namespace

PositionMethod affinePosition() {
  return {"affine", "Affine", "Survey by Kindratenko, section 3.4, eq. 14 with r = 1", {}, fitAffine, loadAffine};
}

}  // namespace fieldtrue
