#include <algorithm>
#include <cmath>

#include "tests/blind/generate_unforeseen.h"

namespace blind::unforeseen {
namespace {

/// Polarizability of unit size of a thing that differs along one axis.
Matrix3d axialTensor(const Vector3d& axis, double along, double across) {
  return across * Matrix3d::Identity() + (along - across) * axis * axis.transpose();
}

/// Field of a small coil elsewhere in the room whose current the three slots take up unequally.
Matrix3d strangeField(const Vector3d& from_coil_m, const Vector3d& coil, const Eigen::RowVector3d& slots) {
  return dipoleField(keptAway(from_coil_m, 0.12)) * coil * slots;
}

Eigen::RowVector3d cosines(const Vector3d& phases_rad) { return phases_rad.array().cos().matrix().transpose(); }

Vector3d anyPhases_rad(Random& random) {
  Vector3d phases_rad;
  for (double& phase_rad : phases_rad) phase_rad = kPi * uniform(random, -1, 1);
  return phases_rad;
}

/// The point of a path of straight lines at a share of its lines.
Vector3d alongPath(const std::vector<Vector3d>& corners_m, double share) {
  const double place = std::clamp(share, 0.0, 1.0) * static_cast<double>(corners_m.size() - 1);
  const auto from = std::min(static_cast<std::size_t>(place), corners_m.size() - 2);
  const double part = place - static_cast<double>(from);
  return (1 - part) * corners_m[from] + part * corners_m[from + 1];
}

}  // namespace

/// Each time the drive of a fan changes its speed, an overtone of its switching sweeps across the carrier.
Drawn drawSweepingDrive(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d toward = direction(random);
  const Vector3d at_m = beside(scene, toward, uniform(random, 0.4, 1.0));
  const Vector3d coil = direction(random);
  const std::vector<double> crossings_s = instants(random, scene, uniformInt(random, 1, 3));
  const double width_s = scene.duration_s * uniform(random, 0.05, 0.14);
  const double chirp = uniform(random, 1, 5);
  const Vector3d phases_rad = anyPhases_rad(random);
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose& pose, Matrix3d& couplings) {
      Eigen::RowVector3d slots = Eigen::RowVector3d::Zero();
      for (const double crossing_s : crossings_s) {
        const double off = std::pow((middleTime_s(row) - crossing_s) / width_s, 2);
        slots += std::exp(-off) * cosines(phases_rad + Vector3d::Constant(2 * kPi * chirp * off));
      }
      addField(pose, size * strangeField(pose.position_m - at_m, coil, slots), couplings);
    });
  };
  const json parameters = {{"crossings_s", crossings_s}, {"width_s", width_s}, {"chirp", chirp}};
  return drawnOf({"near:fan_drive_sweeps_across_the_carrier", "an overtone of a fan's drive sweeps across the carrier",
                  "moment_share", 1e-5, 30, parameters, at_m},
                 apply);
}

/// A harmonic of a lift's converter lies in the band. The tracker takes away what it hears of it before the first slot;
/// while the lift sets off or comes to rest, drawing power or giving it back, that changes until the last.
Drawn drawLift(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d mains = direction(random);
  const std::vector<double> rides_s = instants(random, scene, uniformInt(random, 2, 6));
  std::vector<double> powers;
  for (std::size_t n = 0; n < rides_s.size(); ++n) {
    const double sign = uniform(random, 0, 1) < 0.5 ? -1 : 1;
    powers.push_back(sign * uniform(random, 0.4, 1.0));
  }
  const double ramp_s = scene.duration_s * uniform(random, 0.02, 0.06);
  const double late = uniform(random, 0.1, 0.4);
  const Eigen::RowVector3d slots(late, 0.5 * (1 + late), 1);
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose& pose, Matrix3d& couplings) {
      double rise = 0;
      for (std::size_t n = 0; n < rides_s.size(); ++n) {
        const double x = (middleTime_s(row) - rides_s[n]) / ramp_s;
        rise += powers[n] * (std::exp(-x * x) - 0.6 * std::exp(-(x - 2.5) * (x - 2.5)));
      }
      addField(pose, size * rise * mains * slots, couplings);
    });
  };
  const json parameters = {{"rides_s", rides_s}, {"powers", powers}, {"ramp_s", ramp_s}, {"mains", listed(mains)}};
  return drawnOf(
      {"lift_sets_off_between_slots", "a lift's hum in the band changes between the zero reading and the slots",
       "field_per_moment_m3", 1e-6, 30, parameters},
      apply);
}

