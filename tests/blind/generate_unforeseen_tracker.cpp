#include <algorithm>
#include <cmath>

#include "tests/blind/generate_unforeseen.h"

namespace blind::unforeseen {
namespace {

Matrix3d couplingsAt(const SolvedPose& pose) {
  return pose.orientation.toRotationMatrix().transpose() * dipoleField(pose.position_m);
}

double smoothStep(double x) { return 0.5 + 0.5 * std::tanh(x); }

/// The tracker axis along which the places reach farthest, with a sign.
Vector3d longestAxis(const Scene& scene, Random& random) {
  Vector3d longest = Vector3d::UnitX();
  const auto length_m = [&](const Vector3d& axis) { return extent_m(scene, axis) + extent_m(scene, -axis); };
  for (const Vector3d& axis : {Vector3d(Vector3d::UnitY()), Vector3d(Vector3d::UnitZ())})
    if (length_m(axis) > length_m(longest)) longest = axis;
  return uniform(random, 0, 1) < 0.5 ? Vector3d(-longest) : longest;
}

}  // namespace

/// Each receiver amplifier switches to its low range above a level of its own signal; the ranges do not match.
Drawn drawRangeSwitch(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  Vector3d levels = Vector3d::Zero();
  for (int coil = 0; coil < 3; ++coil) {
    std::vector<double> strengths;
    for (const SolvedPose& pose : scene.poses) strengths.push_back(couplingsAt(pose).row(coil).norm());
    levels(coil) = quantile(strengths, uniform(random, 0.3, 0.7));
  }
  const Vector3d mismatch(1, uniform(random, -1, 1), uniform(random, -1, 1));
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose&, Matrix3d& couplings) {
      for (int coil = 0; coil < 3; ++coil)
        if (couplings.row(coil).norm() > levels(coil)) couplings.row(coil) *= std::exp(size * mismatch(coil));
    });
  };
  return drawnOf({"near:amplifier_switches_range", "ranges of the receiver amplifiers do not match", "log_gain", 1e-5,
                  2, json{{"levels", listed(levels)}, {"mismatch", listed(mismatch)}}},
                 apply);
}

/// The demodulator's output stage has a dead zone, so weak couplings come out too weak.
Drawn drawDeadZone(const Setup& setup, Random& random) {
  std::vector<double> strengths;
  for (const SolvedPose& pose : sceneOf(setup).poses) strengths.push_back(couplingsAt(pose).norm() / 3);
  const double width = quantile(strengths, 0.5) * uniform(random, 0.2, 0.6);
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose&, Matrix3d& couplings) {
      couplings = couplings.unaryExpr([=](double c) { return c - size * width * std::tanh(c / width); });
    });
  };
  return drawnOf({"dead_zone_in_demodulator", "weak couplings come out too weak", "share_lost", 1e-5, 1,
                  json{{"width_per_m3", width}}},
                 apply);
}

/// A cable with badly twisted pairs hangs between sensor and box and picks up the field halfway.
Drawn drawCableLoop(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d box_m = beside(scene, direction(random), uniform(random, 0.2, 0.8));
  const double hang_m = uniform(random, 0.1, 0.4);
  const Vector3d pairs = direction(random);
  const auto apply = [=, up = scene.up](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose& pose, Matrix3d& couplings) {
      const Vector3d halfway_m = keptAway(0.5 * (pose.position_m + box_m) - hang_m * up, 0.4);
      const Vector3d normal = (pose.position_m - box_m).cross(up) + 0.3 * up;
      couplings += size * pairs * (normal.normalized().transpose() * dipoleField(halfway_m));
    });
  };
  return drawnOf({"cable_loop_picks_up_midway", "the sensor's cable picks up the field halfway to the box",
                  "area_of_receiver_areas", 1e-5, 2, json{{"hang_m", hang_m}, {"pairs", listed(pairs)}}, box_m},
                 apply);
}

/// A filter that slows down where signals are weak has not let go of the cradle, far out, when recording starts.
Drawn drawUnsettledFilter(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d cradle_m = beside(scene, direction(random), uniform(random, 0.1, 0.5));
  const double power = uniform(random, 3, 6);
  const double usual_m = scene.middle_m.norm() + 0.1;
  const auto apply = [=](World& world, double size) {
    world.report.push_back([=](const Row&, SolvedPose& pose) {
      const double lag = std::tanh(size * std::pow(pose.position_m.norm() / usual_m, power));
      pose.position_m += lag * (cradle_m - pose.position_m);
    });
  };
  return drawnOf({"near:adaptive_filter_not_settled_far_out", "far out the filter still remembers the cradle",
                  "share_left", 1e-6, 2, json{{"power", power}, {"usual_m", usual_m}}, cradle_m},
                 apply);
}

