#include "calib/correctors/polynomial.h"

#include "calib/correctors/fit_checks.h"
#include "calib/correctors/polynomial_choice.h"
#include "calib/correctors/polynomial_position.h"
#include "calib/correctors/shared_settings.h"

namespace fieldtrue {
namespace {

const std::string kLabel = "Polynomial";

Result<PolynomialDegree> degreeOf(const FitData& data, const Settings& settings, const RunControl& control) {
  if (auto checked = checkPositions(data, kLabel); !checked) return tl::unexpected(checked.error());
  return degreeFor({kLabel, data, displacements_m(data)}, settings, control);
}

Result<std::unique_ptr<PositionModel>> fitPolynomial(const FitData& data, const Settings& settings,
                                                     const RunControl& control) {
  const auto degree = degreeOf(data, settings, control);
  if (!degree) return tl::unexpected(degree.error());
  return fitPolynomialPosition(data, *degree, degreeName(kLabel, degree->degree));
}

Result<std::unique_ptr<HoldOutFits<PositionModel>>> holdOutPolynomial(const FitData& data, const Settings& settings,
                                                                      const RunControl& control) {
  const auto degree = degreeOf(data, settings, control);
  if (!degree) return tl::unexpected(degree.error());
  return holdOutPolynomialPosition(data, *degree, degreeName(kLabel, degree->degree));
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
          loadPolynomial,
          holdOutPolynomial};
}

}  // namespace fieldtrue
