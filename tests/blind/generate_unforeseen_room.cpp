#include <algorithm>
#include <cmath>

#include "tests/blind/generate_unforeseen.h"
#include "tests/blind/plates.h"

namespace blind::unforeseen {
namespace {

/// Polarizability of unit size that is `normal` along one direction and `inside` across it.
Matrix3d flatTensor(const Vector3d& axis, double normal, double inside) {
  return inside * Matrix3d::Identity() + (normal - inside) * axis * axis.transpose();
}

/// Polarizability of unit size of a thing made of steel and closed frames, some axes either way.
Matrix3d framedTensor(Random& random) {
  const Matrix3d axes = rotation(random).toRotationMatrix();
  const Vector3d along(1.0, uniform(random, 0.3, 0.8), uniform(random, -0.7, 0.5));
  return axes * along.asDiagonal() * axes.transpose();
}

/// Cells of a steel pedestal each, standing in squares under the places.
Scatterer pedestals(const Scene& scene, const Vector3d& first, double depth_m, double pitch_m) {
  const Vector3d second = scene.up.cross(first);
  const Vector3d foot_m = scene.middle_m + (scene.lowest_m - depth_m - scene.middle_m.dot(scene.up)) * scene.up;
  Scatterer scatterer;
  for (int a = -3; a <= 3; ++a)
    for (int b = -3; b <= 3; ++b) {
      const Vector3d at_m = foot_m + pitch_m * ((a + 0.3) * first + (b - 0.2) * second);
      scatterer.at_m.push_back(at_m);
      scatterer.moment.push_back(flatTensor(scene.up, 1.0, 0.25) * dipoleField(at_m));
    }
  return scatterer;
}

void append(const Scatterer& part, Scatterer& whole) {
  whole.loops.insert(whole.loops.end(), part.loops.begin(), part.loops.end());
  whole.current.insert(whole.current.end(), part.current.begin(), part.current.end());
}

/// Squares of ceiling bars, only some of them with all four joints bare.
Scatterer ceilingLoops(const Scene& scene, Random& random, double height_m, double carrier_hz) {
  const Vector3d first = level(random, scene.up), second = scene.up.cross(first);
  const Vector3d over_m = scene.middle_m + (scene.highest_m + height_m - scene.middle_m.dot(scene.up)) * scene.up;
  const double inductance_h = roundLoopInductance(0.34, 0.012);
  Scatterer whole;
  for (int a = -2; a <= 2; ++a)
    for (int b = -2; b <= 2; ++b) {
      const bool closed = uniform(random, 0, 1) < 0.4 || (a == 0 && b == 0);
      const double joints_ohm = logUniform(random, 0.01, 0.08);
      const Polygon bars = rectangle(over_m + 0.6 * (a * first + b * second), 0.29 * first, 0.29 * second);
      if (closed) append(solveClosedLoop(bars, joints_ohm, inductance_h, carrier_hz), whole);
    }
  return whole;
}

/// One slat of a blind: pieces of aluminium in a line, there from the moment it comes down.
Scatterer slat(const Vector3d& center_m, const Vector3d& along, const Vector3d& normal, double from_s) {
  Scatterer scatterer;
  scatterer.from_s = from_s;
  for (int n = -2; n <= 2; ++n) {
    const Vector3d at_m = keptAway(center_m + 0.25 * n * along, 0.3);
    scatterer.at_m.push_back(at_m);
    scatterer.moment.push_back(flatTensor(normal, -1.0, -0.1) * dipoleField(at_m));
  }
  return scatterer;
}

bool keepsClear(const Scene& scene, const Vector3d& at_m, double clearance_m) {
  for (const SolvedPose& pose : scene.poses)
    if ((pose.position_m - at_m).norm() < clearance_m) return false;
  return true;
}

/// Somewhere near the transmitter where no place is.
Vector3d nearTransmitter(const Scene& scene, Random& random) {
  Vector3d at_m = -0.5 * scene.middle_m.normalized();
  for (int attempt = 0; attempt < 30; ++attempt) {
    const Vector3d tried_m = uniform(random, 0.3, 0.7) * direction(random);
    if (keepsClear(scene, tried_m, 0.3)) at_m = tried_m;
  }
  return at_m;
}

}  // namespace

/// People pass through a steel door and leave it at another angle each time.
Drawn drawDoor(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d toward = level(random, scene.up), along = scene.up.cross(toward);
  const Vector3d hinge_m = beside(scene, toward, uniform(random, 0.5, 0.8));
  const std::vector<double> passages_s = instants(random, scene, uniformInt(random, 2, 7));
  std::vector<double> angles_rad;
  for (std::size_t n = 0; n <= passages_s.size(); ++n)
    angles_rad.push_back(n % 2 == 0 ? uniform(random, 0, 0.5) : uniform(random, 0.9, 1.7));
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose& pose, Matrix3d& couplings) {
      const double angle_rad = angles_rad[static_cast<std::size_t>(passed(passages_s, middleTime_s(row)))];
      const Vector3d leaf = std::cos(angle_rad) * along + std::sin(angle_rad) * toward;
      const Vector3d normal = std::cos(angle_rad) * toward - std::sin(angle_rad) * along;
      const Matrix3d tensor = size * flatTensor(normal, -1.0, 0.6);
      addField(pose, echo(keptAway(hinge_m + 0.45 * leaf, 0.4), tensor, pose.position_m), couplings);
    });
  };
  return drawnOf({"near:steel_door_left_ajar", "a steel door stands at another angle after each passage",
                  "polarizability_m3", 1e-5, 10, json{{"passages_s", passages_s}, {"angles_rad", angles_rad}}, hinge_m},
                 apply);
}

