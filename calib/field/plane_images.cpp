#include "calib/field/plane_images.h"

#include <Eigen/Core>
#include <Eigen/SVD>
#include <cmath>

namespace fieldtrue::field {

namespace {

constexpr int kDepths = 28;
constexpr double kShallowest_m = 0.004;
constexpr double kDeepest_m = 60.0;
constexpr int kWaveNumbers = 90;
constexpr double kLongestWave_per_m = 0.02;
constexpr double kShortestWave_per_m = 60.0;
/// Directions in which the images could grow without changing the reflection are left out.
constexpr double kSmallestSingular = 1e-9;
constexpr double kNoImage = 1e-12;

double spaced(double low, double high, int index, int count) {
  return low * std::pow(high / low, static_cast<double>(index) / (count - 1));
}

}  // namespace

std::vector<PlaneImage> planeImages(const Metal& metal, std::optional<double> thickness_m,
                                    const Excitation& excitation) {
  Eigen::VectorXd deeper_m(kDepths);
  for (int j = 0; j < kDepths; ++j) {
    deeper_m[j] = j == 0 ? 0.0 : spaced(kShallowest_m, kDeepest_m, j - 1, kDepths - 1);
  }
  Eigen::MatrixXd decays(kWaveNumbers, kDepths);
  Eigen::VectorXd reflections(kWaveNumbers);
  for (int i = 0; i < kWaveNumbers; ++i) {
    const double k_per_m = spaced(kLongestWave_per_m, kShortestWave_per_m, i, kWaveNumbers);
    reflections[i] = seenResponse(
        [&](std::complex<double> s) { return slabReflection(k_per_m, metal, thickness_m, s); }, excitation);
    decays.row(i) = (-k_per_m * deeper_m.array()).exp();
  }
  Eigen::JacobiSVD<Eigen::MatrixXd> svd(decays, Eigen::ComputeThinU | Eigen::ComputeThinV);
  svd.setThreshold(kSmallestSingular);
  const Eigen::VectorXd strengths = svd.solve(reflections);
  std::vector<PlaneImage> images;
  for (int j = 0; j < kDepths; ++j) {
    if (std::abs(strengths[j]) > kNoImage) images.push_back({deeper_m[j], strengths[j]});
  }
  return images;
}

double reflectionOf(const std::vector<PlaneImage>& images, double k_per_m) {
  double sum = 0.0;
  for (const PlaneImage& image : images) sum += image.strength * std::exp(-k_per_m * image.deeper_m);
  return sum;
}

}  // namespace fieldtrue::field
