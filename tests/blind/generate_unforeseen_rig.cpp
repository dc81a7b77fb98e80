#include <algorithm>
#include <array>
#include <cmath>

#include "tests/blind/generate_unforeseen.h"

namespace blind::unforeseen {
namespace {

struct Box {
  Vector3d low_m = Vector3d::Constant(1e9);
  Vector3d high_m = Vector3d::Constant(-1e9);

  Vector3d middle_m() const { return 0.5 * (low_m + high_m); }
  /// One of the first axes along which the places reach far.
  int anyLong(Random& random, int axes) const {
    const Vector3d length_m = high_m - low_m;
    int axis = uniformInt(random, 0, axes - 1);
    while (length_m(axis) < 0.6 * length_m.head(axes).maxCoeff()) axis = (axis + 1) % axes;
    return axis;
  }
};

/// Box of the places in the jig frame.
Box boxOf(const Setup& setup) {
  Box box;
  for (const Row& row : setup.rows) {
    box.low_m = box.low_m.cwiseMin(row.place_m);
    box.high_m = box.high_m.cwiseMax(row.place_m);
  }
  return box;
}

/// The grid lines across one axis, as far as the places tell.
struct Lines {
  int axis = 0;
  double first_m = 0, spacing_m = 1;

  int nearest(const Vector3d& place_m) const {
    return static_cast<int>(std::lround((place_m(axis) - first_m) / spacing_m));
  }
};

Lines linesOf(const Setup& setup, int axis) {
  Lines lines{axis, boxOf(setup).low_m(axis), 1e9};
  for (const Row& row : setup.rows) {
    const double from_first_m = row.place_m(axis) - lines.first_m;
    if (from_first_m > 0.002) lines.spacing_m = std::min(lines.spacing_m, from_first_m);
  }
  return lines;
}

double sinceLast_s(const std::vector<double>& instants_s, double time_s) {
  const int count = passed(instants_s, time_s);
  return count == 0 ? time_s : time_s - instants_s[static_cast<std::size_t>(count - 1)];
}

/// Share of a slow change done after a time.
double settled(double time_s, double constant_s) { return 1 - std::exp(-std::max(0.0, time_s) / constant_s); }

}  // namespace

/// The board folds for transport; its hinge does not open quite flat, so one wing rises.
Drawn drawFoldedBoard(const Setup& setup, Random& random) {
  const Box box = boxOf(setup);
  const int axis = box.anyLong(random, 2);
  const double share = uniform(random, 0.3, 0.6);
  const double hinge_m = box.low_m(axis) + share * (box.high_m(axis) - box.low_m(axis));
  const double height_m = box.low_m.z() - uniform(random, 0.0, 0.1);
  const double sign = uniform(random, 0, 1) < 0.5 ? -1 : 1;
  const Vector3d hinge_axis = sign * Vector3d::UnitZ().cross(Vector3d::Unit(axis));
  Vector3d pivot_m = Vector3d::Zero();
  pivot_m(axis) = hinge_m;
  pivot_m.z() = height_m;
  const auto apply = [=](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond& attitude) {
      if (row.place_m(axis) > hinge_m) turnAbout(pivot_m, size * hinge_axis, place_m, attitude);
    });
  };
  return drawnOf({"hinged_board_not_flat", "one wing of a folding board stands up", "angle_rad", 1e-5, 1,
                  json{{"axis", axis}, {"hinge_jig_m", hinge_m}}},
                 apply);
}

/// Distances were rolled off with a measuring wheel whose axle is out of centre: an error with each turn.
Drawn drawEccentricWheel(const Setup& setup, Random& random) {
  const int axis = boxOf(setup).anyLong(random, 3);
  const double turns = uniformInt(random, 0, 1) + uniform(random, 0.15, 0.42);
  const double round_m = setup.pitch_m / turns;
  const double phase_rad = uniform(random, 0, 2 * kPi);
  const auto apply = [=](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond&) {
      place_m(axis) += size * std::sin(2 * kPi * row.place_m(axis) / round_m + phase_rad);
    });
  };
  return drawnOf({"eccentric_measuring_wheel", "an eccentric measuring wheel errs once a turn", "eccentricity_m", 1e-6,
                  0.3, json{{"axis", axis}, {"round_m", round_m}, {"phase_rad", phase_rad}}},
                 apply);
}

/// The arm that carries the board creeps in its clamp and is raised again at each retightening.
Drawn drawCreepingArm(const Setup& setup, Random& random) {
  const Box box = boxOf(setup);
  const Scene scene = sceneOf(setup);
  const std::vector<double> retightened_s = instants(random, scene, uniformInt(random, 1, 4));
  const double constant_s = scene.duration_s * logUniform(random, 0.01, 0.1);
  const Vector3d reach = level(random, Vector3d::UnitZ());
  const Vector3d pivot_m = box.middle_m() - uniform(random, 0.5, 1.0) * reach;
  const auto apply = [=, droop = Vector3d(Vector3d::UnitZ().cross(reach))](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond& attitude) {
      const double crept = std::log1p(sinceLast_s(retightened_s, middleTime_s(row)) / constant_s) / std::log(20.0);
      turnAbout(pivot_m, size * crept * droop, place_m, attitude);
    });
  };
  return drawnOf({"arm_creeps_between_retightenings", "a clamped arm creeps down until it is tightened again",
                  "angle_rad", 1e-5, 1, json{{"retightened_s", retightened_s}, {"pivot_jig_m", listed(pivot_m)}}},
                 apply);
}