/// A nerve stimulator behind the wall fires in trains, each of which meets the slots in other phases.
Drawn drawStimulator(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d toward = direction(random);
  const Vector3d at_m = beside(scene, toward, uniform(random, 0.5, 1.2));
  const Vector3d coil = direction(random);
  const std::vector<double> trains_s = instants(random, scene, uniformInt(random, 3, 9));
  const double train_s = scene.duration_s * uniform(random, 0.03, 0.07);
  std::vector<Eigen::RowVector3d> slots;
  for (std::size_t n = 0; n < trains_s.size(); ++n) slots.push_back(cosines(anyPhases_rad(random)));
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose& pose, Matrix3d& couplings) {
      const double now_s = middleTime_s(row);
      for (std::size_t n = 0; n < trains_s.size(); ++n)
        if (now_s >= trains_s[n] && now_s < trains_s[n] + train_s)
          addField(pose, size * strangeField(pose.position_m - at_m, coil, slots[n]), couplings);
    });
  };
  return drawnOf({"near:stimulator_fires_in_trains", "a nerve stimulator behind the wall fires now and then",
                  "moment_share", 1e-5, 100, json{{"trains_s", trains_s}, {"train_s", train_s}}, at_m},
                 apply);
}

/// The motor of a laboratory refrigerator saturates its own iron while it runs, which then hardly echoes any more.
Drawn drawCompressor(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d toward = level(random, scene.up);
  const Vector3d at_m = beside(scene, toward, uniform(random, 0.3, 0.6));
  const std::vector<double> switched_s = instants(random, scene, uniformInt(random, 3, 8));
  const int first = uniformInt(random, 0, 1);
  const double left = uniform(random, 0.0, 0.3);
  const Vector3d axis = direction(random);
  const Matrix3d tensor = axialTensor(axis, 1.0, uniform(random, 0.2, 0.7));
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose& pose, Matrix3d& couplings) {
      const bool runs = (passed(switched_s, middleTime_s(row)) + first) % 2 != 0;
      addField(pose, echo(at_m, size * (runs ? left : 1.0) * tensor, pose.position_m), couplings);
    });
  };
  const json parameters = {{"switched_s", switched_s}, {"runs_at_first", first}, {"left_while_running", left}};
  return drawnOf({"near:compressor_iron_saturates_while_running", "a compressor's iron echoes less while it runs",
                  "polarizability_m3", 1e-6, 10, parameters, at_m},
                 apply);
}

/// The sensor hangs from a boom, whose iron counterweight swings to the other side of the pivot, always as far from it.
Drawn drawCounterweight(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d toward = level(random, scene.up);
  const Vector3d pivot_m = beside(scene, toward, uniform(random, 0.3, 0.6));
  const double length_m = uniform(random, 0.3, 0.8);
  const double across = uniform(random, 0.3, 0.9);
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose& pose, Matrix3d& couplings) {
      const Vector3d boom = (pose.position_m - pivot_m).normalized();
      const Matrix3d tensor = size * axialTensor(boom, 1.0, across);
      addField(pose, echo(keptAway(pivot_m - length_m * boom, 0.35), tensor, pose.position_m), couplings);
    });
  };
  return drawnOf(
      {"near:counterweight_swings_against_the_sensor", "a boom's iron counterweight moves against the sensor",
       "polarizability_m3", 1e-6, 10, json{{"length_m", length_m}, {"across", across}}, pivot_m},
      apply);
}

/// Wood ran out, so the tall posts are carbon tubes: currents run round them, in the taller ones over more length.
Drawn drawCarbonPosts(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  std::vector<double> heights_m;
  for (const Row& row : setup.rows) heights_m.push_back(row.place_m.z());
  const double highest_m = *std::max_element(heights_m.begin(), heights_m.end());
  const double limit_m = quantile(heights_m, uniform(random, 0.4, 0.7));
  const double tall_m = std::min(limit_m, highest_m - 0.3 * setup.pitch_m);  // Some are carbon always.
  const double board_m = *std::min_element(heights_m.begin(), heights_m.end()) - uniform(random, 0.2, 0.4);
  const Matrix3d ring = axialTensor(scene.up, -1.0, -uniform(random, 0.05, 0.3));
  const auto apply = [=, up = scene.up](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose& pose, Matrix3d& couplings) {
      if (row.place_m.z() <= tall_m) return;
      Matrix3d field = Matrix3d::Zero();
      for (int n = 0; n < 8; ++n) {
        const double depth_m = 0.13 + 0.1 * n;
        const double there = std::clamp((row.place_m.z() - board_m - depth_m) / 0.1, 0.0, 1.0);
        const Vector3d at_m = keptAway(pose.position_m - depth_m * up, 0.25);
        field += echo(at_m, size * there * ring, pose.position_m);
      }
      addField(pose, field, couplings);
    });
  };
  return drawnOf({"near:tall_posts_are_carbon_tubes", "the tall posts are carbon tubes in which currents run round",
                  "polarizability_each_m3", 1e-8, 0.03, json{{"tall_jig_z_m", tall_m}, {"board_jig_z_m", board_m}}},
                 apply);
}

