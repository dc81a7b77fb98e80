#pragma once

#include <interpolation.h>
#include <vtkSmartPointer.h>
#include <vtkThinPlateSplineTransform.h>

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "calib/correctors/base/fit_data.h"

namespace fieldtrue::bench {

inline constexpr double kR_m = 0.1;  ///< The default R squared, 100 cm2, for us and for the peers.

/// ALGLIB's multiquadric through the same places.
alglib::rbfmodel fitAlglib(const correctors::FitData& data);

/// VTK's thin-plate spline through the same places.
vtkSmartPointer<vtkThinPlateSplineTransform> fitVtk(const correctors::FitData& data);

/// The textbook loop: one structure a centre.
struct PlainMultiquadric {
  struct Term {
    Eigen::Vector3d center_m;
    Eigen::Vector3d alpha;
  };
  std::vector<Term> terms;

  Eigen::Vector3d value(const Eigen::Vector3d& p_m) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Term& term : terms) sum += term.alpha * std::sqrt((p_m - term.center_m).squaredNorm() + kR_m * kR_m);
    return sum;
  }
};
PlainMultiquadric plainTerms(const correctors::FitData& data);

/// Seconds that SciPy's RBFInterpolator takes with one thread, measured by itself in a process of its own: "fit",
/// "one point" and "100,000 points".
struct ScipyTimes {
  std::string version;
  std::map<std::string, double> times_s;
};

/// @return none, with a remark on stderr, where no python3 with SciPy is installed
std::optional<ScipyTimes> runScipy(const correctors::FitData& data, const std::vector<Eigen::Vector3d>& points_m);

}  // namespace fieldtrue::bench
