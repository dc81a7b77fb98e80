#include "calib/correctors/shared_settings.h"

#include "calib/correctors/polynomial_field.h"

namespace fieldtrue {

Setting degreeSetting() {
  return {.key = "degree",
          .label = "Degree",
          .type = SettingType::kAutoNumber,
          .unit = "",
          .min = 1,
          .max = PolynomialField::kMaxDegree,
          .default_value = 3.0,
          .choices = {},
          .help =
              "Highest total power of x, y and z; each axis needs one level of places more than the degree. auto: "
              "the lowest degree that predicts left-out places as well as the best one.",
          .whole = true};
}

Setting r2Setting() {
  return {.key = "r2_cm2",
          .label = "R squared",
          .type = SettingType::kAutoNumber,
          .unit = "cm2",
          .min = 10.0,
          .max = 1000.0,
          .default_value = 100.0,
          .choices = {},
          .help =
              "Smoothness of the multiquadric: larger is smoother; auto takes what predicts left-out places best. The "
              "survey gives 10 to 1000 without a unit; read as cm2."};
}

Setting errorFrameSetting() {
  return {.key = "error_frame",
          .label = "Error frame",
          .type = SettingType::kChoice,
          .unit = "",
          .min = 0.0,
          .max = 0.0,
          .default_value = std::string("tracker"),
          .choices = {"tracker", "sensor"},
          .help = "Where the error rotation is taken to be the same for every orientation of the sensor at a place."};
}

}  // namespace fieldtrue
