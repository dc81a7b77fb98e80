#include "calib/correctors/multiquadric/hmq_single.h"

#include <algorithm>
#include <array>
#include <random>

#include "calib/correctors/multiquadric/hmq_field.h"
#include "calib/correctors/multiquadric/hmq_kernel.h"

namespace fieldtrue::correctors {

SingleMultiquadricField::SingleMultiquadricField(const MultiquadricField& field)
    : r2_m2_(static_cast<float>(field.r2_m2())) {
  FT_CHECK(field.outputs() == 3);
  for (std::size_t j = 0; j < field.size(); ++j) origin_m_ += field.center_m(j);
  origin_m_ /= static_cast<double>(field.size());
  for (std::size_t j = 0; j < field.size(); ++j) {
    const Eigen::Vector3f from_origin_m = (field.center_m(j) - origin_m_).cast<float>();
    x_m_.push_back(from_origin_m.x());
    y_m_.push_back(from_origin_m.y());
    z_m_.push_back(from_origin_m.z());
    alpha_x_.push_back(static_cast<float>(field.alpha(0)[j]));
    alpha_y_.push_back(static_cast<float>(field.alpha(1)[j]));
    alpha_z_.push_back(static_cast<float>(field.alpha(2)[j]));
  }
}

void SingleMultiquadricField::value3(std::span<const Eigen::Vector3d> p_m, std::span<Eigen::Vector3d> f) const {
  FT_CHECK(f.size() == p_m.size());
  constexpr std::size_t kBlock = 64;
  std::array<float, 3 * kBlock> from_origin_m;
  std::array<float, 3 * kBlock> sums;
  const MultiquadricArraysSingle terms{x_m_.data(),     y_m_.data(),     z_m_.data(), alpha_x_.data(),
                                       alpha_y_.data(), alpha_z_.data(), x_m_.size(), r2_m2_};
  for (std::size_t start = 0; start < p_m.size(); start += kBlock) {
    const std::size_t count = std::min(kBlock, p_m.size() - start);
    for (std::size_t i = 0; i < count; ++i)
      Eigen::Vector3f::Map(&from_origin_m[3 * i]) = (p_m[start + i] - origin_m_).cast<float>();
    multiquadricSumsSingle(terms, from_origin_m.data(), count, sums.data());
    for (std::size_t i = 0; i < count; ++i) f[start + i] = Eigen::Vector3f::Map(&sums[3 * i]).cast<double>();
  }
}

double SingleMultiquadricField::largestDeviation(const MultiquadricField& field, std::size_t n_points) const {
  Eigen::Vector3d low_m = field.center_m(0);
  Eigen::Vector3d high_m = low_m;
  std::vector<Eigen::Vector3d> points_m;
  for (std::size_t j = 0; j < field.size(); ++j) {
    points_m.push_back(field.center_m(j));
    low_m = low_m.cwiseMin(points_m.back());
    high_m = high_m.cwiseMax(points_m.back());
  }
  std::mt19937_64 generator(1);
  // The generator's own bits, since the standard leaves its distributions to each library.
  const auto uniform = [&] { return static_cast<double>(generator() >> 11) * 0x1p-53; };
  while (points_m.size() < n_points) {
    const double a = uniform(), b = uniform(), c = uniform();
    points_m.emplace_back(low_m + Eigen::Vector3d(a, b, c).cwiseProduct(high_m - low_m));
  }
  std::vector<Eigen::Vector3d> exact(points_m.size());
  std::vector<Eigen::Vector3d> single(points_m.size());
  field.value3(points_m, exact);
  value3(points_m, single);
  double largest = 0.0;
  for (std::size_t i = 0; i < points_m.size(); ++i) largest = std::max(largest, (exact[i] - single[i]).norm());
  return largest;
}

}  // namespace fieldtrue::correctors