/// Beyond the slack of its cable the sensor is pulled toward where the cable is tied down.
Drawn drawTautCable(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d tied_m = beside(scene, direction(random), uniform(random, 0.1, 0.6));
  std::vector<double> lengths_m;
  for (const SolvedPose& pose : scene.poses) lengths_m.push_back((pose.position_m - tied_m).norm());
  const double slack_m = quantile(lengths_m, uniform(random, 0.2, 0.6));
  const double per_m = uniform(random, 1, 5);
  const Vector3d boot = direction(random);
  const auto apply = [=](World& world, double size) {
    world.mounting.push_back([=](const Row&, SolvedPose& pose) {
      const Vector3d pull_m = tied_m - pose.position_m;
      const double stretched = std::max(0.0, pull_m.norm() - slack_m);
      const Vector3d toward = pull_m.normalized();
      const Vector3d torque = (pose.orientation * boot).cross(toward);
      pose.position_m += size * stretched * toward;
      pose.orientation = turned(size * stretched * per_m * torque, pose.orientation);
    });
  };
  return drawnOf({"taut_cable_pulls_sensor", "the cable gets taut far out and pulls the sensor in its seat",
                  "yield_m_per_m", 1e-5, 3, json{{"slack_m", slack_m}, {"turn_rad_per_m", per_m}}, tied_m},
                 apply);
}

/// The screw of the sensor's arm backs out by the handling: the arm sinks ever more, which way depends on attitude.
Drawn drawLooseHolder(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d arm_m = uniform(random, 0.1, 0.2) * direction(random);
  const double power = uniform(random, 1.0, 3.0);
  const double thread_m = uniform(random, 0.02, 0.06);
  const auto apply = [=, up = scene.up, duration_s = scene.duration_s](World& world, double size) {
    world.mounting.push_back([=](const Row& row, SolvedPose& pose) {
      const double loose_rad = size * std::pow(std::max(0.0, middleTime_s(row)) / duration_s, power);
      const Vector3d arm = pose.orientation * arm_m;
      const Vector3d pivot_m = pose.position_m - arm;
      turnAbout(pivot_m, loose_rad * up.cross(arm.normalized()), pose.position_m, pose.orientation);
      pose.position_m -= loose_rad * thread_m * up;
    });
  };
  return drawnOf({"near:holder_screw_backs_out", "the sensor's arm sinks ever more as its screw backs out", "angle_rad",
                  1e-4, 2, json{{"arm_m", listed(arm_m)}, {"power", power}, {"thread_m", thread_m}}},
                 apply);
}

/// The jig stands on a floating floor that gives way where the operator stands; the transmitter hangs elsewhere.
Drawn drawFloatingFloor(const Setup& setup, Random& random) {
  const Box box = boxOf(setup);
  const Vector3d foot_m = box.middle_m() - Vector3d(0, 0, uniform(random, 0.6, 1.2));
  const double softer = uniform(random, 0.3, 1.0);
  const auto apply = [=](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond& attitude) {
      const Vector3d stands_m = row.place_m - foot_m;
      const Vector3d tilt_rad = size * Vector3d(-softer * stands_m.y(), stands_m.x(), 0);
      turnAbout(foot_m, tilt_rad, place_m, attitude);
    });
  };
  return drawnOf({"floating_floor_tilts_under_operator", "the floor tilts the jig toward where the operator stands",
                  "tilt_rad_per_m", 1e-5, 1, json{{"foot_jig_m", listed(foot_m)}, {"softer", softer}}},
                 apply);
}

/// The pointer hovers over the scale: each of two people reads it from where their own eyes are.
Drawn drawParallax(const Setup& setup, Random& random) {
  const Box box = boxOf(setup);
  const Scene scene = sceneOf(setup);
  const std::vector<double> change_s = instants(random, scene, 1);
  const Vector3d first_m = box.middle_m() + uniform(random, 0.4, 0.9) * level(random, Vector3d::UnitZ());
  const Vector3d second_m = box.middle_m() + uniform(random, 0.4, 0.9) * level(random, Vector3d::UnitZ());
  const double second_share = uniform(random, 0.5, 1.5);
  const auto apply = [=](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond&) {
      const bool later = passed(change_s, middleTime_s(row)) > 0;
      Vector3d sight_m = row.place_m - (later ? second_m : first_m);
      sight_m.z() = 0;
      place_m += size * (later ? second_share : 1.0) * sight_m;
    });
  };
  const json parameters = {
      {"change_s", change_s}, {"first_eye_jig_m", listed(first_m)}, {"second_eye_jig_m", listed(second_m)}};
  return drawnOf({"shift_change_reads_with_parallax", "two people read a hovering pointer with their own parallax",
                  "gap_per_sight", 1e-6, 1, parameters},
                 apply);
}

