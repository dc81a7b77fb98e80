#include <algorithm>
#include <cmath>

#include "tests/blind/generate_unforeseen.h"

namespace blind::unforeseen {
namespace {

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

/// For how long between two moments the block is not lower than a height, the rows in order: it stays at each place
/// until the next row begins.
double timeAbove_s(const std::vector<Row>& rows, double z_m, double from_s, double until_s) {
  double sum_s = 0;
  const std::size_t begun = begunBefore(rows, until_s);
  for (std::size_t n = 0; n < begun; ++n) {
    if (rows[n].place_m.z() < z_m) continue;
    const double leaves_s = n + 1 < begun ? rows[n + 1].start_s : until_s;
    sum_s += std::max(0.0, leaves_s - std::max(rows[n].start_s, from_s));
  }
  return sum_s;
}

/// A vector turned by half a turn about an axis.
Vector3d halfTurned(const Vector3d& v, const Vector3d& axis) { return 2 * v.dot(axis) * axis - v; }

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
  return drawnOf(
      {"near:warm_glue_creeps_whichever_way_is_down", "the sensor creeps on its warm glue, down as it is held",
       "creep_m", 1e-6, 0.3, json{{"lamp_s", lamp_s}, {"turn_rad_per_m", turn_per_m}}},
      apply);
}

/// One sheet of cork lies under all places and for a while keeps the dents of those measured before, whatever their
/// height: the block sinks toward them.
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
        Vector3d toward = (rows[n].place_m - row.place_m) / wide_m;
        toward.z() = 0;
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

/// The carriage is moved by counted turns of a handwheel; a turn is lost or gained now and then as it moves, until it
/// is back at its stop.
Drawn drawLostTurns(const Setup& setup, Random& random) {
  const Span span = spanOf(setup);
  const std::vector<Row> rows = inOrder(setup);
  const int axis = span.longSide();
  const double at_stop_m = span.low_m(axis) + 0.3 * setup.pitch_m;
  const double miscounted = uniform(random, 0.15, 0.35), more_often_lost = uniform(random, 0.4, 0.8);
  std::vector<int> turns;
  do {  // Until one at least is miscounted.
    turns = {0};
    double last_m = span.low_m(axis);
    for (const Row& row : rows) {
      const int error = uniform(random, 0, 1) < more_often_lost ? -1 : 1;
      const bool wrong = uniform(random, 0, 1) < miscounted;
      const bool moved = std::abs(row.place_m(axis) - last_m) > 0.1 * setup.pitch_m;
      const int now = turns.back() + (moved && wrong ? error : 0);
      turns.push_back(row.place_m(axis) < at_stop_m ? 0 : now);
      last_m = row.place_m(axis);
    }
  } while (std::all_of(turns.begin(), turns.end(), [](int lost) { return lost == 0; }));
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

/// Resin has welled out of some of the holes and spread: there, and less beside them, the block has one edge lifted.
Drawn drawResin(const Setup& setup, Random& random) {
  struct Bead {
    Vector3d hole_m, tilt;
    double high = 1;
  };
  const double turn_per_m = uniform(random, 5, 15);
  const int last = static_cast<int>(setup.rows.size()) - 1;
  std::vector<Bead> beads;
  for (int n = std::max(6, last / uniformInt(random, 7, 12)); n > 0; --n) {
    const Vector3d hole_m = setup.rows[static_cast<std::size_t>(uniformInt(random, 0, last))].place_m;
    const double high = logUniform(random, 0.25, 1.0);
    beads.push_back({hole_m, turn_per_m * high * level(random, Vector3d::UnitZ()), high});
  }
  const auto apply = [=, wide_m = 0.4 * setup.pitch_m](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond& attitude) {
      Vector3d tilt = Vector3d::Zero();
      double lifted = 0;
      for (const Bead& bead : beads) {
        const double under = std::exp(-0.5 * ((bead.hole_m - row.place_m) / wide_m).squaredNorm());
        lifted += under * bead.high;
        tilt += under * bead.tilt;
      }
      place_m.z() += size * lifted;
      attitude = turned(size * tilt, attitude);
    });
  };
  return drawnOf({"near:resin_wells_out_of_some_holes", "resin out of some of the holes lifts one edge of the block",
                  "bead_m", 1e-6, 0.3, json{{"holes", beads.size()}, {"turn_rad_per_m", turn_per_m}}},
                 apply);
}

