#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/polynomial/polynomial_choice.h"
#include "calib/correctors/polynomial/polynomial_position.h"

namespace fieldtrue::correctors {
namespace {

const std::string kLabel = "Polynomial";

Result<PolynomialDegree> degreeOf(const FitData& data, const Settings& settings, const RunControl& control) {
  FT_TRY_VOID(checkPositions(data, kLabel));
  return degreeFor({kLabel, data, displacements_m(data)}, settings, control);
}

Result<std::unique_ptr<PositionModel>> fitPolynomial(const FitData& data, const Settings& settings,
                                                     const RunControl& control) {
  FT_TRY(const auto degree, degreeOf(data, settings, control));
  return fitPolynomialPosition(data, degree, degreeName(kLabel, degree.degree));
}

Result<std::unique_ptr<HoldOutFits<PositionModel>>> holdOutPolynomial(const FitData& data, const Settings& settings,
                                                                      const RunControl& control) {
  FT_TRY(const auto degree, degreeOf(data, settings, control));
  return holdOutPolynomialPosition(data, degree, degreeName(kLabel, degree.degree));
}

}  // namespace

PositionMethod polynomialPosition() {
  return {
      .id = "polynomial",
      .label = "Polynomial",
      .source =
          "Kindratenko 1999; Ikits, Brederson, Hansen, Hollerbach 2001; survey by Kindratenko, section 3.4, eq. 14-15",
      .settings = {degreeSetting()},
      .fit = fitPolynomial,
      .read = readPolynomialPosition,
      .hold_out = holdOutPolynomial,
      .origin = MethodOrigin::kSurvey,
      .tries = {{"degree=2", 3},
                {"degree=3", 4},
                {"degree=4", simplicity::kSmoothing},
                {"degree=5", simplicity::kSmoothing},
                {"degree=6", simplicity::kSmoothing}}};
}

}  // namespace fieldtrue::correctors
