#pragma once

#include <functional>

#include "calib/field/dipole_field.h"
#include "calib/field/pose_solver.h"
#include "tests/calib/gap/gap_fixtures.h"
#include "tests/support/random_geometry.h"

namespace fieldtrue::testing {

/// Change of the field matrix at a sensor pose, given the undisturbed one, tracker frame, C = 1 [1/m^3].
using FieldChange = std::function<Eigen::Matrix3d(const Pose&, const Eigen::Matrix3d&)>;

/// A cube of places whose readings are solved here from a field of our own making, with white noise.
struct NoisyRows {
  int per_axis = 4;
  int turns = 1;  ///< Sensor orientations, of threeTurns().
  FieldChange change;
  double sd_m = 0.002;
  double sd_rad = 0.004;
};

inline constexpr double kCubePitch_m = 0.2;

inline std::vector<Node> noisyNodes(const NoisyRows& options, unsigned seed) {
  RandomGeometry random(seed);
  const std::vector<Eigen::Quaterniond> turns = threeTurns();
  const auto white = [&](double sd) {
    const double x = random.normal();
    const double y = random.normal();
    const double z = random.normal();
    return Eigen::Vector3d(sd * x, sd * y, sd * z);
  };
  std::vector<Node> nodes;
  const int n = options.per_axis;
  for (int place = 0; place < n * n * n; ++place) {
    for (int turn = 0; turn < options.turns; ++turn) {
      Node node;
      node.node = place;
      node.visit = turn;
      node.reference_from_sensor.position_m =
          Eigen::Vector3d(0.6, -0.3, -0.3) +
          kCubePitch_m * Eigen::Vector3i(place / (n * n), place / n % n, place % n).cast<double>();
      node.reference_from_sensor.orientation = turns[static_cast<std::size_t>(turn)];
      node.tracker_from_sensor = node.reference_from_sensor;
      if (options.change) {
        const Pose& pose = node.reference_from_sensor;
        const Eigen::Matrix3d undisturbed = field::dipoleField(pose.position_m, 1.0);
        const Eigen::Matrix3d field = undisturbed + options.change(pose, undisturbed);
        node.tracker_from_sensor =
            field::solvePose(field::couplings(field, pose.orientation), 1.0, pose.position_m)->tracker_from_sensor;
      }
      node.tracker_from_sensor.position_m += white(options.sd_m);
      node.tracker_from_sensor.orientation =
          rotationFromVector(white(options.sd_rad)) * node.tracker_from_sensor.orientation;
      node.t_start_s = node.t_end_s = random.between(0.0, 1000.0);
      nodes.push_back(node);
    }
  }
  return nodes;
}

inline identify::GapRows noisyRows(const NoisyRows& options, unsigned seed) {
  return identify::makeGapRows(noisyNodes(options, seed), {}).value();
}

/// Upper 1 % of Kolmogorov's distance of 200 draws from the uniform distribution: 1.63 / sqrt(200).
inline constexpr double kFarFromUniform200 = 0.115;

inline double distanceFromUniform(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto n = static_cast<double>(values.size());
  double distance = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    distance = std::max(distance, std::abs(values[i] - static_cast<double>(i) / n));
    distance = std::max(distance, std::abs(values[i] - static_cast<double>(i + 1) / n));
  }
  return distance;
}

}  // namespace fieldtrue::testing