/// Reaching far in, the operator's hip pushes two carts together and their frames close a loop.
Drawn drawTouchingCarts(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d toward = level(random, scene.up), along = scene.up.cross(toward);
  const Vector3d at_m = beside(scene, toward, uniform(random, 0.25, 0.5));
  const double contact_ohm = logUniform(random, 0.01, 0.2);
  const Polygon frame = rectangle(at_m, uniform(random, 0.5, 0.8) * along, uniform(random, 0.35, 0.5) * scene.up);
  const Scatterer loop = solveClosedLoop(frame, contact_ohm, roundLoopInductance(0.7, 0.012), setup.carrier_hz);
  std::vector<double> reaches_m;
  for (const SolvedPose& pose : scene.poses) reaches_m.push_back(pose.position_m.dot(toward));
  const double contact_m = quantile(reaches_m, uniform(random, 0.3, 0.7));
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose& pose, Matrix3d& couplings) {
      if (pose.position_m.dot(toward) > contact_m) addField(pose, size * loop.fieldAt(pose.position_m), couplings);
    });
  };
  const json parameters = {{"contact_ohm", contact_ohm}, {"contact_m", contact_m}, {"toward", listed(toward)}};
  return drawnOf({"hip_pushes_carts_into_contact", "two carts touch and close a loop while the operator reaches far",
                  "share_of_current", 1e-4, 100, parameters, at_m},
                 apply);
}

/// The excess of the transmitter's cable lies wound up; its unequal return current makes it a small fourth coil.
Drawn drawCoiledCable(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d at_m = nearTransmitter(scene, random);
  const Vector3d normal = direction(random);
  const Eigen::RowVector3d leak = direction(random).transpose();
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose& pose, Matrix3d& couplings) {
      addField(pose, size * dipoleField(keptAway(pose.position_m - at_m, 0.12)) * normal * leak, couplings);
    });
  };
  return drawnOf({"excess_transmitter_cable_coiled", "the wound-up excess of the transmitter cable radiates",
                  "moment_share", 1e-5, 3, json{{"normal", listed(normal)}, {"leak", listed(leak.transpose())}}, at_m},
                 apply);
}

/// A raised floor stands on steel pedestals in squares of 0.6 m.
Drawn drawPedestals(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d first = level(random, scene.up);
  const double depth_m = uniform(random, 0.3, 0.5), pitch_m = uniform(random, 0.5, 0.62);
  const Scatterer all = pedestals(scene, first, depth_m, pitch_m);
  const auto apply = [=](World& world, double size) { world.metal.emplace_back(size, all); };
  const json parameters = {{"depth_m", depth_m}, {"pitch_m", pitch_m}, {"first", listed(first)}};
  return drawnOf({"near:raised_floor_pedestals", "steel pedestals of a raised floor under the places",
                  "polarizability_each_m3", 1e-6, 0.3, parameters},
                 apply);
}

