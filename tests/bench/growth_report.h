#pragma once

#include <string>
#include <vector>

namespace fieldtrue::bench {

/// One method's times over the number of places.
struct GrowthCurve {
  struct Point {
    int n = 0;
    double fit_s = 0.0;
    double evaluation_ns = 0.0;
  };
  std::string method;
  std::vector<Point> points;
  std::string remark;  ///< What was not measured, and why; empty when everything was.
};

/// One HTML page with two plots on logarithmic axes, of fit and of evaluation time, and a table of all figures.
/// @param conditions one sentence on how it was measured
std::string growthPage(const std::vector<GrowthCurve>& curves, const std::string& conditions);

}  // namespace fieldtrue::bench
