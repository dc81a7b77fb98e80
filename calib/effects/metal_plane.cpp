#include <algorithm>
#include <cmath>

#include "calib/core/file_io.h"
#include "calib/effects/parameters.h"
#include "calib/effects/room_search.h"
#include "calib/effects/rows.h"
#include "calib/field/plane_images.h"

namespace fieldtrue::effects {

namespace metal_plane {
namespace {

class MetalPlane final : public field::CouplingDistortion {
 public:
  /// @param toward unit, from the transmitter straight to the plane
  /// @param images of the transmitter; 1 is that of a perfect conductor, -(mu_r - 1)/(mu_r + 1) of a permeable
  /// half-space
  MetalPlane(const Eigen::Vector3d& toward, double distance_m, std::vector<field::PlaneImage> images)
      : toward_(toward),
        distance_m_(distance_m),
        images_(std::move(images)),
        mirror_(Eigen::Matrix3d::Identity() - 2.0 * toward * toward.transpose()) {}

  Eigen::Matrix3d fieldChange(const Eigen::Vector3d& p_sensor_m, double dipole_constant_m3,
                              double /*time_s*/) const override {
    Eigen::Matrix3d field = Eigen::Matrix3d::Zero();
    for (const field::PlaneImage& image : images_) {
      const Eigen::Vector3d from_image_m = p_sensor_m - (2.0 * distance_m_ + image.deeper_m) * toward_;
      field += field::dipoleField(from_image_m, image.strength * dipole_constant_m3);
    }
    return field * mirror_;
  }

  bool admits(const Eigen::Vector3d& p_sensor_m) const override { return toward_.dot(p_sensor_m) < distance_m_; }

 private:
  Eigen::Vector3d toward_;
  double distance_m_;
  std::vector<field::PlaneImage> images_;
  Eigen::Matrix3d mirror_;  ///< Moment of a perfect conductor's image per moment of the transmitter.
};

/// The images of a plane of full strength.
std::vector<field::PlaneImage> imagesOf(const nlohmann::json& parameters, const field::Excitation& excitation) {
  const bool is_ferromagnetic = isFerromagnetic(parameters);
  const double mu_r = is_ferromagnetic ? scalarOf(parameters, "relative_permeability") : 1.0;
  const nlohmann::json& conductivity = parameters.at("conductivity_s_per_m");
  if (conductivity.is_null()) return {{0.0, is_ferromagnetic ? -(mu_r - 1.0) / (mu_r + 1.0) : 1.0}};
  const nlohmann::json& thickness = parameters.at("thickness_m");
  const std::optional<double> thickness_m = thickness.is_null() ? std::nullopt : std::optional(thickness.get<double>());
  return field::planeImages({conductivity.get<double>(), mu_r}, thickness_m, excitation);
}

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& excitation) {
  const Eigen::Vector3d toward = vectorOf(parameters, "toward");
  if (toward.norm() < 1e-6) {
    return fail(ErrorCode::kBadInput, "metal_plane: toward is " + textOf(toward) +
                                          "; it must point from the transmitter straight to the plane.");
  }
  if (parameters.at("conductivity_s_per_m").is_null() && !parameters.at("thickness_m").is_null()) {
    return fail(ErrorCode::kBadInput,
                "metal_plane: thickness_m is given and conductivity_s_per_m is not; a plane of real metal needs both.");
  }
  std::vector<field::PlaneImage> images = imagesOf(parameters, excitation);
  for (field::PlaneImage& image : images) image.strength *= scalarOf(parameters, "strength");
  return std::make_unique<MetalPlane>(toward.normalized(), scalarOf(parameters, "distance_m"), std::move(images));
}

/// So permeable that the image is ideal to 2e-12.
constexpr double kIdealPermeability = 1e6;
constexpr double kNearestBehindPlaces_m = 0.03;
constexpr double kFarthest_m = 20.0;

class MetalPlaneFit final : public EffectFit {
 public:
  explicit MetalPlaneFit(const FitDesign& design) : search_(design) {}

  std::string name() const override { return "plane"; }

  std::vector<FitParameter> searched() const override {
    std::vector<FitParameter> parameters = DirectionChart::parameters();
    parameters.push_back({"distance_m", "m", 0.05, kFarthest_m});
    return parameters;
  }

  std::vector<FitParameter> linear() const override { return {{"strength", "", -1.1, 1.1}}; }

  std::vector<Eigen::VectorXd> starts() const override {
    std::vector<Eigen::VectorXd> starts;
    for (int n = 0; n < 27; ++n) {  // Towards the faces, edges and corners of a cube.
      const Eigen::Vector3d to = Eigen::Vector3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1).cast<double>();
      if (to.isZero()) continue;
      const Eigen::Vector3d toward = to.normalized();
      const double nearest_m = search_.farthestAlong_m(toward);
      for (const double gap : {0.12, 0.22, 0.4, 0.7, 1.2, 2.0, 3.5}) {
        const double gap_m = std::max(0.08, gap * search_.extent_m());
        const Eigen::VectorXd distance_m = Eigen::VectorXd::Constant(1, nearest_m + gap_m);
        starts.push_back(joined(chart_.angles_rad(toward), distance_m));
      }
    }
    return starts;
  }

