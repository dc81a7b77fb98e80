#include <algorithm>
#include <cmath>

#include "tests/blind/generate_unforeseen.h"

namespace blind::unforeseen {
namespace {

/// Polarizability of unit size of a thing that is round about an axis.
Matrix3d roundTensor(const Vector3d& axis, double along, double across) {
  return across * Matrix3d::Identity() + (along - across) * axis * axis.transpose();
}

/// Field of a thin frame in which the flux of the transmitter drives a current that keeps it out.
Matrix3d frameField(const Polygon& frame, double inductance_h, const Vector3d& p_m) {
  const Eigen::RowVector3d current = -dipoleFlux(frame) * (kHenryPerUnit / inductance_h);
  return loopField(frame, p_m) * current;
}

/// Field of a magnetic pole of unit strength.
Vector3d poleField(const Vector3d& from_pole_m) {
  const Vector3d r_m = keptAway(from_pole_m, 0.12);
  return r_m / std::pow(r_m.norm(), 3);
}

/// Something on a tether, dragged along when its end gets farther than the slack.
Vector3d dragged(const Vector3d& thing_m, const Vector3d& end_m, double slack_m) {
  const Vector3d gap_m = end_m - thing_m;
  const double length_m = gap_m.norm();
  return length_m > slack_m ? Vector3d(thing_m + gap_m * (1 - slack_m / length_m)) : thing_m;
}

std::vector<double> alongAll_m(const Scene& scene, const Vector3d& toward) {
  std::vector<double> list_m;
  for (const SolvedPose& pose : scene.poses) list_m.push_back(pose.position_m.dot(toward));
  return list_m;
}

}  // namespace

/// The operator takes the sensor with whichever hand is nearer; the left one wears a steel watch.
Drawn drawWristwatch(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d toward = level(random, scene.up), left = scene.up.cross(toward);
  const double standing_m = extent_m(scene, -toward) + uniform(random, 0.35, 0.5);
  const Vector3d shoulder_m = scene.middle_m - standing_m * toward + 0.2 * left + 0.2 * scene.up;
  const double left_from_m = quantile(alongAll_m(scene, left), uniform(random, 0.35, 0.65));
  const double wrist_m = uniform(random, 0.15, 0.22);
  const double strap = uniform(random, -1.0, 0.3);
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose& pose, Matrix3d& couplings) {
      if (pose.position_m.dot(left) < left_from_m) return;
      const Vector3d forearm = (shoulder_m - pose.position_m).normalized();
      const Vector3d watch_m = keptAway(pose.position_m + wrist_m * forearm, 0.25);
      addField(pose, echo(watch_m, size * roundTensor(forearm, strap, 1.0), pose.position_m), couplings);
    });
  };
  const json parameters = {{"left", listed(left)}, {"left_from_m", left_from_m}, {"wrist_m", wrist_m}};
  return drawnOf({"wristwatch_on_the_left_hand", "the hand that holds the sensor at the left places wears a watch",
                  "polarizability_m3", 1e-8, 0.1, parameters, shoulder_m},
                 apply);
}

/// The jig is raised layer by layer on an operating table, whose frame of bare steel rises with it.
Drawn drawRisingFrame(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d along = level(random, scene.up), across = scene.up.cross(along);
  const double below_m = uniform(random, 0.2, 0.4);
  const Vector3d half_along_m = uniform(random, 0.8, 1.0) * along, half_across_m = uniform(random, 0.25, 0.35) * across;
  const Vector3d aside_m = uniform(random, -0.4, 0.4) * along + uniform(random, -0.2, 0.2) * across;
  const double inductance_h = roundLoopInductance(0.55, 0.02);
  const auto apply = [=, up = scene.up, foot_m = Vector3d(scene.middle_m + aside_m)](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose& pose, Matrix3d& couplings) {
      const Vector3d top_m = foot_m + ((pose.position_m - foot_m).dot(up) - below_m) * up;
      const Polygon frame = rectangle(top_m, half_along_m, half_across_m);
      addField(pose, size * frameField(frame, inductance_h, pose.position_m), couplings);
    });
  };
  return drawnOf({"table_frame_rises_with_the_places", "the steel frame of a table is raised with each layer of places",
                  "share_of_current", 1e-5, 30, json{{"below_m", below_m}, {"along", listed(along)}}},
                 apply);
}

