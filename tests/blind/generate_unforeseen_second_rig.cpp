#include <algorithm>
#include <cmath>

#include "tests/blind/generate_unforeseen.h"

namespace blind::unforeseen {
namespace {

/// Length of the way from one place to the next, over the session.
std::vector<double> moves_m(const Course& course) {
  std::vector<double> list_m;
  for (std::size_t n = 1; n < course.poses.size(); ++n)
    list_m.push_back((course.poses[n].position_m - course.poses[n - 1].position_m).norm());
  return list_m;
}

/// Angle about an axis from one point to another, the short way round [rad].
double angleBetween(const Vector3d& from_m, const Vector3d& to_m, const Vector3d& axis) {
  return std::atan2(axis.dot(from_m.cross(to_m)), from_m.dot(to_m) - axis.dot(from_m) * axis.dot(to_m));
}

/// Where a list of values lies at a place between two of its entries.
Vector3d between(const std::vector<Vector3d>& list, double place) {
  const double kept = std::clamp(place, 0.0, static_cast<double>(list.size() - 1));
  const auto below = std::min(static_cast<std::size_t>(kept), list.size() - 2);
  const double share = kept - static_cast<double>(below);
  return (1 - share) * list[below] + share * list[below + 1];
}

/// Displacement per error of length when a place is found by equal errors of its distances from fixed nails.
Vector3d shiftPerLength(const std::vector<Vector3d>& nails_m, const Vector3d& place_m) {
  Matrix3d normal = 0.02 * Matrix3d::Identity();
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& nail_m : nails_m) {
    const Vector3d from = (place_m - nail_m).normalized();
    normal += from * from.transpose();
    sum += from;
  }
  return normal.ldlt().solve(sum);
}

}  // namespace

/// From the moment the sun reaches it, the board's upper face dries and the board cups, the posts on it leaning apart.
Drawn drawCuppedBoard(const Setup& setup, Random& random) {
  const Span span = spanOf(setup);
  const int axis = span.longSide();
  const double ridge_m = span.middle_m()(axis) + uniform(random, -0.3, 0.3) * span.length_m()(axis);
  const double board_m = span.low_m.z() - uniform(random, 0.0, 0.2);
  const double duration_s = sceneOf(setup).duration_s;
  const double sun_s = duration_s * uniform(random, 0.1, 0.6), constant_s = duration_s * uniform(random, 0.1, 0.5);
  const auto apply = [=](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond& attitude) {
      const double lit_s = std::max(0.0, middleTime_s(row) - sun_s);
      const double curvature_per_m = size * (1 - std::exp(-lit_s / constant_s));
      const double from_m = row.place_m(axis) - ridge_m, slope = curvature_per_m * from_m;
      place_m.z() += 0.5 * slope * from_m;
      place_m(axis) -= slope * (row.place_m.z() - board_m);
      attitude = turned(slope * Vector3d::Unit(axis).cross(Vector3d::UnitZ()), attitude);
    });
  };
  const json parameters = {{"axis", axis}, {"ridge_jig_m", ridge_m}, {"sun_s", sun_s}, {"constant_s", constant_s}};
  return drawnOf({"near:board_cups_once_the_sun_is_on_it", "the board cups as the sun dries one face",
                  "curvature_per_m", 1e-5, 3, parameters},
                 apply);
}

/// Somebody secured a few of the posts with steel screws, a hand's breadth under the sensor.
Drawn drawScrews(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const int count = std::max(3, static_cast<int>(scene.poses.size()) / uniformInt(random, 8, 20));
  std::vector<Vector3d> screws_m;
  std::vector<Matrix3d> moments;
  for (int n = 0; n < count; ++n) {
    const int post = uniformInt(random, 0, static_cast<int>(scene.poses.size()) - 1);
    const Vector3d below_m = uniform(random, 0.06, 0.1) * scene.up + 0.02 * direction(random);
    const Vector3d at_m = keptAway(scene.poses[static_cast<std::size_t>(post)].position_m - below_m, 0.2);
    const Vector3d shank = direction(random);
    const Matrix3d needle = 0.2 * Matrix3d::Identity() + 0.8 * shank * shank.transpose();
    screws_m.push_back(at_m);
    moments.push_back(logUniform(random, 0.4, 1.0) * needle * dipoleField(at_m));
  }
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose& pose, Matrix3d& couplings) {
      Matrix3d field = Matrix3d::Zero();
      for (std::size_t n = 0; n < screws_m.size(); ++n)
        field += dipoleField(keptAway(pose.position_m - screws_m[n], 0.05)) * moments[n];
      addField(pose, size * field, couplings);
    });
  };
  return drawnOf({"near:steel_screws_under_a_few_places", "a few posts are held by steel screws right under the sensor",
                  "polarizability_each_m3", 1e-9, 1e-2, json{{"screws", count}}},
                 apply);
}

