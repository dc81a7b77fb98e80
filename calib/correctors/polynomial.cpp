#include "calib/correctors/polynomial.h"

#include "calib/correctors/polynomial_position.h"
#include "calib/correctors/shared_settings.h"

namespace fieldtrue {
namespace {

Result<std::unique_ptr<PositionModel>> fitPolynomial(const FitData& data, const Settings& settings, const RunControl&) {
  const int degree = static_cast<int>(integerSetting(settings, "degree"));
  return fitPolynomialPosition(data, degree, "Polynomial of degree " + std::to_string(degree));
}

Result<std::unique_ptr<PositionModel>> loadPolynomial(const nlohmann::json& parameters) {
  return loadPolynomialPosition(parameters, "polynomial");
}

}  // namespace

PositionMethod polynomialPosition() {
  return {"polynomial",
          "Polynomial",
          "Kindratenko 1999; Ikits, Brederson, Hansen, Hollerbach 2001; survey by Kindratenko, section 3.4, eq. 14-15",
          {degreeSetting()},
          fitPolynomial,
          loadPolynomial};
}

}  // namespace fieldtrue
