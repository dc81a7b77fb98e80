#pragma once

#include <string>
#include <vector>

#include "calib/identify/linearized_model.h"

namespace fieldtrue::identify {

/// One kind of error that the catalogue does not hold, looked for in what a model leaves: few parameters each, so that
/// a weak one shows where a test of everything at once would drown it.
struct Trace {
  std::string text;        ///< What it would mean, for the report.
  double p_value = 1.0;    ///< F test, times the number of places where the same kind was looked for.
  double explained = 0.0;  ///< Sum of squares that it would explain beyond chance, in whitened units.
};

/// Layers bent or entered wrongly in their own plane, a sensor that remembers the place before, coil gains that change
/// during the session, a sensor that changed at some time, a gain that follows the place, a thing in the room that did
/// not stand there alike all the time.
/// @param state that `at` is linearised about
/// @return most significant first
/// @source F test of added regressors: Seber and Lee 2003, Linear Regression Analysis, section 4.3
std::vector<Trace> findTraces(const Linearized& at, const GapRows& rows, const GapModel& state);

/// Upper tail of F with d1, d2 degrees of freedom. @source Paulson 1942, Ann. Math. Statist. 13 233
double tailOfF(double f, double d1, double d2);

/// Square roots of robust weights of each residual by its row's and kind's distance, 1 below twice the median's scale.
Eigen::VectorXd robustWeights(const Eigen::VectorXd& left, Eigen::Index n_rows, int channels);

}  // namespace fieldtrue::identify
