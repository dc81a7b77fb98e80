#include "calib/correctors/base/place_rotations.h"

#include <algorithm>

#include "calib/core/statistics.h"

namespace fieldtrue::correctors {

std::vector<Eigen::Quaterniond> placeErrorRotations(const FitData& data, const Places& places, ErrorFrame frame) {
  const std::vector<Eigen::Quaterniond> q_error = errorRotations(data, frame);
  std::vector<Eigen::Quaterniond> averages;
  averages.reserve(places.size());
  for (const std::vector<std::size_t>& rows : places.rows) {
    std::vector<Eigen::Quaterniond> visits;
    for (const std::size_t row : rows) visits.push_back(q_error[row]);
    averages.push_back(canonical(visits.size() == 1 ? visits.front().normalized() : meanRotation(visits)));
  }
  return averages;
}

Eigen::Quaterniond weightedRotation(std::span<const Eigen::Quaterniond> rotations, std::span<const double> weights) {
  FT_CHECK(!rotations.empty() && rotations.size() == weights.size());
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const double sign = rotations[i].dot(rotations[0]) < 0.0 ? -1.0 : 1.0;
    sum += sign * weights[i] * rotations[i].coeffs();
  }
  constexpr double kVanishing = 1e-9;
  if (sum.norm() > kVanishing) return Eigen::Quaterniond(sum).normalized();
  return rotations[static_cast<std::size_t>(std::max_element(weights.begin(), weights.end()) - weights.begin())];
}

}  // namespace fieldtrue::correctors