/// The multiplexer reads a second, fixed sensor just before and keeps a share of its signals.
Drawn drawMultiplexer(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d at_m = (scene.middle_m.norm() * uniform(random, 0.6, 1.0) + 0.1) * direction(random);
  const Matrix3d second = couplingsAt({keptAway(at_m, 0.35), rotation(random)});
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose&, Matrix3d& couplings) { couplings += size * second; });
  };
  return drawnOf({"multiplexer_remembers_second_sensor", "signals of a fixed second sensor leak in", "share", 1e-6, 3,
                  json::object(), at_m},
                 apply);
}

/// While the autoclave heats, the mains sags, and the slots that come last in the driver's charge get least.
Drawn drawSaggingSupply(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const double period_s = scene.duration_s * uniform(random, 0.2, 0.6);
  const double heating = uniform(random, 0.3, 0.6), phase = uniform(random, 0, 1);
  const Vector3d slots(uniform(random, 0.0, 0.3), uniform(random, 0.3, 0.7), 1);
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose&, Matrix3d& couplings) {
      const double cycles = middleTime_s(row) / period_s + phase;
      const double share = cycles - std::floor(cycles);
      if (share > heating) return;
      const double sag = size * (1 - 0.4 * share / heating);
      for (int slot = 0; slot < 3; ++slot) couplings.col(slot) *= std::exp(-sag * slots(slot));
    });
  };
  const json parameters = {{"period_s", period_s}, {"heating", heating}, {"phase", phase}, {"slots", listed(slots)}};
  return drawnOf({"supply_sags_when_autoclave_heats", "transmitter slots lose current while an autoclave heats", "sag",
                  1e-5, 3, parameters},
                 apply);
}

/// The firmware takes azimuths from a table with too few entries and cuts every arc short between them.
Drawn drawCoarseTable(const Setup& setup, Random& random) {
  const double arc_m = setup.pitch_m * uniform(random, 0.7, 2.5);
  const int entries = std::max(12, static_cast<int>(2 * kPi * sceneOf(setup).middle_m.norm() / arc_m));
  const double first = uniform(random, 0, 1);
  const double elevation_share = uniform(random, -0.8, 0.8);
  const auto scallop = [=](double angle_rad) {
    const double turns = angle_rad / (2 * kPi) * entries + first;
    const double part = turns - std::floor(turns);
    return 4 * part * (1 - part) - 2.0 / 3;
  };
  const auto apply = [=](World& world, double size) {
    world.report.push_back([=](const Row&, SolvedPose& pose) {
      const Vector3d p_m = pose.position_m;
      const double azimuth_rad = std::atan2(p_m.y(), p_m.x());
      const double elevation_rad = std::atan2(p_m.z(), std::hypot(p_m.x(), p_m.y()));
      const Vector3d lifted = Vector3d(std::sin(azimuth_rad), -std::cos(azimuth_rad), 0);
      const Vector3d turn_rad =
          size * (scallop(azimuth_rad) * Vector3d::UnitZ() + elevation_share * scallop(elevation_rad) * lifted);
      pose.position_m = turned(turn_rad, Quaterniond::Identity()) * p_m;
    });
  };
  return drawnOf({"coarse_trig_table", "angles of the position come from a table with few entries", "arc_rad", 1e-6,
                  0.3, json{{"entries", entries}, {"first", first}, {"elevation_share", elevation_share}}},
                 apply);
}

/// Software holds one coordinate at the wall of the volume it believes it was licensed or set up for.
Drawn drawClippedCoordinate(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d axis = longestAxis(scene, random);
  const double outermost_m = scene.middle_m.dot(axis) + extent_m(scene, axis);
  const double length_m = extent_m(scene, axis) + extent_m(scene, -axis);
  const auto apply = [=](World& world, double size) {
    world.report.push_back([=](const Row&, SolvedPose& pose) {
      const double beyond_m = pose.position_m.dot(axis) - (outermost_m - size);
      if (beyond_m > 0) pose.position_m -= beyond_m * axis;
    });
  };
  return drawnOf({"near:coordinate_clips_at_wall", "one coordinate is held at the wall of a set volume", "cut_m",
                  1e-4 * length_m, length_m, json{{"axis", listed(axis)}, {"outermost_m", outermost_m}}},
                 apply);
}

