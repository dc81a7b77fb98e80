#include <algorithm>
#include <cmath>
#include <map>

#include "tests/blind/generate_effects.h"

namespace blind {
namespace {

using nlohmann::json;

double sign(Random& random) { return uniform(random, 0, 1) < 0.5 ? -1.0 : 1.0; }

/// What the amplitude of an instrument effect is called and how it follows from the size.
Drawn sized(std::string id, std::string kind, double smallest, double largest,
            std::function<void(World&, double)> apply, std::string name, double factor,
            json parameters = json::object()) {
  Drawn drawn{std::move(id), std::move(kind), smallest, largest, std::move(apply), nullptr};
  drawn.describe = [name = std::move(name), factor, parameters = std::move(parameters)](double size, json& effect) {
    effect["amplitude"] = {{"name", name}, {"value", size * factor}};
    effect["parameters"].update(parameters);
    effect["parameters"]["size"] = size;
  };
  return drawn;
}

/// Warming up along an exponential with a random walk on top, of unit size at its largest.
std::function<double(double)> wandering(const Setup& setup, Random& random) {
  const double end_s = setup.duration_s(), constant_s = uniform(random, 0.2, 0.7) * end_s;
  const double share = uniform(random, 0, 0.5);
  std::vector<double> walk{0.0};
  for (int step = 0; step < 200; ++step) walk.push_back(walk.back() + normal(random) / std::sqrt(200.0));
  return [=](double time_s) {
    const double at = std::min(199.999, 200 * time_s / end_s);
    const auto k = static_cast<std::size_t>(at);
    const double step = walk[k] + (at - static_cast<double>(k)) * (walk[k + 1] - walk[k]);
    return (1 - share) * (1 - std::exp(-time_s / constant_s)) + share * step;
  };
}

Drawn drawCoilGain(const Setup&, Random& random) {
  const bool transmitter = uniform(random, 0, 1) < 0.5;
  Vector3d pattern = normalVector(random);
  if (uniform(random, 0, 1) < 0.6) pattern = sign(random) * Vector3d::Unit(uniformInt(random, 0, 2));
  pattern /= pattern.cwiseAbs().maxCoeff();
  const auto apply = [=](World& world, double size) {
    (transmitter ? world.transmitter : world.receiver) *=
        Matrix3d((size * pattern).asDiagonal()) + Matrix3d::Identity();
  };
  const std::string side = transmitter ? "transmitter" : "receiver";
  Eigen::Index axis = 0;
  pattern.cwiseAbs().maxCoeff(&axis);
  return sized("coil_gain", side + " coils", 2e-4, 0.1, apply, side + "_gain_" + "xyz" [axis], pattern[axis], {
    { "pattern", listed(pattern) }
  });
}

Drawn drawNonorthogonality(const Setup&, Random& random) {
  const bool transmitter = uniform(random, 0, 1) < 0.5;
  const Vector3d lean = direction(random);
  const auto apply = [=](World& world, double size) {
    Matrix3d change = Matrix3d::Identity();
    // One coil of a pair leans: the symmetric part is the fault, the rest is a turn that alignment absorbs.
    change(0, 1) = size * lean.x(), change(0, 2) = size * lean.y(), change(1, 2) = size * lean.z();
    (transmitter ? world.transmitter : world.receiver) *= change;
  };
  constexpr const char* kPairs[] = {"_xy_rad", "_xz_rad", "_yz_rad"};
  Eigen::Index pair = 0;
  lean.cwiseAbs().maxCoeff(&pair);
  const std::string side = transmitter ? "transmitter" : "receiver";
  return sized("coil_nonorthogonality", side + " coils", 3e-4, 0.1, apply, side + kPairs[pair], 0.5 * lean[pair],
               {{"lean", listed(lean)}});
}

Drawn drawFiniteCoil(const Setup&, Random& random) {
  const bool transmitter = uniform(random, 0, 1) < 0.6;
  const auto apply = [=](World& world, double size) {
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
      "global_gain", "all couplings", 3e-4, 0.3, [=](World& world, double size) { world.receiver *= 1 + s * size; },
      "gain", s);
}

Drawn drawGridScale(const Setup& setup, Random& random) {
  Vector3d pattern = sign(random) * Vector3d::Ones();
  const bool isotropic = uniform(random, 0, 1) < 0.25;
  if (!isotropic) pattern = direction(random);
  if (!isotropic && uniform(random, 0, 1) < 0.6) pattern = sign(random) * Vector3d::Unit(uniformInt(random, 0, 2));
  const Vector3d middle_m = setup.middle_m;
  const auto apply = [=](World& world, double size) {
    world.rig.emplace_back([=](const Row& row, Vector3d& place_m, Quaterniond&) {
      place_m += size * pattern.cwiseProduct(row.place_m - middle_m);
    });
  };
  Eigen::Index axis = 0;
  pattern.cwiseAbs().maxCoeff(&axis);
  return sized("grid_scale", isotropic ? "all axes alike" : "by axis", 2e-4, 0.1, apply,
               std::string("scale_") + "xyz" [axis], pattern[axis], {
                 {"pattern", listed(pattern)}, { "isotropic", isotropic }
               });
}

Drawn drawLayerOffset(const Setup& setup, Random& random) {
  std::vector<double> offset(static_cast<std::size_t>(setup.counts.z()), 0.0);
  const int wrong = uniformInt(random, 0, setup.counts.z() - 1);
  offset[static_cast<std::size_t>(wrong)] = sign(random);
  if (uniform(random, 0, 1) < 0.3)
    for (double& value : offset) value += 0.5 * normal(random);
  const auto apply = [=](World& world, double size) {
    world.rig.emplace_back([=](const Row& row, Vector3d& place_m, Quaterniond&) {
      place_m.z() += size * offset[static_cast<std::size_t>(row.k)];
    });
  };
  Drawn drawn = sized("jig_layer_offset", "layer at the wrong height", 3e-4, 0.03, apply, "", 1,
                      {{"layer", wrong}, {"pattern", offset}});
  const double factor = offset[static_cast<std::size_t>(wrong)];
  drawn.describe = [=](double size, json& effect) {
    effect["amplitude"] = nullptr;
    effect["parameters"].update({{"layer", wrong}, {"pattern", offset}, {"offset_m", size * factor}});
  };
  return drawn;
}

Drawn drawJigTilt(const Setup& setup, Random& random) {
  const double turn = uniform(random, 0, 2 * kPi);
  const Vector3d lean(std::cos(turn), std::sin(turn), 0);
  const bool turns_sensor = uniform(random, 0, 1) < 0.5;
  const double middle_m = setup.middle_m.z();
  const auto apply = [=](World& world, double size) {
    world.rig.emplace_back([=](const Row& row, Vector3d& place_m, Quaterniond& attitude) {
      place_m += std::sin(size) * (row.place_m.z() - middle_m) * lean;
      if (turns_sensor) attitude = turned(size * Vector3d::UnitZ().cross(lean), attitude);
    });
  };
  const char* name = std::abs(lean.x()) > std::abs(lean.y()) ? "shear_xz_rad" : "shear_yz_rad";
  return sized("jig_tilt", turns_sensor ? "posts lean with the sensor" : "posts lean", 4e-4, 0.1, apply, name,
               std::abs(lean.x()) > std::abs(lean.y()) ? lean.x() : lean.y(), {{"lean", listed(lean)}});
}

Drawn drawGainDrift(const Setup& setup, Random& random) {
  const auto course = wandering(setup, random);
  const double s = sign(random);
  const auto apply = [=](World& world, double size) {
    world.signal.emplace_back([=](const Row& row, const SolvedPose&, Matrix3d& couplings) {
      couplings *= 1 + s * size * course(row.start_s);
    });
  };
  Drawn drawn = sized("gain_drift", "warming up, with a random walk", 3e-4, 0.1, apply, "", 1);
  drawn.describe = [s](double size, json& effect) {
    effect["amplitude"] = nullptr;
    effect["parameters"]["gain_at_end"] = s * size;
  };
  return drawn;
}

Drawn drawSensorOffset(const Setup&, Random& random) {
  const Vector3d to = direction(random);
  const auto apply = [=](World& world, double size) {
    world.mounting.emplace_back(
        [=](const Row&, SolvedPose& sensor) { sensor.position_m += sensor.orientation * (size * to); });
  };
  Drawn drawn = sized("sensor_offset", "sensor not where it should sit", 5e-4, 0.1, apply, "", 1);
  drawn.describe = [to](double size, json& effect) {
    Eigen::Index axis = 0;
    to.cwiseAbs().maxCoeff(&axis);
    effect["amplitude"] = {{"name", std::string("offset_") + "xyz"[axis] + "_m"}, {"value", size * to[axis]}};
    effect["parameters"]["offset_m"] = listed(size * to);
  };
  return drawn;
}

Drawn drawMisalignment(const Setup&, Random& random) {
  const Vector3d shift = direction(random), turn = direction(random);
  const auto apply = [=](World& world, double size) {
    world.mounting.emplace_back([=](const Row&, SolvedPose& sensor) {
      const Vector3d rotation_rad = size * turn;
      sensor.position_m = turned(rotation_rad, Quaterniond::Identity()) * sensor.position_m + 0.5 * size * shift;
      sensor.orientation = turned(rotation_rad, sensor.orientation);
    });
  };
  Drawn drawn = sized("transmitter_misalignment", "transmitter shifted and turned", 5e-4, 0.2, apply, "", 1);
  drawn.describe = [=](double size, json& effect) {
    effect["amplitude"] = nullptr;
    effect["parameters"].update({{"shift_m", listed(0.5 * size * shift)}, {"turn_rad", listed(size * turn)}});
  };
  return drawn;
}

Drawn foreign(const char* id, const char* kind, double smallest, double largest,
              std::function<void(World&, double)> apply) {
  Drawn drawn{id, kind, smallest, largest, std::move(apply), nullptr};
  drawn.describe = [](double size, json& effect) { effect["parameters"]["size"] = size; };
  return drawn;
}

Drawn drawCapacitive(const Setup&, Random& random) {
  // Electric coupling between windings falls as 1 / r: against the magnetic r^-3 it grows as r^2.
  Matrix3d winding;
  for (int c = 0; c < 3; ++c) winding.col(c) = normalVector(random);
  return foreign("off:capacitive", "electric coupling between windings", 1e-4, 0.3, [=](World& world, double size) {
    world.signal.emplace_back([=](const Row&, const SolvedPose& sensor, Matrix3d& couplings) {
      couplings += size / sensor.position_m.norm() * winding;
    });
  });
}

Drawn drawHysteresis(const Setup& setup, Random& random) {
  // The core keeps a part of the field of the row before: what it reads depends on where it came from.
  std::map<double, Matrix3d> kept_at;
  Matrix3d memory = Matrix3d::Zero();
  const double kept = uniform(random, 0.2, 0.7);
  for (const Row& row : setup.rows) {
    kept_at[row.start_s] = memory;
    const SolvedPose at = setup.expected(row);
    memory = kept * memory + (1 - kept) * (at.orientation.toRotationMatrix().transpose() * dipoleField(at.position_m));
  }
  return foreign("off:hysteresis", "receiver core remembers the field before", 1e-4, 0.5,
                 [=](World& world, double size) {
                   world.signal.emplace_back([=](const Row& row, const SolvedPose&, Matrix3d& couplings) {
                     const auto after = kept_at.upper_bound(row.start_s);
                     if (after != kept_at.begin()) couplings += size * std::prev(after)->second;
                   });
                 });
}

Drawn drawBending(const Setup& setup, Random& random) {
  const Vector3d middle_m = setup.middle_m;
  const double length_m = 0.5 * setup.pitch_m * (setup.counts.x() - 1);
  const bool cantilever = uniform(random, 0, 1) < 0.5;
  return foreign("off:jig_bending", cantilever ? "arm bends under load" : "board sags between its ends", 5e-4, 0.15,
                 [=](World& world, double size) {
                   world.rig.emplace_back([=](const Row& row, Vector3d& place_m, Quaterniond& attitude) {
                     const double x = (row.place_m.x() - middle_m.x()) / length_m;
                     const double a = 0.5 * (1 + x);
                     const double sag = cantilever ? 0.5 * a * a * (3 - a) : 1 - x * x;
                     const double slope = (cantilever ? 0.5 * (3 * a - 1.5 * a * a) : -2 * x) / length_m;
                     place_m.z() -= size * sag;
                     attitude = turned(Vector3d(0, size * slope, 0), attitude);
                   });
                 });
}

Drawn drawCableGain(const Setup& setup, Random& random) {
  const Vector3d middle_m = setup.middle_m, entry = direction(random);
  const double wave = uniform(random, 2.0, 6.0), phase = uniform(random, 0, 2 * kPi);
  return foreign("off:cable_gain", "gain follows how the cable lies", 5e-4, 0.3, [=](World& world, double size) {
    world.signal.emplace_back([=](const Row& row, const SolvedPose&, Matrix3d& couplings) {
      couplings *= 1 + size * std::sin(wave * entry.dot(row.place_m - middle_m) / 0.5 + phase);
    });
  });
}

Drawn drawSensorSwapped(const Setup& setup, Random& random) {
  const double change_s = uniform(random, 0.3, 0.7) * setup.duration_s();
  const Vector3d turn = direction(random), to = direction(random);
  return foreign("off:sensor_swapped", "another sensor from the middle of the session on", 3e-4, 0.2,
                 [=](World& world, double size) {
                   world.mounting.emplace_back([=](const Row& row, SolvedPose& sensor) {
                     if (row.start_s < change_s) return;
                     sensor.position_m += sensor.orientation * (0.5 * size * to);
                     sensor.orientation = sensor.orientation * turned(size * turn, Quaterniond::Identity());
                   });
                 });
}

Drawn drawWrongUnits(const Setup& setup, Random& random) {
  const int layer = uniformInt(random, 0, setup.counts.z() - 1);
  const Vector3d corner_m =
      setup.middle_m - 0.5 * setup.pitch_m * (setup.counts - Eigen::Vector3i::Ones()).cast<double>();
  return foreign("off:wrong_units", "one layer drilled to another unit", 5e-4, 0.4, [=](World& world, double size) {
    world.rig.emplace_back([=](const Row& row, Vector3d& place_m, Quaterniond&) {
      if (row.k == layer) place_m.head<2>() += size * (row.place_m - corner_m).head<2>();
    });
  });
}

Drawn drawTransposed(const Setup& setup, Random& random) {
  // The table of measured hole offsets of one layer was entered with rows and columns exchanged.
  const int layer = uniformInt(random, 0, setup.counts.z() - 1);
  const Vector3d middle_m = setup.middle_m;
  const double a = uniform(random, 0.5, 1.5), b = uniform(random, -1, 1);
  return foreign("off:transposed_axes", "offsets of one layer entered transposed", 5e-4, 0.4,
                 [=](World& world, double size) {
                   world.rig.emplace_back([=](const Row& row, Vector3d& place_m, Quaterniond&) {
                     if (row.k != layer) return;
                     const double x = row.place_m.x() - middle_m.x(), y = row.place_m.y() - middle_m.y();
                     place_m.x() += size * (a * (y - x) + b * (y * y - x * x) / 0.5);
                     place_m.y() += size * (a * (x - y) + b * (x * x - y * y) / 0.5);
                   });
                 });
}

Drawn drawWarmCoil(const Setup& setup, Random& random) {
  const int coil = uniformInt(random, 0, 2);
  const auto course = wandering(setup, random);
  return foreign("off:warm_receiver_coil", "one receiver coil follows temperature", 5e-4, 0.5,
                 [=](World& world, double size) {
                   world.signal.emplace_back([=](const Row& row, const SolvedPose&, Matrix3d& couplings) {
                     couplings.row(coil) *= 1 + size * course(row.start_s);
                   });
                 });
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

const std::vector<Kind>& foreignKinds() {
  static const std::vector<Kind> kinds = {{"off:capacitive", 1, drawCapacitive},
                                          {"off:opposed_bodies", 1, drawOpposedBodies},
                                          {"off:ferrite_at_transmitter", 1, drawFerriteAtTransmitter},
                                          {"off:hysteresis", 1, drawHysteresis},
                                          {"off:jig_bending", 1, drawBending, Kind::Needs::kRigAxes},
                                          {"off:cable_gain", 1, drawCableGain},
                                          {"off:sensor_swapped", 1, drawSensorSwapped},
                                          {"off:wrong_units", 1, drawWrongUnits, Kind::Needs::kLayers},
                                          {"off:transposed_axes", 1, drawTransposed, Kind::Needs::kLayers},
                                          {"off:warm_receiver_coil", 1, drawWarmCoil}};
  return kinds;
}

const std::vector<std::string>& signalIds() {
  static const std::vector<std::string> ids = {"mains_interference", "range_noise", "correlated_samples",
                                               "quantization", "hemisphere_flip"};
  return ids;
}

}  // namespace blind
