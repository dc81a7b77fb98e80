#include <algorithm>
#include <cmath>

#include "tests/blind/generate_unforeseen.h"

namespace blind::unforeseen {
namespace {

/// What the places take up in the jig frame.
struct Extents {
  Vector3d low_m = Vector3d::Constant(1e9);
  Vector3d high_m = Vector3d::Constant(-1e9);

  Vector3d middle_m() const { return 0.5 * (low_m + high_m); }
  Vector3d length_m() const { return high_m - low_m; }
  int longSide() const { return length_m().x() > length_m().y() ? 0 : 1; }
};

Extents extentsOf(const Setup& setup) {
  Extents extents;
  for (const Row& row : setup.rows) {
    extents.low_m = extents.low_m.cwiseMin(row.place_m);
    extents.high_m = extents.high_m.cwiseMax(row.place_m);
  }
  return extents;
}

std::vector<Row> inOrder(const Setup& setup) {
  std::vector<Row> rows = setup.rows;
  std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.start_s < b.start_s; });
  return rows;
}

/// Number of recordings that began earlier than a moment, the rows in order.
std::size_t begunBefore(const std::vector<Row>& rows, double time_s) {
  const auto next =
      std::lower_bound(rows.begin(), rows.end(), time_s, [](const Row& row, double s) { return row.start_s < s; });
  return static_cast<std::size_t>(next - rows.begin());
}

/// How a beam on supports at 0 and 1 gives way under a load on it or beyond them, per span.
struct Bend {
  double sunk = 0, slope = 0;
};
Bend bendUnder(double load) {
  if (load < 0.5) {
    const Bend mirrored = bendUnder(1 - load);
    return {mirrored.sunk, -mirrored.slope};
  }
  const double beyond = load - 1;
  if (beyond > 0) return {beyond * beyond * (1 + beyond) / 3, beyond / 3 + beyond * beyond / 2};
  return {load * load * beyond * beyond / 3, load * beyond * (2 * load - 1) / 3};
}

}  // namespace

/// A lamp warms the glue under the sensor, which from then on creeps whichever way is down as it is turned about.
Drawn drawWarmGlue(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Course course = courseOf(setup);
  const double lamp_s = scene.duration_s * uniform(random, 0.0, 0.4);
  const Vector3d seat = direction(random);
  const double turn_per_m = uniform(random, 2, 10);
  const auto crept = [=, up = scene.up, duration_s = scene.duration_s](std::size_t n, double until_s) {
    const double soft_s = std::max(0.0, until_s - std::max(lamp_s, course.start_s[n]));
    return Vector3d(-soft_s / duration_s * (course.poses[n].orientation.conjugate() * up));
  };
  std::vector<Vector3d> at_start = {Vector3d::Zero()};
  for (std::size_t n = 1; n < course.poses.size(); ++n)
    at_start.push_back(at_start.back() + crept(n - 1, course.start_s[n]));
  const auto apply = [=](World& world, double size) {
    world.mounting.push_back([=](const Row& row, SolvedPose& pose) {
      const std::size_t last = course.before(row);
      const Vector3d creep = size * (at_start[last] + crept(last, row.start_s));
      pose.position_m += pose.orientation * creep;
      pose.orientation = turned(turn_per_m * (pose.orientation * seat.cross(creep)), pose.orientation);
    });
  };
  return drawnOf({"warm_glue_creeps_whichever_way_is_down", "the sensor creeps on its warm glue, down as it is held",
                  "creep_m", 1e-6, 0.3, json{{"lamp_s", lamp_s}, {"turn_rad_per_m", turn_per_m}}},
                 apply);
}