/// A loudspeaker's magnet biases the ferrite core of the sensor, which then gains less along that field.
Drawn drawBiasedCore(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d at_m = beside(scene, direction(random), uniform(random, 0.2, 0.5));
  const Vector3d magnet = direction(random);
  double strongest = 0;
  for (const SolvedPose& pose : scene.poses)
    strongest = std::max(strongest, (dipoleField(pose.position_m - at_m) * magnet).norm());
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose& pose, Matrix3d& couplings) {
      const Vector3d bias = pose.orientation.conjugate() * (dipoleField(pose.position_m - at_m) * magnet) / strongest;
      const double lost = 0.8 * size * bias.squaredNorm() / (1 + size * bias.squaredNorm());
      const Vector3d along = bias.normalized();
      couplings -= lost * along * (along.transpose() * couplings);
    });
  };
  return drawnOf({"loudspeaker_magnet_biases_core", "a magnet biases the core of the sensor", "loss_at_nearest", 1e-5,
                  100, json{{"magnet", listed(magnet)}}, at_m},
                 apply);
}

/// A wireless sensor runs on its own crystal; between two radio synchronisations its reference slips in phase.
Drawn drawPhaseSlip(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const double period_s = scene.duration_s * uniform(random, 0.1, 0.45);
  const double first = uniform(random, 0, 1);
  const Vector3d early = 0.15 * direction(random);
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose&, Matrix3d& couplings) {
      const double cycles = middleTime_s(row) / period_s + first;
      const double slip = cycles - std::floor(cycles);
      for (int slot = 0; slot < 3; ++slot) couplings.col(slot) *= std::cos(size * (slip + early(slot) * slip));
    });
  };
  return drawnOf({"wireless_sensor_slips_phase", "the reference of a wireless sensor slips between synchronisations",
                  "slip_rad", 1e-3, 1.3, json{{"period_s", period_s}, {"first", first}, {"early", listed(early)}}},
                 apply);
}

/// The tracker fuses a compass into the heading; near a steel column the compass, and with it the tip, turns away.
Drawn drawFusedCompass(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d north = level(random, scene.up);
  const Vector3d at_m = beside(scene, level(random, scene.up), uniform(random, 0.2, 0.5));
  const Vector3d magnetised = direction(random);
  const Vector3d pointing = level(random, scene.up) + uniform(random, -0.7, 0.7) * scene.up;
  const Vector3d tip_m = uniform(random, 0.12, 0.25) * (scene.poses.front().orientation.conjugate() * pointing);
  const auto apply = [=, up = scene.up](World& world, double size) {
    world.report.push_back([=](const Row&, SolvedPose& pose) {
      const Vector3d field = north + size * dipoleField(pose.position_m - at_m) * magnetised;
      const double heading_rad = std::atan2(north.cross(field).dot(up), north.dot(field));
      turnAbout(pose.position_m - pose.orientation * tip_m, heading_rad * up, pose.position_m, pose.orientation);
    });
  };
  const json parameters = {{"north", listed(north)}, {"magnetised", listed(magnetised)}, {"tip_m", listed(tip_m)}};
  return drawnOf({"fused_compass_near_steel", "a compass fused into the heading is led astray by a steel column",
                  "moment_of_earth_field_m3", 1e-6, 3, parameters, at_m},
                 apply);
}

/// Two transmitters share the volume; beyond a boundary the second, badly registered one takes over.
Drawn drawHandover(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d toward = direction(random);
  std::vector<double> along_m;
  for (const SolvedPose& pose : scene.poses) along_m.push_back(pose.position_m.dot(toward));
  const double boundary_m = quantile(along_m, uniform(random, 0.35, 0.65));
  const double blend_m = uniform(random, 0.02, 0.15);
  const Vector3d shift = direction(random), turn_per_m = 2 * normalVector(random);
  const auto apply = [=, second_m = Vector3d(scene.middle_m + toward)](World& world, double size) {
    world.report.push_back([=](const Row&, SolvedPose& pose) {
      const double share = smoothStep((pose.position_m.dot(toward) - boundary_m) / blend_m);
      turnAbout(second_m, share * size * turn_per_m, pose.position_m, pose.orientation);
      pose.position_m += share * size * shift;
    });
  };
  const json parameters = {{"toward", listed(toward)}, {"boundary_m", boundary_m}, {"blend_m", blend_m}};
  return drawnOf(
      {"handover_to_second_transmitter", "beyond a boundary a badly registered second transmitter takes over",
       "registration_m", 1e-6, 0.3, parameters},
      apply);
}

}  // namespace blind::unforeseen