/// Each hole was marked with dividers from the one before, so that errors add up along the row.
Drawn drawChainedHoles(const Setup& setup, Random& random) {
  const Span span = spanOf(setup);
  const int axis = span.longSide();
  const double mean = uniform(random, -0.5, 0.5), sideways = uniform(random, 0.3, 1.0);
  std::vector<Vector3d> offsets = {Vector3d::Zero()};
  for (double at_m = -setup.pitch_m; at_m < span.length_m()(axis) + setup.pitch_m; at_m += setup.pitch_m) {
    Vector3d step = Vector3d::Zero();
    step(axis) = mean + normal(random);
    step(1 - axis) = sideways * normal(random);
    offsets.push_back(offsets.back() + step);
  }
  const auto apply = [=, pitch_m = setup.pitch_m](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond&) {
      place_m += size * between(offsets, 1 + (row.place_m(axis) - span.low_m(axis)) / pitch_m);
    });
  };
  return drawnOf({"each_hole_marked_from_the_last", "errors add up as each hole is marked from the one before",
                  "step_error_m", 1e-6, 0.3, json{{"axis", axis}, {"mean", mean}, {"sideways", sideways}}},
                 apply);
}

/// Places were found with a tape from three nails on the board and one on the wall; its hook is bent, so that every
/// distance is off by the same length.
Drawn drawBentHook(const Setup& setup, Random& random) {
  const Span span = spanOf(setup);
  const double first_rad = uniform(random, 0, 2 * kPi), low_m = span.low_m.z() - uniform(random, 0.1, 0.3);
  std::vector<Vector3d> nails_m;
  for (int n = 0; n < 4; ++n) {
    const double angle_rad = first_rad + kPi / 2 * (n + uniform(random, -0.3, 0.3));
    const double out_m = uniform(random, 0.2, 0.5);
    Vector3d nail_m = span.middle_m();
    nail_m.x() += (0.5 * span.length_m()(0) + out_m) * std::cos(angle_rad);
    nail_m.y() += (0.5 * span.length_m()(1) + out_m) * std::sin(angle_rad);
    nail_m.z() = n < 3 ? low_m : span.high_m.z() + out_m;
    nails_m.push_back(nail_m);
  }
  const auto apply = [=](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond&) {
      place_m += size * shiftPerLength(nails_m, row.place_m);
    });
  };
  json list = json::array();
  for (const Vector3d& nail_m : nails_m) list.push_back(listed(nail_m));
  return drawnOf({"tape_hook_bent_when_places_were_found", "distances from nails are all off by the same length",
                  "hook_m", 1e-6, 0.3, json{{"nails_jig_m", list}}},
                 apply);
}

/// The operator squares the block by eye without changing place, so it looks at him by a share of its bearing.
Drawn drawSquaredByEye(const Setup& setup, Random& random) {
  const Span span = spanOf(setup);
  const Vector3d facing = level(random, Vector3d::UnitZ());
  const double back_m = (0.5 * span.high_m - 0.5 * span.low_m).head<2>().norm() + uniform(random, 0.1, 0.4);
  const Vector3d stands_m = span.middle_m() - back_m * facing;
  const Vector3d arm_m = uniform(random, 0.06, 0.15) * direction(random);
  const auto apply = [=](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond& attitude) {
      const double bearing_rad = angleBetween(facing, row.place_m - stands_m, Vector3d::UnitZ());
      const Vector3d pivot_m = place_m - attitude * arm_m;
      turnAbout(pivot_m, size * bearing_rad * Vector3d::UnitZ(), place_m, attitude);
    });
  };
  const json parameters = {{"stands_jig_m", listed(stands_m)}, {"arm_m", listed(arm_m)}};
  return drawnOf({"block_squared_by_eye_from_one_spot", "the block is squared by eye and turns toward the operator",
                  "share_of_bearing", 1e-4, 3, parameters},
                 apply);
}

/// Recording starts a fixed time after the last one; after a long way the carriage is still short of its place.
Drawn drawShortCountdown(const Setup& setup, Random& random) {
  const Course course = courseOf(setup);
  const std::vector<double> ways_m = moves_m(course);
  const double reach_m = quantile(ways_m, 0.95) * uniform(random, 0.4, 0.8);
  const auto apply = [=](World& world, double size) {
    world.mounting.push_back([=](const Row& row, SolvedPose& pose) {
      const Vector3d back_m = course.poses[course.before(row)].position_m - pose.position_m;
      const double beyond_m = back_m.norm() - reach_m;
      if (beyond_m > 0) pose.position_m += std::tanh(size) * beyond_m * back_m.normalized();
    });
  };
  return drawnOf(
      {"near:countdown_too_short_for_long_ways", "after a long way recording starts before the place is reached",
       "share_missing", 1e-5, 2, json{{"reach_m", reach_m}}},
      apply);
}

