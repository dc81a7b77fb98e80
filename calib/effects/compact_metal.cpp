#include "calib/effects/compact_metal.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

#include "calib/core/file_io.h"
#include "calib/effects/parameters.h"

namespace fieldtrue {

namespace {

constexpr double kFourPi = 4.0 * std::numbers::pi;

class CompactMetal final : public CouplingDistortion {
 public:
  CompactMetal(const Eigen::Vector3d& center_m, const Eigen::Matrix3d& polarizability_m3, double radius_m)
      : center_m_(center_m),
        radius_m_(radius_m),
        moment_m3_(polarizability_m3 * dipoleField(center_m, 1.0 / kFourPi)) {}

  Eigen::Matrix3d fieldChange(const Eigen::Vector3d& p_sensor_m, double dipole_constant_m3,
                              double /*time_s*/) const override {
    return dipoleField(p_sensor_m - center_m_, dipole_constant_m3) * moment_m3_;
  }

  bool admits(const Eigen::Vector3d& p_sensor_m) const override { return (p_sensor_m - center_m_).norm() > radius_m_; }

 private:
  Eigen::Vector3d center_m_;
  double radius_m_;
  Eigen::Matrix3d moment_m3_;  ///< A G(b) / (4 pi) for C = 1.
};

/// No body answers more strongly than the permeable sphere of A = 4 pi a^3: one of polarizability A is at least this
/// big.
double smallestRadius_m(const Eigen::Matrix3d& polarizability_m3) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(polarizability_m3, Eigen::EigenvaluesOnly);
  return std::cbrt(eigen.eigenvalues().cwiseAbs().maxCoeff() / kFourPi);
}

Eigen::Matrix3d matrixOf(const nlohmann::json& list) {
  Eigen::Matrix3d matrix;
  for (int i = 0; i < 9; ++i) matrix(i / 3, i % 3) = list.at(static_cast<std::size_t>(i)).get<double>();
  return matrix;
}

Result<std::unique_ptr<PhysicalEffect>> make(const nlohmann::json& parameters, const Excitation& /*excitation*/) {
  const Eigen::Vector3d center_m = vectorOf(parameters, "center_m");
  double radius_m = scalarOf(parameters, "radius_m");
  Eigen::Matrix3d polarizability_m3;
  if (parameters.at("polarizability_m3").is_null()) {
    polarizability_m3 =
        Eigen::Matrix3d::Identity() *
        spherePolarizability_m3(radius_m, isFerromagnetic(parameters), scalarOf(parameters, "relative_permeability"));
  } else {
    polarizability_m3 = matrixOf(parameters.at("polarizability_m3"));
    radius_m = smallestRadius_m(polarizability_m3);
  }
  if (center_m.norm() <= radius_m) {
    return fail(ErrorCode::kBadInput, "compact_metal: center_m " + textOf(center_m) +
                                          " puts the transmitter inside the body, which has a radius of " +
                                          formatNumber(radius_m) +
                                          " m; the centre must be farther from the transmitter.");
  }
  return makeCompactMetal(center_m, polarizability_m3, radius_m);
}

}  // namespace

double spherePolarizability_m3(double radius_m, bool is_ferromagnetic, double relative_permeability) {
  const double a3 = radius_m * radius_m * radius_m;
  if (!is_ferromagnetic) return -2.0 * std::numbers::pi * a3;
  return kFourPi * a3 * (relative_permeability - 1.0) / (relative_permeability + 2.0);
}

std::unique_ptr<CouplingDistortion> makeCompactMetal(const Eigen::Vector3d& center_m,
                                                     const Eigen::Matrix3d& polarizability_m3, double radius_m) {
  return std::make_unique<CompactMetal>(center_m, polarizability_m3, radius_m);
}

Effect compactMetalEffect() {
  Effect effect;
  effect.id = "compact_metal";
  effect.label = "Compact metal body";
  effect.source = "Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709; sphere: Wait 1951, Geophysics 16 666";
  effect.parameters = {
      {"center_m", "m", "vector3", {1.0, 0.0, -1.0}, -100.0, 100.0, "Middle of the body, tracker frame.", {}},
      {"radius_m", "m", "scalar", 0.1, 0.001, 10.0, "Radius of a sphere that answers as the body does.", {}},
      materialParameter(),
      permeabilityParameter(),
      {"polarizability_m3",
       "m^3",
       "matrix3",
       nullptr,
       -1e4,
       1e4,
       "Induced moment per field, tracker axes; when given, radius, material and permeability are not used.",
       {}}};
  effect.make = make;
  return effect;
}

}  // namespace fieldtrue