/// Bars of a hung ceiling form squares; paint and corrosion leave only some of them closed.
Drawn drawCeilingGrid(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const double height_m = uniform(random, 0.3, 0.6);
  const Scatterer all = ceilingLoops(scene, random, height_m, setup.carrier_hz);
  const auto apply = [=](World& world, double size) { world.metal.emplace_back(size, all); };
  return drawnOf({"near:ceiling_grid_with_open_joints", "some squares of a hung ceiling's bars are closed loops",
                  "share_of_current", 1e-4, 100, json{{"height_m", height_m}, {"closed", all.loops.size()}}},
                 apply);
}

/// As the sun comes round, somebody lowers an aluminium blind further and further.
Drawn drawBlind(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d toward = level(random, scene.up), along = scene.up.cross(toward);
  const Vector3d at_m = beside(scene, toward, uniform(random, 0.35, 0.6));
  const double first = uniform(random, 0.05, 0.3), last = uniform(random, 0.7, 0.95);
  const Vector3d normal = (toward + uniform(random, 0.2, 0.9) * scene.up).normalized();
  std::vector<Scatterer> slats;
  for (int n = 0; n < 10; ++n)
    slats.push_back(
        slat(at_m + (0.6 - 0.12 * n) * scene.up, along, normal, scene.duration_s * (first + (last - first) * n / 9)));
  const auto apply = [=](World& world, double size) {
    for (const Scatterer& one : slats) world.metal.emplace_back(size, one);
  };
  const json parameters = {{"first_s", first * scene.duration_s}, {"last_s", last * scene.duration_s}};
  return drawnOf({"near:blind_lowered_slat_by_slat", "an aluminium blind comes down during the session",
                  "polarizability_each_m3", 1e-7, 0.1, parameters, at_m},
                 apply);
}

/// For the high places the operator fetches a steel stool and puts it away again for the low ones.
Drawn drawStepStool(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d at_m =
      beside(scene, level(random, scene.up), uniform(random, 0.4, 0.6)) - uniform(random, 0.0, 0.4) * scene.up;
  std::vector<double> heights_m;
  for (const Row& row : setup.rows) heights_m.push_back(row.place_m.z());
  const double needed_m = quantile(heights_m, uniform(random, 0.35, 0.65));
  const Matrix3d tensor = framedTensor(random);
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose& pose, Matrix3d& couplings) {
      if (row.place_m.z() < needed_m) return;
      addField(pose, echo(keptAway(at_m, 0.35), size * tensor, pose.position_m), couplings);
    });
  };
  return drawnOf({"near:step_stool_for_high_places", "a steel stool stands there only while high places are measured",
                  "polarizability_m3", 1e-6, 1, json{{"needed_above_jig_z_m", needed_m}}, at_m},
                 apply);
}

/// Slow eddy currents in a thick plate, raised by one transmitter coil, still flow in the next coil's slot.
Drawn drawEddyTail(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d at_m = beside(scene, direction(random), uniform(random, 0.25, 0.6));
  const Vector3d normal = direction(random);
  const double again = uniform(random, 0.1, 0.5);
  Matrix3d next = Matrix3d::Zero();
  for (int slot = 0; slot < 3; ++slot) {
    next(slot, (slot + 1) % 3) = 1;
    next(slot, (slot + 2) % 3) = again;
  }
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose& pose, Matrix3d& couplings) {
      addField(pose, echo(at_m, size * flatTensor(normal, -1.0, -0.2), pose.position_m) * next, couplings);
    });
  };
  return drawnOf({"near:eddy_tail_in_next_slot", "eddy currents of one slot decay within the next ones",
                  "polarizability_m3", 1e-6, 3, json{{"normal", listed(normal)}, {"second_slot_share", again}}, at_m},
                 apply);
}

}  // namespace blind::unforeseen
