#include <algorithm>
#include <array>
#include <cmath>

#include "tests/blind/generate_unforeseen.h"

namespace blind::unforeseen {
namespace {

Matrix3d idealCouplings(const SolvedPose& pose) {
  return pose.orientation.toRotationMatrix().transpose() * dipoleField(pose.position_m);
}

/// Random vectors at the corners of a cubic lattice, linear between them.
struct CoarseMap {
  static constexpr int kSide = 6;
  Vector3d corner_m = Vector3d::Zero();
  double spacing_m = 1;
  std::array<Vector3d, kSide* kSide* kSide> values = {};

  Vector3d at(const Vector3d& p_m) const {
    const Eigen::Array3d place = ((p_m - corner_m) / spacing_m).array().max(0.0).min(kSide - 1.001);
    const Eigen::Array3i cell = place.cast<int>();
    const Eigen::Array3d share = place - cell.cast<double>();
    Vector3d sum = Vector3d::Zero();
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Array3i up(corner & 1, (corner >> 1) & 1, corner >> 2);
      const Eigen::Array3d weights = (up == 1).select(share, 1 - share);
      const Eigen::Array3i to = cell + up;
      const int entry = (to.x() * kSide + to.y()) * kSide + to.z();
      sum += weights.prod() * values[static_cast<std::size_t>(entry)];
    }
    return sum;
  }
};

CoarseMap drawCoarseMap(const Scene& scene, Random& random) {
  CoarseMap map;
  Vector3d reach_m;
  for (int axis = 0; axis < 3; ++axis)
    reach_m(axis) = std::max(extent_m(scene, Vector3d::Unit(axis)), extent_m(scene, -Vector3d::Unit(axis)));
  map.spacing_m = reach_m.maxCoeff() * uniform(random, 0.5, 1.0);
  const Vector3d shift(uniform(random, -0.5, 0.5), uniform(random, -0.5, 0.5), uniform(random, -0.5, 0.5));
  map.corner_m = scene.middle_m - map.spacing_m * (Vector3d::Constant(0.5 * (CoarseMap::kSide - 1)) + shift);
  for (Vector3d& value : map.values) value = normalVector(random);
  return map;
}

/// Mean of what is cut off when only leading bits are kept: half of the last bit, which doubles at powers of two.
double cutOff_m(double coordinate_m, double unit_m, double share) {
  const double octave = std::floor(std::log2(std::max(1e-6, std::abs(coordinate_m)) / unit_m));
  return std::copysign(0.5 * share * unit_m * std::exp2(octave), coordinate_m);
}

/// Value that follows another only as far as needed to stay within a band around it.
Vector3d held(const Vector3d& before_m, const Vector3d& now_m, const Vector3d& band_m) {
  return before_m.cwiseMax(now_m - band_m).cwiseMin(now_m + band_m);
}

}  // namespace

/// The driver still applies the correction map that was made in another room.
Drawn drawForeignMap(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const CoarseMap shifts = drawCoarseMap(scene, random), turns = drawCoarseMap(scene, random);
  const double turn_per_m = uniform(random, 0.0, 2.0);
  const auto apply = [=](World& world, double size) {
    world.report.push_back([=](const Row&, SolvedPose& pose) {
      const Vector3d p_m = pose.position_m;
      pose.position_m += size * shifts.at(p_m);
      pose.orientation = turned(size * turn_per_m * turns.at(p_m), pose.orientation);
    });
  };
  const json parameters = {{"spacing_m", {shifts.spacing_m, turns.spacing_m}}, {"turn_rad_per_m", turn_per_m}};
  return drawnOf({"near:correction_map_of_another_room_left_on", "the map of another room is still applied", "shift_m",
                  1e-6, 0.3, parameters},
                 apply);
}

/// To keep a cursor still, the driver passes a coordinate on only when it has left a band round the last value.
Drawn drawHeldOutput(const Setup& setup, Random& random) {
  const Course course = courseOf(setup);
  Vector3d bands(1.0, uniform(random, 0.2, 0.8), uniform(random, 0.2, 0.8));
  std::swap(bands(0), bands(uniformInt(random, 0, 2)));
  const auto apply = [=](World& world, double size) {
    std::vector<Vector3d> output_m = {course.poses.front().position_m};
    for (const SolvedPose& pose : course.poses)
      output_m.push_back(held(output_m.back(), pose.position_m, size * bands));
    output_m.erase(output_m.begin());
    world.report.push_back([=](const Row& row, SolvedPose& pose) {
      pose.position_m = held(output_m[course.before(row)], pose.position_m, size * bands);
    });
  };
  return drawnOf({"near:output_held_within_a_band", "a coordinate is passed on only when it has left a band", "band_m",
                  1e-6, 0.3, json{{"bands", listed(bands)}}},
                 apply);
}

