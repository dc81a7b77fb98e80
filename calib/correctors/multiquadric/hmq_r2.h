#pragma once

#include <Eigen/Core>
#include <string>

#include "calib/core/error.h"
#include "calib/core/run_control.h"
#include "calib/core/settings.h"
#include "calib/correctors/base/fit_checks.h"

namespace fieldtrue::correctors {

/// R squared of a multiquadric, and how it was chosen.
struct ChosenR2 {
  double r2_m2 = 0.0;
  std::string note;  ///< One sentence where the data chose it.
};

/// The setting `r2_cm2`: its number, or with `auto` the value whose leave-one-out residuals over places are smallest.
/// The residual of a place is alpha_i / (M^-1)_ii, without fitting anew. Nine values evenly spaced in the logarithm
/// over the setting's range are tried, then twice nine more between the neighbours of the best.
/// @param values at the places, one column an output
/// @param residual_text how a residual of these values is named in the note, e.g. formats metres as mm
/// @source Rippa 1999, eq. 5 (closed form)
/// @error kDegenerate when no value in the range can be solved; kUnsupported; kCancelled
Result<ChosenR2> chooseR2(const std::string& name, const Places& places, const Eigen::MatrixXd& values,
                          const Settings& settings, std::string (*residual_text)(double rms),
                          const RunControl& control);

/// Matrices of all places alive at once while R squared is chosen, or later while places are held out.
double multiquadricMatrices(std::size_t n_places);

/// `r2_cm2`, R^2 of the multiquadric, `auto` or 10 to 1000 cm2, default 100 (R = 10 cm, the geometric middle of the
/// range). The range is Zachmann's as the survey gives it, without a unit; cm2 is our reading.
Setting r2Setting();

}  // namespace fieldtrue::correctors