/// The block stands on cork, which for a while keeps the dents of the places measured before: it sinks toward them.
Drawn drawDentedCork(const Setup& setup, Random& random) {
  const std::vector<Row> rows = inOrder(setup);
  const double wide_m = setup.pitch_m * uniform(random, 0.8, 1.3);
  const double recovers_s = sceneOf(setup).duration_s * uniform(random, 0.03, 0.12);
  const double turn_per_m = uniform(random, 0.5, 2.0);
  const auto apply = [=](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond& attitude) {
      Vector3d tilt = Vector3d::Zero();
      double sunk = 0;
      const std::size_t before = begunBefore(rows, row.start_s - 1e-6);
      for (std::size_t n = begunBefore(rows, row.start_s - 3 * recovers_s); n < before; ++n) {
        const Vector3d toward = (rows[n].place_m - row.place_m) / wide_m;
        const double age = (row.start_s - rows[n].start_s) / recovers_s;
        const double dent = std::exp(-age - 0.5 * toward.squaredNorm());
        sunk += dent;
        tilt += dent * Vector3d::UnitZ().cross(toward);
      }
      place_m.z() -= size * sunk;
      attitude = turned(size * turn_per_m * tilt, attitude);
    });
  };
  return drawnOf({"cork_keeps_the_dents_of_the_last_places", "the block sinks into dents of places measured before",
                  "dent_m", 1e-6, 0.3, json{{"wide_m", wide_m}, {"recovers_s", recovers_s}}},
                 apply);
}

/// The carriage is moved by counted turns of a handwheel; a turn is lost or gained now and then, until it is back at
/// its stop.
Drawn drawLostTurns(const Setup& setup, Random& random) {
  const Extents extents = extentsOf(setup);
  const std::vector<Row> rows = inOrder(setup);
  const int axis = extents.longSide();
  const double at_stop_m = extents.low_m(axis) + 0.3 * setup.pitch_m;
  const double miscounted = uniform(random, 0.15, 0.35), more_often_lost = uniform(random, 0.4, 0.8);
  std::vector<int> turns = {0};
  for (const Row& row : rows) {
    const int error = uniform(random, 0, 1) < more_often_lost ? -1 : 1;
    const int now = turns.back() + (uniform(random, 0, 1) < miscounted ? error : 0);
    turns.push_back(row.place_m(axis) < at_stop_m ? 0 : now);
  }
  const auto apply = [=](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond&) {
      if (row.place_m(axis) >= at_stop_m) place_m(axis) += size * turns[begunBefore(rows, row.start_s + 1e-6)];
    });
  };
  return drawnOf(
      {"handwheel_turns_lost_until_the_stop", "turns of a handwheel are miscounted until the stop is reached", "lead_m",
       1e-6, 0.3, json{{"axis", axis}, {"stop_jig_m", at_stop_m}, {"miscounted_share", miscounted}}},
      apply);
}

/// Resin wells out of some of the holes and lifts one edge of the block.
Drawn drawResin(const Setup& setup, Random& random) {
  struct Bead {
    Vector3d hole_m, tilt;
    double high = 1;
  };
  const double turn_per_m = uniform(random, 5, 15);
  const int last = static_cast<int>(setup.rows.size()) - 1;
  std::vector<Bead> beads;
  for (int n = std::max(4, last / uniformInt(random, 6, 14)); n > 0; --n) {
    const Vector3d hole_m = setup.rows[static_cast<std::size_t>(uniformInt(random, 0, last))].place_m;
    const double high = logUniform(random, 0.25, 1.0);
    beads.push_back({hole_m, turn_per_m * high * level(random, Vector3d::UnitZ()), high});
  }
  const auto apply = [=, near_m = 0.2 * setup.pitch_m](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond& attitude) {
      const auto under = [&](const Bead& bead) { return (bead.hole_m - row.place_m).norm() < near_m; };
      const auto bead = std::find_if(beads.begin(), beads.end(), under);
      if (bead == beads.end()) return;
      place_m.z() += size * bead->high;
      attitude = turned(size * bead->tilt, attitude);
    });
  };
  return drawnOf({"resin_wells_out_of_some_holes", "resin in some of the holes lifts one edge of the block", "bead_m",
                  1e-6, 0.3, json{{"holes", beads.size()}, {"turn_rad_per_m", turn_per_m}}},
                 apply);
}