/// Heights were taken with a level whose sight slopes, each from the nearer of its two stands: the farther, the higher.
Drawn drawSlopingSight(const Setup& setup, Random& random) {
  const Span span = spanOf(setup);
  const double radius_m = 0.5 * span.length_m().head<2>().norm();
  const Vector3d side = level(random, Vector3d::UnitZ());
  const Vector3d other = (uniform(random, -1, 1) * Vector3d::UnitZ().cross(side) - side).normalized();
  const Vector3d first_m = span.middle_m() + (radius_m * uniform(random, 0.6, 1.2) + 0.2) * side;
  const Vector3d second_m = span.middle_m() + (radius_m * uniform(random, 0.6, 1.2) + 0.2) * other;
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

/// Where the posts end, the block is held by hand; there the arm tires, until there is a rest, and droops the more the
/// higher.
Drawn drawTiredArm(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const std::vector<Row> rows = inOrder(setup);
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
      const double rest_s = rests_s[static_cast<std::size_t>(rested - 1)];
      const double held_s = timeAbove_s(rows, posts_m, rest_s, row.start_s);
      const double tired = size * std::pow(4 * held_s / duration_s, power) * (above_m + raised_m);
      place_m += tired * sinks;
      attitude = turned(tired * nods, attitude);
    });
  };
  const json parameters = {{"posts_jig_z_m", posts_m}, {"rests_s", rests_s}, {"power", power}};
  return drawnOf(
      {"near:tired_arm_droops_at_high_places", "the arm that holds the block at high places tires between rests",
       "droop_per_height", 1e-6, 1, parameters},
      apply);
}

/// The castors of the table are not locked, so each push of the block into its hole rolls and turns it a little.
Drawn drawCastors(const Setup& setup, Random& random) {
  const Vector3d middle_m = spanOf(setup).middle_m();
  const std::vector<Row> rows = inOrder(setup);
  const std::vector<double> put_back_s = instants(random, sceneOf(setup), uniformInt(random, 0, 3));
  const Vector3d facing = level(random, Vector3d::UnitZ());
  const double turn_per_m2 = uniform(random, 0.3, 2.0);
  struct Rolled {
    Vector3d shift = Vector3d::Zero();
    double turn = 0;
  };
  const auto pushed = [=](const Rolled& last, double last_s, double now_s, const Vector3d& place_m) {
    const bool put_back = passed(put_back_s, now_s) > passed(put_back_s, last_s);
    const Rolled before = put_back ? Rolled{} : last;
    const Vector3d from_middle_m = place_m - middle_m;
    const Vector3d push = from_middle_m.dot(facing) < 0 ? facing : Vector3d(-0.7 * facing);
    return Rolled{before.shift + push, before.turn + turn_per_m2 * from_middle_m.cross(push).z()};
  };
  std::vector<Rolled> rolled = {Rolled{}};
  for (std::size_t n = 0; n < rows.size(); ++n) {
    const double last_s = rows[n == 0 ? 0 : n - 1].start_s;
    rolled.push_back(pushed(rolled.back(), last_s, rows[n].start_s, rows[n].place_m));
  }
  const auto apply = [=](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond& attitude) {
      const std::size_t begun = begunBefore(rows, row.start_s - 1e-6);
      const double last_s = rows[begun == 0 ? 0 : begun - 1].start_s;
      const Rolled now = pushed(rolled[begun], last_s, row.start_s, row.place_m);
      turnAbout(middle_m, size * now.turn * Vector3d::UnitZ(), place_m, attitude);
      place_m += size * now.shift;
    });
  };
  const json parameters = {{"put_back_s", put_back_s}, {"facing", listed(facing)}, {"turn_rad_per_m2", turn_per_m2}};
  return drawnOf({"near:unlocked_castors_roll_at_each_push", "each push of the block rolls the table a little",
                  "roll_m", 1e-7, 0.1, parameters},
                 apply);
}

/// Where its cable would not reach, the block stands the other way round and the sensor is set straight again in it.
/// The seat is not quite in the middle of the block and leans: what of that is level changes its sign.
Drawn drawTurnedBlock(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d toward = direction(random);
  const Vector3d box_m = beside(scene, toward, uniform(random, 0.1, 0.5));
  std::vector<double> ways_m;
  for (const SolvedPose& pose : scene.poses) ways_m.push_back((pose.position_m - box_m).norm());
  const double reach_m = quantile(ways_m, uniform(random, 0.35, 0.7));
  const Vector3d offset = direction(random);
  const double lean_per_m = uniform(random, 0.5, 4.0);
  const Vector3d lean = lean_per_m * direction(random);
  const auto apply = [=, up = scene.up](World& world, double size) {
    world.mounting.push_back([=](const Row&, SolvedPose& pose) {
      const bool other_way = (pose.position_m - box_m).norm() > reach_m;
      const auto seated = [&](const Vector3d& v) { return other_way ? halfTurned(v, up) : v; };
      const Vector3d shift_m = 0.5 * size * seated(pose.orientation * offset);
      const Vector3d turn_rad = 0.5 * size * seated(pose.orientation * lean);
      pose.position_m += shift_m;
      pose.orientation = turned(turn_rad, pose.orientation);
    });
  };
  const json parameters = {{"reach_m", reach_m}, {"offset", listed(offset)}, {"lean_rad_per_m", listed(lean)}};
  return drawnOf({"near:block_turned_round_where_cable_is_short",
                  "far from the box the block is turned round and the sensor in it back", "off_middle_m", 1e-6, 0.3,
                  parameters, box_m},
                 apply);
}

}  // namespace blind::unforeseen