  bool allows(const Eigen::VectorXd& searched) const override {
    const double behind_m = searched[2] - search_.farthestAlong_m(chart_.direction(searched[0], searched[1]));
    return searched.allFinite() && behind_m >= kNearestBehindPlaces_m && searched[2] >= 0.05 &&
           searched[2] <= kFarthest_m;
  }

  void respond(std::span<const field::SensorSetting> at, const Eigen::VectorXd& searched,
               std::span<field::EffectResponse> responses) const override {
    const MetalPlane plane(chart_.direction(searched[0], searched[1]), searched[2], {field::PlaneImage{}});
    for (std::size_t i = 0; i < at.size(); ++i) responses[i] = plane.at(at[i]);
  }

  FittedEffect describe(const Eigen::VectorXd& searched, const Eigen::VectorXd& linear) const override {
    const Eigen::Vector3d toward = chart_.direction(searched[0], searched[1]);
    const double strength = linear[0];
    const bool is_conductor = strength >= 0.0;
    const double ideal = is_conductor ? 1.0 : (kIdealPermeability - 1.0) / (kIdealPermeability + 1.0);
    FittedEffect fitted;
    fitted.parameters = {{"toward", {toward.x(), toward.y(), toward.z()}},
                         {"distance_m", searched[2]},
                         {"material", is_conductor ? "conductive" : "ferromagnetic"},
                         {"relative_permeability", kIdealPermeability},
                         {"strength", std::abs(strength) / ideal}};
    fitted.values = {{"toward_x", "", toward.x()},
                     {"toward_y", "", toward.y()},
                     {"toward_z", "", toward.z()},
                     {"distance_m", "m", searched[2]},
                     {"strength", "", strength}};
    fitted.location_m = searched[2] * toward;
    fitted.material = is_conductor ? "conductive" : "ferromagnetic";
    fitted.is_plausible = std::abs(strength) <= 1.1;
    if (!fitted.is_plausible) {
      fitted.doubt = "an image " + formatNumber(std::round(100.0 * std::abs(strength)) / 100.0) +
                     " times as strong as an ideal plane's";
    }
    return fitted;
  }

 private:
  RoomSearch search_;
  DirectionChart chart_;
};

std::vector<std::unique_ptr<EffectFit>> fits(const FitDesign& design) {
  std::vector<std::unique_ptr<EffectFit>> ways;
  ways.push_back(std::make_unique<MetalPlaneFit>(design));
  return ways;
}

}  // namespace
}  // namespace metal_plane

/// A flat metal floor, wall or ceiling much larger than the distances: an image of the transmitter stands behind it.
///
/// A dipole m in front of the plane has the image I m at the mirrored point. A perfect conductor lets no field through
/// it (normal field zero on it): I = 1 - 2nn^T. A permeable half-space: I = -(mu_r - 1)/(mu_r + 1) (1 - 2nn^T), in the
/// limit with the tangential field zero on it. With the image at b
///   dG = strength G(p - b; C) I.
/// A plane of given conductivity, and thickness unless it is solid, has several images further behind it, which
/// together reflect as the tracker's carrier or sampling delay makes it (calib/field/plane_images.h). Edges are not
/// modelled and planes do not mirror each other.
/// @source Jackson 1999, Classical Electrodynamics, problem 5.17 (images in a permeable half-space); perfect conductor:
/// the same with mu_r -> 0; sheet: Saslow 1992, Am. J. Phys. 60 693
Effect metalPlaneEffect() {
  using namespace metal_plane;
  Effect effect;
  effect.id = "metal_plane";
  effect.label = "Metal floor, wall or ceiling";
  effect.source = "Jackson 1999, Classical Electrodynamics, problem 5.17 (method of images)";
  effect.parameters = {
      declare::vector3("toward", {}, {0.0, 0.0, -1.0},
                       "Direction from the transmitter straight to the plane, tracker frame; any length."),
      declare::number("distance_m", {0.05, 100.0, "m"}, 1.5, "From the transmitter to the plane.").plausibly(0.3, 5.0),
      materialParameter(),
      permeabilityParameter(),
      conductivityParameter(
          "Aluminium 3.5e7, copper 5.8e7, steel 6e6, stainless 1.4e6. When given, the tracker's carrier "
          "or sampling delay decides how the plane reflects; null is an ideal metal."),
      declare::number("thickness_m", {1e-6, 10.0, "m"}, nullptr,
                      "Of a sheet of that conductivity; null is a solid metal without end.")
          .plausibly(1e-5, 0.05),
      declare::number("strength", {0.0, 100.0}, 1.0,
                      "Share of such a plane's image; below 1 for mesh, reinforcement or panels with gaps. No real "
                      "plane has more than 1.")
          .plausibly(0.0, 1.0)};
  effect.make = make;
  effect.fits = fits;
  effect.body = planeOf;
  return effect;
}

}  // namespace fieldtrue::effects
