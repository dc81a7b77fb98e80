#include "calib/effects/metal_plane.h"

#include "calib/effects/parameters.h"

namespace fieldtrue {

namespace {

class MetalPlane final : public CouplingDistortion {
 public:
  /// @param toward unit, from the transmitter straight to the plane
  /// @param reflection 1 for a perfect conductor, -(mu_r - 1)/(mu_r + 1) for a permeable half-space
  MetalPlane(const Eigen::Vector3d& toward, double distance_m, double reflection)
      : toward_(toward),
        distance_m_(distance_m),
        image_(reflection * (Eigen::Matrix3d::Identity() - 2.0 * toward * toward.transpose())) {}

  Eigen::Matrix3d fieldChange(const Eigen::Vector3d& p_sensor_m, double dipole_constant_m3,
                              double /*time_s*/) const override {
    return dipoleField(p_sensor_m - 2.0 * distance_m_ * toward_, dipole_constant_m3) * image_;
  }

  bool admits(const Eigen::Vector3d& p_sensor_m) const override { return toward_.dot(p_sensor_m) < distance_m_; }

 private:
  Eigen::Vector3d toward_;
  double distance_m_;
  Eigen::Matrix3d image_;  ///< Moment of the image per moment of the transmitter.
};

Result<std::unique_ptr<PhysicalEffect>> make(const nlohmann::json& parameters, const Excitation& /*excitation*/) {
  const Eigen::Vector3d toward = vectorOf(parameters, "toward");
  if (toward.norm() < 1e-6) {
    return fail(ErrorCode::kBadInput, "metal_plane: toward is " + textOf(toward) +
                                          "; it must point from the transmitter straight to the plane.");
  }
  const double mu_r = scalarOf(parameters, "relative_permeability");
  const double ideal = isFerromagnetic(parameters) ? -(mu_r - 1.0) / (mu_r + 1.0) : 1.0;
  return std::make_unique<MetalPlane>(toward.normalized(), scalarOf(parameters, "distance_m"),
                                      ideal * scalarOf(parameters, "strength"));
}

}  // namespace

Effect metalPlaneEffect() {
  Effect effect;
  effect.id = "metal_plane";
  effect.label = "Metal floor, wall or ceiling";
  effect.source = "Jackson 1999, Classical Electrodynamics, problem 5.17 (method of images)";
  effect.parameters = {{"toward",
                        "",
                        "vector3",
                        {0.0, 0.0, -1.0},
                        0.0,
                        0.0,
                        "Direction from the transmitter straight to the plane, tracker frame; any length.",
                        {}},
                       {"distance_m", "m", "scalar", 1.5, 0.05, 100.0, "From the transmitter to the plane.", {}},
                       materialParameter(),
                       permeabilityParameter(),
                       {"strength",
                        "",
                        "scalar",
                        1.0,
                        0.0,
                        1.0,
                        "Share of an ideal plane's image; below 1 for mesh, reinforcement or panels with gaps.",
                        {}}};
  effect.make = make;
  return effect;
}

}  // namespace fieldtrue
