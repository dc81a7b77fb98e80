#include "calib/correctors/multiquadric/hmq_field.h"

#include <algorithm>
#include <array>

#include "calib/correctors/multiquadric/hmq_kernel.h"
#include "calib/correctors/multiquadric/hmq_system.h"

namespace fieldtrue::correctors {

Result<MultiquadricField> MultiquadricField::fit(const std::string& name, const Places& places,
                                                 const Eigen::MatrixXd& values, double r2_m2,
                                                 const RunControl& control) {
  FT_TRY(const auto system, MultiquadricSystem::factorise(name, places, r2_m2, control));
  FT_TRY(const auto alpha, system.solve(values));
  return MultiquadricField(system.centers_m(), alpha, r2_m2);
}

MultiquadricField::MultiquadricField(Eigen::MatrixX3d centers_m, Eigen::MatrixXd alpha, double r2_m2)
    : centers_m_(std::move(centers_m)), alpha_(std::move(alpha)), r2_m2_(r2_m2) {
  FT_CHECK(alpha_.rows() == centers_m_.rows() && alpha_.cols() > 0 && alpha_.cols() <= Outputs::MaxRowsAtCompileTime &&
           r2_m2 > 0.0);
}

MultiquadricField::Outputs MultiquadricField::value(const Eigen::Vector3d& p_m) const {
  constexpr Eigen::Index kBlock = 256;
  std::array<double, kBlock> w_m;
  Outputs f = Outputs::Zero(alpha_.cols());
  for (Eigen::Index first = 0; first < centers_m_.rows(); first += kBlock) {
    MultiquadricArrays block = arraysOf(centers_m_, r2_m2_, first);
    block.count = std::min(block.count, w_m.size());
    multiquadricWeights(block, p_m.data(), w_m.data());
    for (Eigen::Index k = 0; k < f.size(); ++k) f[k] += dotProduct(&alpha_(first, k), w_m.data(), block.count);
  }
  return f;
}

Eigen::Vector3d MultiquadricField::value3(const Eigen::Vector3d& p_m) const {
  FT_CHECK(alpha_.cols() == 3);
  const double* const alpha[] = {alpha_.col(0).data(), alpha_.col(1).data(), alpha_.col(2).data()};
  Eigen::Vector3d f;
  multiquadricSums(arraysOf(centers_m_, r2_m2_), alpha, p_m.data(), f.data());
  return f;
}

Eigen::Matrix3d MultiquadricField::gradient3(const Eigen::Vector3d& p_m) const {
  const Eigen::MatrixX3d from_center_m = (-centers_m_).rowwise() + p_m.transpose();
  const Eigen::VectorXd w_m = (from_center_m.rowwise().squaredNorm().array() + r2_m2_).sqrt();
  return alpha_.transpose() * w_m.cwiseInverse().asDiagonal() * from_center_m;
}

nlohmann::json MultiquadricField::toJson() const {
  return {{"r2_m2", r2_m2_}, {"centers_m", jsonOf(Eigen::MatrixXd(centers_m_))}, {"alpha", jsonOf(alpha_)}};
}

MultiquadricField MultiquadricField::fromJson(const JsonReader& json, Eigen::Index outputs) {
  const Eigen::MatrixXd centers_m = json["centers_m"].matrix(3);
  const Eigen::MatrixXd alpha = json["alpha"].matrix(outputs);
  const double r2_m2 = json["r2_m2"].number();
  if (centers_m.rows() != alpha.rows() || centers_m.rows() == 0 || !(r2_m2 > 0.0))
    json.fail("needs as many coefficients as centres and a positive r2_m2.");
  return MultiquadricField(centers_m, alpha, r2_m2);
}

}  // namespace fieldtrue::correctors
