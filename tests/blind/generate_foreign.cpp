#include <algorithm>
#include <cmath>
#include <map>

#include "tests/blind/generate_effects.h"

namespace blind {
namespace {

using nlohmann::json;

Drawn foreign(const char* id, const char* kind, double smallest, double largest, std::vector<double> scales,
              std::function<void(World&, double, ShapeChange)> apply) {
  const auto describe = [](double size, json& effect) { effect["parameters"]["size"] = size; };
  return {id, kind, smallest, largest, std::move(apply), describe, std::move(scales)};
}

Drawn drawCapacitive(const Setup&, Random& random) {
  // Electric coupling between windings falls as 1 / r: against the magnetic r^-3 it grows as r^2.
  Matrix3d winding;
  for (int c = 0; c < 3; ++c) winding.col(c) = normalVector(random);
  const auto apply = [=](World& world, double size, ShapeChange change) {
    Matrix3d windings = winding;
    for (int c = 0; c < 3; ++c) windings.col(c) += vectorAt(change, 3 * static_cast<std::size_t>(c));
    world.signal.emplace_back([=](const Row&, const SolvedPose& sensor, Matrix3d& couplings) {
      couplings += size / sensor.position_m.norm() * windings;
    });
  };
  return foreign("off:capacitive", "electric coupling between windings", 1e-4, 0.3, std::vector(9, 0.3), apply);
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
  return foreign("off:hysteresis", "receiver core remembers the field before", 1e-4, 0.5, {},
                 [=](World& world, double size, ShapeChange) {
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
  return foreign("off:jig_bending", cantilever ? "arm bends under load" : "board sags between its ends", 5e-4, 0.15, {},
                 [=](World& world, double size, ShapeChange) {
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
  const auto apply = [=](World& world, double size, ShapeChange change) {
    const Vector3d waves = wave * entry + vectorAt(change, 0);
    const double at_middle = phase + changeAt(change, 3);
    world.signal.emplace_back([=](const Row& row, const SolvedPose&, Matrix3d& couplings) {
      couplings *= 1 + size * std::sin(waves.dot(row.place_m - middle_m) / 0.5 + at_middle);
    });
  };
  return foreign("off:cable_gain", "gain follows how the cable lies", 5e-4, 0.3, {0.5, 0.5, 0.5, 0.3}, apply);
}

Drawn drawSensorSwapped(const Setup& setup, Random& random) {
  const double change_s = uniform(random, 0.3, 0.7) * setup.duration_s();
  const Vector3d turn = direction(random), to = direction(random);
  const auto apply = [=](World& world, double size, ShapeChange change) {
    const Vector3d offset_m = 0.5 * size * (to + vectorAt(change, 0));
    const Vector3d rotation_rad = size * (turn + vectorAt(change, 3));
    world.mounting.emplace_back([=](const Row& row, SolvedPose& sensor) {
      if (row.start_s < change_s) return;
      sensor.position_m += sensor.orientation * offset_m;
      sensor.orientation = sensor.orientation * turned(rotation_rad, Quaterniond::Identity());
    });
  };
  return foreign("off:sensor_swapped", "another sensor from the middle of the session on", 3e-4, 0.2,
                 std::vector(6, 0.3), apply);
}

Drawn drawWrongUnits(const Setup& setup, Random& random) {
  const int layer = uniformInt(random, 0, setup.counts.z() - 1);
  const Vector3d corner_m =
      setup.middle_m - 0.5 * setup.pitch_m * (setup.counts - Eigen::Vector3i::Ones()).cast<double>();
  return foreign("off:wrong_units", "one layer drilled to another unit", 5e-4, 0.4, {},
                 [=](World& world, double size, ShapeChange) {
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
  return foreign("off:transposed_axes", "offsets of one layer entered transposed", 5e-4, 0.4, {0.3, 0.3},
                 [=](World& world, double size, ShapeChange change) {
                   const double linear = a + changeAt(change, 0), square = b + changeAt(change, 1);
                   world.rig.emplace_back([=](const Row& row, Vector3d& place_m, Quaterniond&) {
                     if (row.k != layer) return;
                     const double x = row.place_m.x() - middle_m.x(), y = row.place_m.y() - middle_m.y();
                     place_m.x() += size * (linear * (y - x) + square * (y * y - x * x) / 0.5);
                     place_m.y() += size * (linear * (x - y) + square * (x * x - y * y) / 0.5);
                   });
                 });
}

Drawn drawWarmCoil(const Setup& setup, Random& random) {
  const int coil = uniformInt(random, 0, 2);
  const auto course = wanderingCourse(setup, random);
  const auto apply = [=](World& world, double size, ShapeChange change) {
    const std::vector<double> kept(change.begin(), change.end());
    world.signal.emplace_back([=](const Row& row, const SolvedPose&, Matrix3d& couplings) {
      couplings.row(coil) *= 1 + size * course(row.start_s, kept);
    });
  };
  return foreign("off:warm_receiver_coil", "one receiver coil follows temperature", 5e-4, 0.5,
                 std::vector(kMomentsOfCourse, 0.3), apply);
}

}  // namespace

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

}  // namespace blind
