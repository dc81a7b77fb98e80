#include "calib/correctors/multiquadric/hmq_field.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "calib/core/json_reader.h"
#include "calib/correctors/multiquadric/hmq_kernel.h"
#include "calib/correctors/multiquadric/hmq_mixed.h"
#include "calib/correctors/multiquadric/hmq_system.h"

namespace fieldtrue::correctors {
namespace {

constexpr std::size_t kBlock = 256;

}  // namespace

Result<MultiquadricField> MultiquadricField::fit(const std::string& name, std::span<const Eigen::Vector3d> centers_m,
                                                 std::span<const int> node, std::span<const std::array<int, 3>> index,
                                                 const Eigen::MatrixXd& values, double r2_m2,
                                                 const RunControl& control) {
  FT_TRY_VOID(checkMultiquadricCenters(name, centers_m, node, index, control));
  if (values.cols() == 3)
    if (const auto alpha = solveMultiquadricMixed(centers_m, r2_m2, values))
      return MultiquadricField(centers_m, *alpha, r2_m2);
  FT_TRY(const auto system, MultiquadricSystem::factorise(name, centers_m, node, index, r2_m2, control));
  FT_TRY(const auto alpha, system.solve(values));
  return MultiquadricField(centers_m, alpha, r2_m2);
}

MultiquadricField::MultiquadricField(std::span<const Eigen::Vector3d> centers_m, const Eigen::MatrixXd& alpha,
                                     double r2_m2)
    : r2_m2_(r2_m2), outputs_(static_cast<std::size_t>(alpha.cols())) {
  FT_CHECK(static_cast<std::size_t>(alpha.rows()) == centers_m.size() && r2_m2 > 0.0);
  for (const Eigen::Vector3d& p_m : centers_m) {
    x_m_.push_back(p_m.x());
    y_m_.push_back(p_m.y());
    z_m_.push_back(p_m.z());
  }
  for (Eigen::Index k = 0; k < alpha.cols(); ++k) alpha_.emplace_back(alpha.col(k).begin(), alpha.col(k).end());
}

void MultiquadricField::value(const Eigen::Vector3d& p_m, std::span<double> f) const {
  FT_CHECK(f.size() == outputs_);
  std::array<double, kBlock> w_m;
  std::fill(f.begin(), f.end(), 0.0);
  for (std::size_t start = 0; start < x_m_.size(); start += kBlock) {
    const std::size_t count = std::min(kBlock, x_m_.size() - start);
    const MultiquadricArrays block{x_m_.data() + start, y_m_.data() + start, z_m_.data() + start, count, r2_m2_};
    multiquadricWeights(block, p_m.data(), w_m.data());
    for (std::size_t k = 0; k < outputs_; ++k) f[k] += dotProduct(alpha(k) + start, w_m.data(), count);
  }
}

void MultiquadricField::value3(std::span<const Eigen::Vector3d> p_m, std::span<Eigen::Vector3d> f) const {
  static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double));
  FT_CHECK(outputs_ == 3 && f.size() == p_m.size());
  if (p_m.empty()) return;
  const MultiquadricArrays arrays{x_m_.data(), y_m_.data(), z_m_.data(), x_m_.size(), r2_m2_};
  multiquadricSums(arrays, alpha(0), alpha(1), alpha(2), p_m.front().data(), p_m.size(), f.front().data());
}

Eigen::Matrix3d MultiquadricField::gradient3(const Eigen::Vector3d& p_m) const {
  FT_CHECK(outputs_ == 3);
  Eigen::Matrix3d gradient = Eigen::Matrix3d::Zero();
  for (std::size_t j = 0; j < x_m_.size(); ++j) {
    const Eigen::Vector3d from_center_m = p_m - center_m(j);
    const Eigen::Vector3d alpha_j(alpha(0)[j], alpha(1)[j], alpha(2)[j]);
    gradient += alpha_j * from_center_m.transpose() / std::sqrt(from_center_m.squaredNorm() + r2_m2_);
  }
  return gradient;
}

nlohmann::json MultiquadricField::toJson() const {
  nlohmann::json centers = nlohmann::json::array();
  nlohmann::json alphas = nlohmann::json::array();
  for (std::size_t j = 0; j < x_m_.size(); ++j) {
    centers.push_back({x_m_[j], y_m_[j], z_m_[j]});
    nlohmann::json row = nlohmann::json::array();
    for (std::size_t k = 0; k < outputs_; ++k) row.push_back(alpha(k)[j]);
    alphas.push_back(std::move(row));
  }
  return {{"r2_m2", r2_m2_}, {"centers_m", std::move(centers)}, {"alpha", std::move(alphas)}};
}

MultiquadricField MultiquadricField::fromJson(const JsonReader& json, std::size_t outputs) {
  const Eigen::MatrixXd centers = json["centers_m"].matrix(3);
  const Eigen::MatrixXd alphas = json["alpha"].matrix(static_cast<Eigen::Index>(outputs));
  const double r2_m2 = json["r2_m2"].number();
  if (centers.rows() != alphas.rows() || centers.rows() == 0 || !(r2_m2 > 0.0))
    json.fail("needs as many coefficients as centres and a positive r2_m2.");
  std::vector<Eigen::Vector3d> centers_m;
  for (Eigen::Index j = 0; j < centers.rows(); ++j) centers_m.emplace_back(centers.row(j).transpose());
  return MultiquadricField(centers_m, alphas, r2_m2);
}

}  // namespace fieldtrue::correctors