/// Another tracker next door works a millihertz off: its field comes and goes in a beat, in each slot at another time.
Drawn drawTrackerNextDoor(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d at_m = beside(scene, direction(random), uniform(random, 0.5, 1.2));
  const Vector3d coil = direction(random);
  const double beat_s = scene.duration_s * logUniform(random, 0.08, 0.6);
  const Vector3d phases_rad = kPi * Vector3d(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1));
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose& pose, Matrix3d& couplings) {
      const double beat_rad = 2 * kPi * middleTime_s(row) / beat_s;
      const Eigen::RowVector3d slots = (phases_rad.array() + beat_rad).cos().matrix().transpose();
      addField(pose, size * dipoleField(keptAway(pose.position_m - at_m, 0.12)) * coil * slots, couplings);
    });
  };
  const json parameters = {{"beat_s", beat_s}, {"phases_rad", listed(phases_rad)}, {"coil", listed(coil)}};
  return drawnOf({"tracker_next_door_beats", "the field of another tracker next door beats with this one",
                  "moment_share", 1e-5, 30, parameters, at_m},
                 apply);
}

/// A fault of insulation lets a share of the drive current run to earth along a straight water pipe.
Drawn drawLeakToPipe(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d toward = direction(random);
  const Vector3d at_m = beside(scene, toward, uniform(random, 0.15, 0.5));
  const Vector3d pipe = level(random, toward);
  const Eigen::RowVector3d leak = direction(random).transpose();
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose& pose, Matrix3d& couplings) {
      const Vector3d from_m = pose.position_m - at_m;
      const Vector3d across_m = keptAway(from_m - from_m.dot(pipe) * pipe, 0.1);
      addField(pose, size * 2 * pipe.cross(across_m) / across_m.squaredNorm() * leak, couplings);
    });
  };
  const json parameters = {{"pipe", listed(pipe)}, {"leak", listed(leak.transpose())}};
  return drawnOf({"drive_current_leaks_along_a_pipe", "drive current returns to earth along a straight pipe",
                  "current_per_moment_m2", 1e-6, 30, parameters, at_m},
                 apply);
}

/// A patient in a wheelchair is rolled past while places are being measured.
Drawn drawWheelchair(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d toward = level(random, scene.up);
  const Vector3d nearest_m = beside(scene, toward, uniform(random, 0.4, 0.7));
  const double pass_s = scene.duration_s * uniform(random, 0.3, 0.7);
  const double half_pass_s = scene.duration_s * uniform(random, 0.06, 0.2);
  const Vector3d rolled_m = uniform(random, 0.8, 1.2) * scene.up.cross(toward);
  const Matrix3d axes = rotation(random).toRotationMatrix();
  const Vector3d stiff(1.0, uniform(random, 0.2, 0.8), uniform(random, -0.8, 0.4));
  const auto apply = [=, tensor = Matrix3d(axes * stiff.asDiagonal() * axes.transpose())](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose& pose, Matrix3d& couplings) {
      const Vector3d at_m = keptAway(nearest_m + (middleTime_s(row) - pass_s) / half_pass_s * rolled_m, 0.35);
      addField(pose, echo(at_m, size * tensor, pose.position_m), couplings);
    });
  };
  const json parameters = {{"pass_s", pass_s}, {"half_pass_s", half_pass_s}, {"rolled_m", listed(rolled_m)}};
  return drawnOf({"near:wheelchair_rolls_past", "a wheelchair is rolled past during the session", "polarizability_m3",
                  1e-6, 10, parameters, nearest_m},
                 apply);
}

/// The tuned antenna of an anti-theft gate warms up and drifts through the carrier: its echo grows, turns its sign
/// within a short time and fades.
Drawn drawTunedGate(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d at_m = beside(scene, direction(random), uniform(random, 0.3, 0.6));
  const Vector3d normal = direction(random);
  const double sharpness = uniform(random, 3, 12) * (uniform(random, 0, 1) < 0.5 ? -1 : 1);
  const double resonance_s = scene.duration_s * uniform(random, 0.25, 0.75);
  const auto apply = [=, duration_s = scene.duration_s](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose& pose, Matrix3d& couplings) {
      const double detuned = sharpness * (middleTime_s(row) - resonance_s) / duration_s;
      const double in_phase = 2 * detuned / (1 + detuned * detuned);
      addField(pose, echo(at_m, size * in_phase * roundTensor(normal, 1, 0), pose.position_m), couplings);
    });
  };
  const json parameters = {{"normal", listed(normal)}, {"sharpness", sharpness}, {"resonance_s", resonance_s}};
  return drawnOf({"tuned_gate_drifts_through_resonance", "the tuned antenna of a gate drifts through the carrier",
                  "polarizability_m3", 1e-6, 3, parameters, at_m},
                 apply);
}