/// A half broken strand of one coil's lead opens when the cable must bend back sharply toward its box.
Drawn drawBrokenStrand(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const Vector3d box_m = beside(scene, direction(random), uniform(random, 0.1, 0.5));
  const Vector3d exit = direction(random);
  const int coil = uniformInt(random, 0, 2);
  const auto straight = [=](const SolvedPose& pose) {
    return (pose.orientation * exit).dot((box_m - pose.position_m).normalized());
  };
  std::vector<double> all;
  for (const SolvedPose& pose : scene.poses) all.push_back(straight(pose));
  const double opens = quantile(all, uniform(random, 0.3, 0.6));
  const double soft = std::max(0.02, 0.25 * (quantile(all, 0.9) - quantile(all, 0.1)));
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose& pose, Matrix3d& couplings) {
      const double open = 0.5 - 0.5 * std::tanh((straight(pose) - opens) / soft);
      couplings.row(coil) *= std::exp(-size * open);
    });
  };
  const json parameters = {{"coil", coil}, {"exit", listed(exit)}, {"opens_at_cosine", opens}, {"soft", soft}};
  return drawnOf({"near:broken_strand_opens_when_bent", "one coil loses signal where the cable is bent back",
                  "log_loss", 1e-5, 3, parameters, box_m},
                 apply);
}

/// Coordinates are sent as short floating numbers whose last bits are cut, not rounded.
Drawn drawCutBits(const Setup&, Random& random) {
  const double unit_m = logUniform(random, 0.5, 1.0);
  const auto apply = [=](World& world, double size) {
    world.report.push_back([=](const Row&, SolvedPose& pose) {
      for (double& coordinate_m : pose.position_m) coordinate_m -= cutOff_m(coordinate_m, unit_m, size);
    });
  };
  return drawnOf({"near:coordinates_cut_to_few_bits", "the last bits of short floating numbers are cut off", "last_bit",
                  1e-5, 1, json{{"unit_m", unit_m}}},
                 apply);
}

/// The gain control is quick to go down and slow to come up again: after a strong signal a weak one is too weak.
Drawn drawSlowRelease(const Setup& setup, Random& random) {
  const Course course = courseOf(setup);
  const double tolerated = uniform(random, 0.0, 0.3);
  std::vector<double> strengths;
  for (const SolvedPose& pose : course.poses) strengths.push_back(idealCouplings(pose).norm());
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row& row, const SolvedPose& pose, Matrix3d& couplings) {
      const double fall = std::log(strengths[course.before(row)] / idealCouplings(pose).norm());
      couplings *= std::exp(-size * std::max(0.0, fall - tolerated));
    });
  };
  return drawnOf({"near:gain_control_slow_to_release", "coming from a strong signal the gain is still too low",
                  "share_left", 1e-5, 3, json{{"tolerated_log_fall", tolerated}}},
                 apply);
}

/// To stay in its hemisphere, the solver is kept off the plane through the transmitter that comes nearest.
Drawn drawHemisphereGuard(const Setup& setup, Random& random) {
  const Scene scene = sceneOf(setup);
  const double share = uniform(random, 0.0, 0.2);
  int nearest = 0;
  double nearest_m = 1e9;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> off_m;
    for (const SolvedPose& pose : scene.poses) off_m.push_back(std::abs(pose.position_m(axis)));
    const double low_m = quantile(off_m, share);
    if (low_m < nearest_m) nearest = axis, nearest_m = low_m;
  }
  const auto apply = [=](World& world, double size) {
    world.report.push_back([=](const Row&, SolvedPose& pose) {
      double& coordinate_m = pose.position_m(nearest);
      coordinate_m = std::copysign(std::hypot(coordinate_m, size), coordinate_m);
    });
  };
  return drawnOf({"hemisphere_guard_pushes_off_a_plane", "a guard pushes one coordinate away from zero", "guard_m",
                  1e-5, 2, json{{"axis", nearest}, {"nearest_m", nearest_m}}},
                 apply);
}

/// Since a fall, one coil of the sensor sits beside where the others are.
Drawn drawSlippedCoil(const Setup&, Random& random) {
  const int coil = uniformInt(random, 0, 2);
  const Vector3d toward = direction(random);
  const auto apply = [=](World& world, double size) {
    world.signal.push_back([=](const Row&, const SolvedPose& pose, Matrix3d& couplings) {
      SolvedPose slipped = pose;
      slipped.position_m = keptAway(pose.position_m + pose.orientation * (size * toward), 0.1);
      couplings.row(coil) += idealCouplings(slipped).row(coil) - idealCouplings(pose).row(coil);
    });
  };
  return drawnOf({"near:one_coil_slipped_within_the_sensor", "one coil of the sensor sits beside the others",
                  "slipped_m", 1e-5, 0.3, json{{"coil", coil}, {"toward", listed(toward)}}},
                 apply);
}

}  // namespace blind::unforeseen