/// A cleaning robot sets out on its own and runs to and fro on the floor under the jig until it is done.
Drawn drawCleaningRobot(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const double floor_m = scene.lowest_m - uniform(random, 0.25, 0.45);
  const Vector3d under_m = scene.middle_m + (floor_m - scene.middle_m.dot(scene.up)) * scene.up;
  const double margin_m = uniform(random, 0.3, 0.6);
  const double room_m = margin_m + extent_m(scene, level(random, scene.up));
  std::vector<Vector3d> corners_m;
  for (int n = uniformInt(random, 6, 14); n >= 0; --n) corners_m.push_back(under_m + room_m * level(random, scene.up));
  const double from_s = scene.duration_s * uniform(random, 0.05, 0.4);
  const double until_s = scene.duration_s * uniform(random, 0.65, 0.95);
  const double along = -uniform(random, 0.3, 1.0);
  const Matrix3d tensor = axialTensor(scene.up, along, uniform(random, 0.3, 1.0));
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose& pose, Matrix3d& couplings) {
      const double share = (middleTime_s(row) - from_s) / (until_s - from_s);
      if (share < 0 || share > 1) return;
      addField(pose, echo(keptAway(alongPath(corners_m, share), 0.4), size * tensor, pose.position_m), couplings);
    });
  };
  json corners = json::array();
  for (const Vector3d& corner_m : corners_m) corners.push_back(listed(corner_m));
  return drawnOf(
      {"near:cleaning_robot_runs_under_the_jig", "a cleaning robot runs to and fro under the jig", "polarizability_m3",
       1e-6, 10, json{{"corners_m", corners}, {"from_s", from_s}, {"until_s", until_s}}},
      apply);
}

/// The reel of the lamp's cable gives off turns whenever the lamp is carried farther, and winds itself up at times.
Drawn drawCableReel(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Course course = courseOf(setup);
  const Vector3d toward = level(random, scene.up);
  const Vector3d at_m = beside(scene, toward, uniform(random, 0.2, 0.5));
  const std::vector<double> wound_s = instants(random, scene, uniformInt(random, 2, 8));
  const Vector3d axle = direction(random);
  double longest_m = 0;
  for (const SolvedPose& pose : scene.poses) longest_m = std::max(longest_m, (pose.position_m - at_m).norm());
  const auto pulled_m = [=](double before_m, double before_s, double now_s, const SolvedPose& pose) {
    const bool wound = passed(wound_s, now_s) > passed(wound_s, before_s);
    return std::max(wound ? 0.0 : before_m, (pose.position_m - at_m).norm());
  };
  std::vector<double> off_m = {0};
  for (std::size_t n = 0; n < course.poses.size(); ++n) {
    const double before_s = course.start_s[n == 0 ? 0 : n - 1];
    off_m.push_back(pulled_m(off_m.back(), before_s, course.start_s[n], course.poses[n]));
  }
  off_m.erase(off_m.begin());
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose& pose, Matrix3d& couplings) {
      const std::size_t last = course.before(row);
      const double now_off_m = pulled_m(off_m[last], course.start_s[last], row.start_s, pose);
      const double turns = std::max(0.1, 1 - 0.9 * now_off_m / longest_m);
      addField(pose, echo(at_m, -size * turns * turns * axialTensor(axle, 1, 0), pose.position_m), couplings);
    });
  };
  const json parameters = {{"wound_s", wound_s}, {"axle", listed(axle)}, {"longest_m", longest_m}};
  return drawnOf({"cable_reel_gives_off_turns", "a reel has fewer turns the farther its cable has been pulled",
                  "polarizability_m3", 1e-6, 10, parameters, at_m},
                 apply);
}

}  // namespace blind::unforeseen
