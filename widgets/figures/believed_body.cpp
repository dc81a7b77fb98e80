#include "widgets/figures/believed_body.h"

#include <algorithm>
#include <cmath>

#include "calib/core/number_text.h"

namespace fieldtrue::widgets {

double largestHalf_m(const BelievedBody& body) {
  if (body.shape == effects::DrawnShape::kPlane)
    return std::max(std::abs(body.nearest_m.value_or(0.0)), std::abs(body.farthest_m.value_or(0.0)));
  return body.region_m.colwise().norm().maxCoeff();
}

std::string bodyLabel(const BelievedBody& body) {
  const double exact_cm = 100.0 * largestHalf_m(body);
  const double half_cm = exact_cm < 10.0 ? 0.1 * std::round(10.0 * exact_cm) : std::round(exact_cm);
  return half_cm > 0.0 ? body.name + ", \xC2\xB1 " + shortNumber(half_cm) + " cm" : body.name;
}

}  // namespace fieldtrue::widgets