/// Heights were taken with a level whose sight slopes, each from the nearer of its two stands: the farther, the higher.
Drawn drawSlopingSight(const Setup& setup, Random& random) {
  const Extents extents = extentsOf(setup);
  const double radius_m = 0.5 * extents.length_m().head<2>().norm();
  const Vector3d side = level(random, Vector3d::UnitZ());
  const Vector3d other = (uniform(random, -1, 1) * Vector3d::UnitZ().cross(side) - side).normalized();
  const Vector3d first_m = extents.middle_m() + (radius_m * uniform(random, 0.6, 1.2) + 0.2) * side;
  const Vector3d second_m = extents.middle_m() + (radius_m * uniform(random, 0.6, 1.2) + 0.2) * other;
  const double first_mark_m = uniform(random, 0, 2) * radius_m, second_mark_m = uniform(random, 0, 2) * radius_m;
  const auto apply = [=](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond&) {
      const double to_first_m = (row.place_m - first_m).head<2>().norm();
      const double to_second_m = (row.place_m - second_m).head<2>().norm();
      const bool nearer = to_first_m < to_second_m;
      place_m.z() += size * (nearer ? to_first_m - first_mark_m : to_second_m - second_mark_m);
    });
  };
  const json parameters = {{"stands_jig_m", {listed(first_m), listed(second_m)}},
                           {"to_mark_m", {first_mark_m, second_mark_m}}};
  return drawnOf({"heights_levelled_with_a_sloping_sight", "heights err with the distance from where the level stood",
                  "slope_rad", 1e-5, 1, parameters},
                 apply);
}

/// The places are on a plank across two trestles, which bends under the heavy block wherever that stands.
Drawn drawBendingPlank(const Setup& setup, Random& random) {
  const Extents extents = extentsOf(setup);
  const int axis = extents.longSide();
  const double long_m = extents.length_m()(axis);
  const double from_m = extents.low_m(axis) + uniform(random, -0.2, 0.3) * long_m;
  const double span_m = extents.high_m(axis) + uniform(random, -0.3, 0.2) * long_m - from_m;
  const double plank_m = extents.low_m.z() - uniform(random, 0.05, 0.25);
  const auto apply = [=](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond& attitude) {
      const Bend bend = bendUnder((row.place_m(axis) - from_m) / span_m);
      const Vector3d foot_m(row.place_m.x(), row.place_m.y(), plank_m);
      const Vector3d forward = Vector3d::UnitZ().cross(Vector3d::Unit(axis));
      turnAbout(foot_m, size * bend.slope / span_m * forward, place_m, attitude);
      place_m.z() -= size * bend.sunk;
    });
  };
  const json parameters = {{"axis", axis}, {"trestles_jig_m", {from_m, from_m + span_m}}, {"plank_jig_z_m", plank_m}};
  return drawnOf({"plank_bends_under_the_block", "a plank across two trestles bends under the block", "compliance_m",
                  1e-5, 10, parameters},
                 apply);
}

/// Where the posts end, the block is held by hand; the arm tires, the more the higher, until there is a rest.
Drawn drawTiredArm(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  std::vector<double> heights_m;
  for (const Row& row : setup.rows) heights_m.push_back(row.place_m.z());
  const double posts_m = quantile(heights_m, uniform(random, 0.35, 0.65)) - 1e-6;
  std::vector<double> rests_s = instants(random, scene, uniformInt(random, 1, 4));
  rests_s.insert(rests_s.begin(), 0.0);
  const double power = uniform(random, 0.8, 2.0), raised_m = uniform(random, 0.1, 0.5);
  const Vector3d back = level(random, Vector3d::UnitZ());
  const Vector3d sinks = uniform(random, 0.3, 0.9) * back - Vector3d::UnitZ();
  const Vector3d nods = uniform(random, 1, 4) * back.cross(Vector3d::UnitZ());
  const auto apply = [=, duration_s = scene.duration_s](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond& attitude) {
      const double above_m = row.place_m.z() - posts_m;
      if (above_m < 0) return;
      const int rested = std::max(1, passed(rests_s, row.start_s));
      const double since_s = std::max(0.0, row.start_s - rests_s[static_cast<std::size_t>(rested - 1)]);
      const double tired = size * std::pow(4 * since_s / duration_s, power) * (above_m + raised_m);
      place_m += tired * sinks;
      attitude = turned(tired * nods, attitude);
    });
  };
  const json parameters = {{"posts_jig_z_m", posts_m}, {"rests_s", rests_s}, {"power", power}};
  return drawnOf({"tired_arm_droops_at_high_places", "the arm that holds the block at high places tires between rests",
                  "droop_per_height", 1e-6, 1, parameters},
                 apply);
}