/// A steel beam metres long carries flux from one end to the other; near one end that end is a single pole.
Drawn drawLongBeam(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d toward = direction(random);
  const Vector3d near_m = beside(scene, toward, uniform(random, 0.2, 0.5));
  const Vector3d away = (toward + uniform(random, 0.3, 2.0) * level(random, toward)).normalized();
  const Vector3d far_m = near_m + uniform(random, 2.0, 4.0) * away;
  const Eigen::RowVector3d drive = (poleField(near_m) - poleField(far_m)).transpose();
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose& pose, Matrix3d& couplings) {
      const Vector3d poles = poleField(pose.position_m - far_m) - poleField(pose.position_m - near_m);
      addField(pose, size * poles * drive, couplings);
    });
  };
  return drawnOf({"long_beam_has_a_pole_at_its_end", "a long steel beam ends beside the places in a magnetic pole",
                  "pole_per_potential_m", 1e-6, 3, json{{"far_end_m", listed(far_m)}}, near_m},
                 apply);
}

/// The ventilation blows a jet across the places; the sensor's thin stem bends where it stands in it.
Drawn drawAirJet(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const auto hit = static_cast<std::size_t>(uniformInt(random, 0, static_cast<int>(scene.poses.size()) - 1));
  const Vector3d outlet_m = beside(scene, level(random, scene.up), uniform(random, 0.2, 0.6));
  const Vector3d blows = (scene.poses[hit].position_m - outlet_m).normalized();
  const double wide_m = setup.pitch_m * uniform(random, 0.5, 0.9), widens = uniform(random, 0.05, 0.15);
  const double lean_per_m = uniform(random, 2, 6);
  const auto apply = [=, up = scene.up](World& world, double size) {
    world.mounting.push_back([=](const Row&, SolvedPose& pose) {
      const Vector3d from_m = pose.position_m - outlet_m;
      const double way_m = std::max(0.0, from_m.dot(blows)), radius_m = wide_m + widens * way_m;
      const double off = (from_m - from_m.dot(blows) * blows).norm() / radius_m;
      const double pressure = std::exp(-off * off) * std::pow(wide_m / radius_m, 2);
      pose.position_m += size * pressure * blows;
      pose.orientation = turned(size * pressure * lean_per_m * up.cross(blows), pose.orientation);
    });
  };
  const json parameters = {{"blows", listed(blows)}, {"wide_m", wide_m}, {"lean_rad_per_m", lean_per_m}};
  return drawnOf({"air_jet_bends_the_stem", "a jet of air bends the sensor's stem where it crosses the places",
                  "bend_m", 1e-6, 0.3, parameters, outlet_m},
                 apply);
}

/// The operator drags the lamp along only when its light no longer reaches: where it hangs depends on the way there.
Drawn drawDraggedLamp(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Course course = courseOf(setup);
  const double over_m = uniform(random, 0.3, 0.5);
  const double slack_m = uniform(random, 0.3, 0.7) * extent_m(scene, level(random, scene.up));
  const Matrix3d head = roundTensor((scene.up + 0.3 * direction(random)).normalized(), -1.0, -0.3);
  const auto above_m = [over_m, up = scene.up](const SolvedPose& pose) {
    return Vector3d(pose.position_m + over_m * up);
  };
  std::vector<Vector3d> lamp_m = {above_m(course.poses.front()) + slack_m * level(random, scene.up)};
  for (const SolvedPose& pose : course.poses) lamp_m.push_back(dragged(lamp_m.back(), above_m(pose), slack_m));
  lamp_m.erase(lamp_m.begin());
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose& pose, Matrix3d& couplings) {
      const Vector3d at_m = keptAway(dragged(lamp_m[course.before(row)], above_m(pose), slack_m), 0.3);
      addField(pose, echo(at_m, size * head, pose.position_m), couplings);
    });
  };
  return drawnOf({"lamp_dragged_after_the_operator", "the lamp overhead is dragged along after the operator",
                  "polarizability_m3", 1e-7, 1, json{{"over_m", over_m}, {"slack_m", slack_m}}},
                 apply);
}

}  // namespace blind::unforeseen