/// The transmitter hangs from a long rod; whenever the ventilation blows, it leans away.
Drawn drawSwayingTransmitter(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d ceiling_m = uniform(random, 0.5, 1.5) * scene.up;
  const Vector3d axis = level(random, scene.up);
  const double period_s = scene.duration_s * uniform(random, 0.15, 0.5);
  const double blowing = uniform(random, 0.3, 0.6), phase = uniform(random, 0, 1);
  const auto apply = [=](World& world, double size) {
    world.mounting.push_back([=](const Row& row, SolvedPose& pose) {
      const double cycles = middleTime_s(row) / period_s + phase;
      if (cycles - std::floor(cycles) > blowing) return;
      turnAbout(ceiling_m, size * axis, pose.position_m, pose.orientation);
    });
  };
  const json parameters = {{"axis", listed(axis)}, {"period_s", period_s}, {"blowing", blowing}, {"phase", phase}};
  return drawnOf({"near:fan_sways_hanging_transmitter", "the hanging transmitter leans while the ventilation blows",
                  "angle_rad", 1e-5, 1, parameters, ceiling_m},
                 apply);
}

/// The carriage is pushed out along one row and back along the next: its backlash shifts every other row.
Drawn drawBacklash(const Setup& setup, Random& random) {
  const int moved = uniformInt(random, 0, 1);
  const int stepped = setup.counts(1 - moved) > 1 ? 1 - moved : 2;
  const Lines lines = linesOf(setup, stepped);
  const double yaw_per_m = uniform(random, 0.0, 1.5);
  const auto apply = [=](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond& attitude) {
      const double way = lines.nearest(row.place_m) % 2 == 0 ? 0.5 : -0.5;
      place_m(moved) += way * size;
      attitude = turned(Vector3d(0, 0, way * size * yaw_per_m), attitude);
    });
  };
  return drawnOf({"backlash_in_alternate_rows", "backlash shifts every other row", "backlash_m", 1e-6, 0.5,
                  json{{"moved_axis", moved}, {"stepped_axis", stepped}, {"yaw_rad_per_m", yaw_per_m}}},
                 apply);
}

/// The list of holes goes layer by layer; from its second page on it was typed from an older drawing with another
/// corner and pitch.
Drawn drawSecondPage(const Setup& setup, Random& random) {
  Vector3d order(1e-4, 1e-2, 1);
  if (uniform(random, 0, 1) < 0.5) order = order.reverse().eval();
  std::vector<double> listed_at;
  for (const Row& row : setup.rows) listed_at.push_back(order.dot(row.place_m));
  const double page = quantile(listed_at, uniform(random, 0.3, 0.7));
  const Vector3d corner_m = boxOf(setup).low_m;
  const Vector3d shift = direction(random);
  const Vector3d stretch = 2 * normalVector(random);
  const auto apply = [=](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond&) {
      if (order.dot(row.place_m) > page) place_m += size * (shift + stretch.cwiseProduct(row.place_m - corner_m));
    });
  };
  return drawnOf(
      {"near:second_page_from_older_drawing", "later holes of the list follow an older drawing", "change_m", 1e-6, 0.5,
       json{{"order", listed(order)},
            {"page_ends_at", page},
            {"shift", listed(shift)},
            {"stretch_per_m", listed(stretch)}}},
      apply);
}

/// A post of green wood with spiral grain twists as it dries: the higher, the more it turns.
Drawn drawTwistingPost(const Setup& setup, Random& random) {
  const Box box = boxOf(setup);
  const double foot_m = box.low_m.z() - uniform(random, 0.1, 0.5);
  const double constant_s = sceneOf(setup).duration_s * uniform(random, 0.3, 2.0);
  const Vector3d post_m = box.middle_m() + uniform(random, 0.2, 0.8) * level(random, Vector3d::UnitZ());
  const double dried_before = uniform(random, 0.0, 0.5);
  const auto apply = [=](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond& attitude) {
      const double twist = (row.place_m.z() - foot_m) * (dried_before + settled(middleTime_s(row), constant_s));
      turnAbout(post_m, Vector3d(0, 0, size * twist), place_m, attitude);
    });
  };
  const json parameters = {{"post_jig_m", listed(post_m)}, {"foot_jig_z_m", foot_m}, {"constant_s", constant_s}};
  return drawnOf(
      {"post_twists_as_it_dries", "a drying post twists, the more the higher", "twist_rad_per_m", 1e-5, 2, parameters},
      apply);
}

}  // namespace blind::unforeseen