/// The castors of the table are not locked, so each push of the block into its hole rolls and turns it a little.
Drawn drawCastors(const Setup& setup, Random& random) {
  const Vector3d middle_m = extentsOf(setup).middle_m();
  const std::vector<Row> rows = inOrder(setup);
  const std::vector<double> put_back_s = instants(random, sceneOf(setup), uniformInt(random, 0, 3));
  const Vector3d facing = level(random, Vector3d::UnitZ());
  const double turn_per_m2 = uniform(random, 0.3, 2.0);
  struct Rolled {
    Vector3d shift = Vector3d::Zero();
    double turn = 0;
  };
  const auto pushed = [=](const Rolled& before, const Vector3d& place_m) {
    const Vector3d from_middle_m = place_m - middle_m;
    const Vector3d push = from_middle_m.dot(facing) < 0 ? facing : Vector3d(-0.7 * facing);
    return Rolled{before.shift + push, before.turn + turn_per_m2 * from_middle_m.cross(push).z()};
  };
  std::vector<Rolled> rolled = {Rolled{}};
  for (std::size_t n = 0; n < rows.size(); ++n) {
    const double before_s = rows[n == 0 ? 0 : n - 1].start_s;
    const bool put_back = passed(put_back_s, rows[n].start_s) > passed(put_back_s, before_s);
    rolled.push_back(pushed(put_back ? Rolled{} : rolled.back(), rows[n].place_m));
  }
  const auto apply = [=](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond& attitude) {
      const Rolled& now = rolled[begunBefore(rows, row.start_s + 1e-6)];
      turnAbout(middle_m, size * now.turn * Vector3d::UnitZ(), place_m, attitude);
      place_m += size * now.shift;
    });
  };
  const json parameters = {{"put_back_s", put_back_s}, {"facing", listed(facing)}, {"turn_rad_per_m2", turn_per_m2}};
  return drawnOf({"unlocked_castors_roll_at_each_push", "each push of the block rolls the table a little", "roll_m",
                  1e-7, 0.1, parameters},
                 apply);
}

/// Where its cable would not reach, the block stands the other way round, with the sensor not quite in its middle.
Drawn drawTurnedBlock(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d box_m = beside(scene, direction(random), uniform(random, 0.1, 0.5));
  std::vector<double> ways_m;
  for (const SolvedPose& pose : scene.poses) ways_m.push_back((pose.position_m - box_m).norm());
  const double reach_m = quantile(ways_m, uniform(random, 0.35, 0.7));
  const Vector3d offset = direction(random);
  const Vector3d lean = uniform(random, 0.5, 4.0) * direction(random);
  const auto apply = [=](World& world, double size) {
    world.mounting.push_back([=](const Row&, SolvedPose& pose) {
      const double way = (pose.position_m - box_m).norm() > reach_m ? -0.5 : 0.5;
      pose.position_m += way * size * (pose.orientation * offset);
      pose.orientation = turned(way * size * (pose.orientation * lean), pose.orientation);
    });
  };
  const json parameters = {{"reach_m", reach_m}, {"offset", listed(offset)}, {"lean_rad_per_m", listed(lean)}};
  return drawnOf({"block_turned_round_where_cable_is_short", "far from the box the block stands the other way round",
                  "off_middle_m", 1e-6, 0.3, parameters, box_m},
                 apply);
}

}  // namespace blind::unforeseen
