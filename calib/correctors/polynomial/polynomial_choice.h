#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "calib/core/json_reader.h"
#include "calib/core/run_control.h"
#include "calib/core/settings.h"
#include "calib/correctors/base/fit_data.h"
#include "calib/correctors/polynomial/polynomial_field.h"
#include "calib/correctors/polynomial/polynomial_hold_out.h"

namespace fieldtrue::correctors {

/// What a polynomial method fits: one 3-vector a row of the fit data.
struct PolynomialTask {
  std::string label;  ///< Stands in messages before "of degree 3", e.g. "Quaternion polynomial".
  const FitData& data;
  std::vector<Eigen::Vector3d> values;
};

/// The degree to fit, and what is to be told about how it was found; empty when it was given.
struct PolynomialDegree {
  int degree = 3;
  std::string note;
};

/// A fitted polynomial and how its degree was found.
struct ChosenPolynomial {
  PolynomialField field;
  std::string degree_note;  ///< Empty when the degree was given.

  /// Everything the user should know about it; empty when nothing.
  std::string note() const;
  nlohmann::json toJson() const;
  static ChosenPolynomial fromJson(const JsonReader& json);
};

/// The degree that the setting `degree` asks for. For `auto` every degree from 1 to 6 that the places determine is
/// scored by leaving out each place in turn, and the lowest one wins whose squared error is within one standard error
/// (of the difference, place by place) of the best.
/// @error kDegenerate, kTooFewNodes where the places do not even determine degree 1; kCancelled
/// @source Breiman, Friedman, Olshen, Stone 1984, Classification and Regression Trees, section 3.4.3
Result<PolynomialDegree> degreeFor(const PolynomialTask& task, const Settings& settings, const RunControl& control);

/// Fits the degree that the settings ask for. @error as PolynomialField::fit and degreeFor
Result<ChosenPolynomial> fitChosenPolynomial(const PolynomialTask& task, const Settings& settings,
                                             const RunControl& control);

/// "Quaternion polynomial of degree 3".
std::string degreeName(const std::string& label, int degree);

/// `degree` of a polynomial, 1 to 6 or auto, default 3: degree 4 needs five levels along every axis, more than a usual
/// grid has.
Setting degreeSetting();

}  // namespace fieldtrue::correctors
