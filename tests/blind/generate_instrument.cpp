#include <algorithm>
#include <cmath>

#include "tests/blind/generate_effects.h"

namespace blind {
namespace {

using nlohmann::json;

double sign(Random& random) { return uniform(random, 0, 1) < 0.5 ? -1.0 : 1.0; }

/// What the amplitude of an instrument effect is called and how it follows from the size.
Drawn sized(std::string id, std::string kind, double smallest, double largest,
            std::function<void(World&, double, ShapeChange)> apply, std::string name, double factor,
            json parameters = json::object()) {
  Drawn drawn{std::move(id), std::move(kind), smallest, largest, std::move(apply), nullptr};
  drawn.describe = [name = std::move(name), factor, parameters = std::move(parameters)](double size, json& effect) {
    effect["amplitude"] = {{"name", name}, {"value", size * factor}};
    effect["parameters"].update(parameters);
    effect["parameters"]["size"] = size;
  };
  return drawn;
}

Drawn drawCoilGain(const Setup&, Random& random) {
  const bool transmitter = uniform(random, 0, 1) < 0.5;
  Vector3d pattern = normalVector(random);
  if (uniform(random, 0, 1) < 0.6) pattern = sign(random) * Vector3d::Unit(uniformInt(random, 0, 2));
  pattern /= pattern.cwiseAbs().maxCoeff();
  const auto apply = [=](World& world, double size, ShapeChange change) {
    const Vector3d gains = size * (pattern + vectorAt(change, 0));
    (transmitter ? world.transmitter : world.receiver) *= Matrix3d(gains.asDiagonal()) + Matrix3d::Identity();
  };
  const std::string side = transmitter ? "transmitter" : "receiver";
  Eigen::Index axis = 0;
  pattern.cwiseAbs().maxCoeff(&axis);
  Drawn drawn = sized("coil_gain", side + " coils", 2e-4, 0.1, apply, side + "_gain_" + std::string(1, "xyz"[axis]),
                      pattern[axis], {{"pattern", listed(pattern)}});
  drawn.scales = {0.3, 0.3, 0.3};
  return drawn;
}

Drawn drawNonorthogonality(const Setup&, Random& random) {
  const bool transmitter = uniform(random, 0, 1) < 0.5;
  const Vector3d lean = direction(random);
  const auto apply = [=](World& world, double size, ShapeChange change) {
    const Vector3d leans = size * (lean + vectorAt(change, 0));
    Matrix3d coils = Matrix3d::Identity();
    // One coil of a pair leans: the symmetric part is the fault, the rest is a turn that alignment absorbs.
    coils(0, 1) = leans.x(), coils(0, 2) = leans.y(), coils(1, 2) = leans.z();
    (transmitter ? world.transmitter : world.receiver) *= coils;
  };
  constexpr const char* kPairs[] = {"_xy_rad", "_xz_rad", "_yz_rad"};
  Eigen::Index pair = 0;
  lean.cwiseAbs().maxCoeff(&pair);
  const std::string side = transmitter ? "transmitter" : "receiver";
  Drawn drawn = sized("coil_nonorthogonality", side + " coils", 3e-4, 0.1, apply, side + kPairs[pair], 0.5 * lean[pair],
                      {{"lean", listed(lean)}});
  drawn.scales = {0.3, 0.3, 0.3};
  return drawn;
}

Drawn drawFiniteCoil(const Setup&, Random& random) {
  const bool transmitter = uniform(random, 0, 1) < 0.6;
  const auto apply = [=](World& world, double size, ShapeChange) {
    (transmitter ? world.transmitter_half_m : world.receiver_half_m) = size;
  };
  Drawn drawn = sized("finite_coil", transmitter ? "square transmitter coils" : "square receiver coils", 0.01, 0.15,
                      apply, "", 1);
  drawn.describe = [](double size, json& effect) {
    // On the axis a square of half side h falls below the dipole by 2 h^2 / z^2, a ring of radius a by 3/2 a^2 / z^2.
    effect["amplitude"] = {{"name", "radius_squared_m2"}, {"value", 4.0 / 3.0 * size * size}};
    effect["parameters"]["half_side_m"] = size;
  };
  return drawn;
}

Drawn drawGlobalGain(const Setup&, Random& random) {
  const double s = sign(random);
  return sized(
      "global_gain", "all couplings", 3e-4, 0.3,
      [=](World& world, double size, ShapeChange) { world.receiver *= 1 + s * size; }, "gain", s);
}

Drawn drawGridScale(const Setup& setup, Random& random) {
  Vector3d pattern = sign(random) * Vector3d::Ones();
  const bool isotropic = uniform(random, 0, 1) < 0.25;
  if (!isotropic) pattern = direction(random);
  if (!isotropic && uniform(random, 0, 1) < 0.6) pattern = sign(random) * Vector3d::Unit(uniformInt(random, 0, 2));
  const Vector3d middle_m = setup.middle_m;
  const auto apply = [=](World& world, double size, ShapeChange change) {
    const Vector3d scale = pattern + vectorAt(change, 0);
    world.rig.emplace_back([=](const Row& row, Vector3d& place_m, Quaterniond&) {
      place_m += size * scale.cwiseProduct(row.place_m - middle_m);
    });
  };
  Eigen::Index axis = 0;
  pattern.cwiseAbs().maxCoeff(&axis);
  Drawn drawn = sized("grid_scale", isotropic ? "all axes alike" : "by axis", 2e-4, 0.1, apply,
                      "scale_" + std::string(1, "xyz"[axis]), pattern[axis],
                      {{"pattern", listed(pattern)}, {"isotropic", isotropic}});
  drawn.scales = {0.3, 0.3, 0.3};
  return drawn;
}

Drawn drawLayerOffset(const Setup& setup, Random& random) {
  std::vector<double> offset(static_cast<std::size_t>(setup.counts.z()), 0.0);
  const int wrong = uniformInt(random, 0, setup.counts.z() - 1);
  offset[static_cast<std::size_t>(wrong)] = sign(random);
  if (uniform(random, 0, 1) < 0.3)
    for (double& value : offset) value += 0.5 * normal(random);
  const auto apply = [=](World& world, double size, ShapeChange change) {
    std::vector<double> offset_m;
    for (std::size_t k = 0; k < offset.size(); ++k) offset_m.push_back(size * (offset[k] + changeAt(change, k)));
    world.rig.emplace_back([=](const Row& row, Vector3d& place_m, Quaterniond&) {
      place_m.z() += offset_m[static_cast<std::size_t>(row.k)];
    });
  };
  Drawn drawn = sized("jig_layer_offset", "layer at the wrong height", 3e-4, 0.03, apply, "", 1,
                      {{"layer", wrong}, {"pattern", offset}});
  const double factor = offset[static_cast<std::size_t>(wrong)];
  drawn.describe = [=](double size, json& effect) {
    effect["amplitude"] = nullptr;
    effect["parameters"].update({{"layer", wrong}, {"pattern", offset}, {"offset_m", size * factor}});
  };
  drawn.scales.assign(offset.size(), 0.3);
  return drawn;
}

Drawn drawJigTilt(const Setup& setup, Random& random) {
  const double turn = uniform(random, 0, 2 * kPi);
  const Vector3d lean(std::cos(turn), std::sin(turn), 0);
  const bool turns_sensor = uniform(random, 0, 1) < 0.5;
  const double middle_m = setup.middle_m.z();
  const auto apply = [=](World& world, double size, ShapeChange change) {
    const Vector3d leaning = lean + Vector3d(changeAt(change, 0), changeAt(change, 1), 0);
    world.rig.emplace_back([=](const Row& row, Vector3d& place_m, Quaterniond& attitude) {
      place_m += std::sin(size) * (row.place_m.z() - middle_m) * leaning;
      if (turns_sensor) attitude = turned(size * Vector3d::UnitZ().cross(leaning), attitude);
    });
  };
  const char* name = std::abs(lean.x()) > std::abs(lean.y()) ? "shear_xz_rad" : "shear_yz_rad";
  Drawn drawn = sized("jig_tilt", turns_sensor ? "posts lean with the sensor" : "posts lean", 4e-4, 0.1, apply, name,
                      std::abs(lean.x()) > std::abs(lean.y()) ? lean.x() : lean.y(), {{"lean", listed(lean)}});
  drawn.scales = {0.3, 0.3};
  return drawn;
}

Drawn drawGainDrift(const Setup& setup, Random& random) {
  const auto course = wanderingCourse(setup, random);
  const double s = sign(random);
  const auto apply = [=](World& world, double size, ShapeChange change) {
    const std::vector<double> kept(change.begin(), change.end());
    world.signal.emplace_back([=](const Row& row, const SolvedPose&, Matrix3d& couplings) {
      couplings *= 1 + s * size * course(row.start_s, kept);
    });
  };
  Drawn drawn = sized("gain_drift", "warming up, with a random walk", 3e-4, 0.1, apply, "", 1);
  drawn.describe = [s](double size, json& effect) {
    effect["amplitude"] = nullptr;
    effect["parameters"]["gain_at_end"] = s * size;
  };
  drawn.scales.assign(kMomentsOfCourse, 0.3);
  return drawn;
}

Drawn drawSensorOffset(const Setup&, Random& random) {
  const Vector3d to = direction(random);
  const auto apply = [=](World& world, double size, ShapeChange change) {
    const Vector3d offset_m = size * (to + vectorAt(change, 0));
    world.mounting.emplace_back(
        [=](const Row&, SolvedPose& sensor) { sensor.position_m += sensor.orientation * offset_m; });
  };
  Drawn drawn = sized("sensor_offset", "sensor not where it should sit", 5e-4, 0.1, apply, "", 1);
  drawn.describe = [to](double size, json& effect) {
    Eigen::Index axis = 0;
    to.cwiseAbs().maxCoeff(&axis);
    effect["amplitude"] = {{"name", std::string("offset_") + "xyz"[axis] + "_m"}, {"value", size * to[axis]}};
    effect["parameters"]["offset_m"] = listed(size * to);
  };
  drawn.scales = {0.3, 0.3, 0.3};
  return drawn;
}

Drawn drawMisalignment(const Setup&, Random& random) {
  const Vector3d shift = direction(random), turn = direction(random);
  const auto apply = [=](World& world, double size, ShapeChange change) {
    const Vector3d shift_m = 0.5 * size * (shift + vectorAt(change, 0));
    const Vector3d rotation_rad = size * (turn + vectorAt(change, 3));
    world.mounting.emplace_back([=](const Row&, SolvedPose& sensor) {
      sensor.position_m = turned(rotation_rad, Quaterniond::Identity()) * sensor.position_m + shift_m;
      sensor.orientation = turned(rotation_rad, sensor.orientation);
    });
  };
  Drawn drawn = sized("transmitter_misalignment", "transmitter shifted and turned", 5e-4, 0.2, apply, "", 1);
  drawn.describe = [=](double size, json& effect) {
    effect["amplitude"] = nullptr;
    effect["parameters"].update({{"shift_m", listed(0.5 * size * shift)}, {"turn_rad", listed(size * turn)}});
  };
  drawn.scales.assign(6, 0.3);
  return drawn;
}

}  // namespace

const std::vector<Kind>& catalogueKinds() {
  static const std::vector<Kind> kinds = {{"compact_metal", 1.6, drawCompactMetal},
                                          {"metal_plane", 1.2, drawMetalPlane},
                                          {"finite_plate", 1, drawFinitePlate},
                                          {"closed_loop", 1, drawClosedLoop},
                                          {"coil_gain", 1, drawCoilGain},
                                          {"coil_nonorthogonality", 1, drawNonorthogonality},
                                          {"finite_coil", 0.8, drawFiniteCoil},
                                          {"global_gain", 0.8, drawGlobalGain},
                                          {"grid_scale", 1, drawGridScale, Kind::Needs::kRigAxes},
                                          {"jig_layer_offset", 1, drawLayerOffset, Kind::Needs::kLayers},
                                          {"jig_tilt", 1, drawJigTilt, Kind::Needs::kRigAxes},
                                          {"gain_drift", 1, drawGainDrift},
                                          {"metal_moved", 1, drawMetalMoved}};
  return kinds;
}

const std::vector<Kind>& alignedKinds() {
  static const std::vector<Kind> kinds = {{"sensor_offset", 1, drawSensorOffset},
                                          {"transmitter_misalignment", 1, drawMisalignment}};
  return kinds;
}

const std::vector<std::string>& signalIds() {
  static const std::vector<std::string> ids = {"mains_interference", "range_noise", "correlated_samples",
                                               "quantization", "hemisphere_flip"};
  return ids;
}

}  // namespace blind