/// Layers are reached by stacking spacers that are neither equally thick nor quite parallel, turned as they come.
Drawn drawWedgedSpacers(const Setup& setup, Random& random) {
  const Span span = spanOf(setup);
  const int layers = setup.counts.z();
  const double spacing_m = layers > 1 ? span.length_m()(2) / (layers - 1) : 1.0;
  const double wedge_per_m = uniform(random, 0.5, 3.0);
  std::vector<double> raised = {0};
  std::vector<Vector3d> tilts = {Vector3d::Zero()};
  for (int layer = 1; layer < layers; ++layer) {
    raised.push_back(raised.back() + normal(random));
    tilts.push_back(tilts.back() + wedge_per_m * normal(random) * level(random, Vector3d::UnitZ()));
  }
  const auto apply = [=](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond& attitude) {
      const double above = (row.place_m.z() - span.low_m.z()) / spacing_m;
      const auto layer = static_cast<std::size_t>(std::clamp(std::lround(above), 0L, static_cast<long>(layers - 1)));
      const Vector3d foot_m(span.middle_m().x(), span.middle_m().y(), row.place_m.z());
      turnAbout(foot_m, size * tilts[layer], place_m, attitude);
      place_m.z() += size * raised[layer];
    });
  };
  return drawnOf(
      {"near:spacers_under_layers_are_wedges", "stacked spacers of unequal thickness tilt each layer its own way",
       "thickness_error_m", 1e-6, 0.3, json{{"wedge_rad_per_m", wedge_per_m}, {"raised", raised}}},
      apply);
}

/// Two people share the work, each with a sensor of his own: one the black, the other the white squares.
Drawn drawCheckerboard(const Setup& setup, Random& random) {
  const Vector3d corner_m = spanOf(setup).low_m;
  Matrix3d differs;
  for (int column = 0; column < 3; ++column) differs.col(column) = 0.6 * normalVector(random);
  const auto apply = [=, pitch_m = setup.pitch_m](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose&, Matrix3d& couplings) {
      const Vector3d steps = (row.place_m - corner_m) / pitch_m;
      const long square = std::lround(steps.x()) + std::lround(steps.y()) + std::lround(steps.z());
      if (square % 2 != 0) couplings = (couplings + size * differs * couplings).eval();
    });
  };
  return drawnOf({"two_sensors_share_a_checkerboard", "every other place was measured with another sensor",
                  "difference", 1e-5, 0.6, json{{"corner_jig_m", listed(corner_m)}}},
                 apply);
}

/// Walking round the jig winds the sensor's cable up, which twists the sensor in its seat until it is unplugged.
Drawn drawWoundCable(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Course course = courseOf(setup);
  const std::vector<double> unplugged_s = instants(random, scene, uniformInt(random, 0, 2));
  const Vector3d exit = direction(random);
  const Vector3d arm_m = uniform(random, 0.03, 0.08) * exit.unitOrthogonal();
  const Vector3d axis_m = scene.middle_m + 0.1 * level(random, scene.up);
  const auto walked_rad = [axis_m, up = scene.up](const SolvedPose& from, const SolvedPose& to) {
    return angleBetween(from.position_m - axis_m, to.position_m - axis_m, up);
  };
  std::vector<double> wound_rad = {0};
  for (std::size_t n = 1; n < course.poses.size(); ++n) {
    const bool unplugged = passed(unplugged_s, course.start_s[n]) > passed(unplugged_s, course.start_s[n - 1]);
    wound_rad.push_back((unplugged ? 0 : wound_rad.back()) + walked_rad(course.poses[n - 1], course.poses[n]));
  }
  const auto apply = [=](World& world, double size) {
    world.mounting.push_back([=](const Row& row, SolvedPose& pose) {
      const std::size_t last = course.before(row);
      const bool unplugged = passed(unplugged_s, row.start_s) > passed(unplugged_s, course.start_s[last]);
      const double winding_rad = (unplugged ? 0 : wound_rad[last]) + walked_rad(course.poses[last], pose);
      const Vector3d pivot_m = pose.position_m - pose.orientation * arm_m;
      turnAbout(pivot_m, size * winding_rad * (pose.orientation * exit), pose.position_m, pose.orientation);
    });
  };
  const json parameters = {{"unplugged_s", unplugged_s}, {"exit", listed(exit)}, {"arm_m", listed(arm_m)}};
  return drawnOf({"cable_winds_up_walking_round", "the cable winds up and twists the sensor in its seat",
                  "twist_per_winding", 1e-5, 3, parameters},
                 apply);
}

/// The drill template is printed paper, which puckers round a blob of glue and draws the holes near it together.
Drawn drawPuckeredTemplate(const Setup& setup, Random& random) {
  const auto near = static_cast<std::size_t>(uniformInt(random, 0, static_cast<int>(setup.rows.size()) - 1));
  const Vector3d blob_m =
      setup.rows[near].place_m + setup.pitch_m * uniform(random, 0.2, 0.7) * level(random, Vector3d::UnitZ());
  const double wide_m = setup.pitch_m * uniform(random, 0.6, 1.1);
  const auto apply = [=](World& world, double size) {
    world.rig.push_back([=](const Row& row, Vector3d& place_m, Quaterniond&) {
      Vector3d toward = (blob_m - row.place_m) / wide_m;
      toward.z() = 0;
      place_m += size * std::exp(0.5 - 0.5 * toward.squaredNorm()) * toward;
    });
  };
  return drawnOf({"paper_template_puckers_round_glue", "holes near a blob of glue are drawn together", "drawn_m", 1e-6,
                  0.3, json{{"blob_jig_m", listed(blob_m)}, {"wide_m", wide_m}}},
                 apply);
}

}  // namespace blind::unforeseen
