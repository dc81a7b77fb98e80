#include "tests/support/synthetic.h"

#include <cmath>
#include <numbers>
#include <random>

namespace fieldtrue::testing {

namespace {

/// Normal and uniform numbers that are the same with every standard library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform() { return (static_cast<double>(engine_() >> 11) + 0.5) * 0x1.0p-53; }
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }
  Eigen::Vector3d normals(double sd) {
    const double x = normal();
    const double y = normal();
    const double z = normal();
    return sd * Eigen::Vector3d(x, y, z);
  }

 private:
  std::mt19937_64 engine_;
};

double diagonal_m(const SyntheticOptions& options) {
  Eigen::Vector3d extent_m = Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    extent_m[axis] = (options.counts[static_cast<std::size_t>(axis)] - 1) * options.pitch_m[axis];
  }
  return extent_m.norm() > 0.0 ? extent_m.norm() : 1.0;
}

/// Three waves in different directions, each within [-1, 1].
Eigen::Vector3d waves(const SyntheticOptions& options, const Eigen::Vector3d& p_m) {
  const Eigen::Vector3d u = (p_m - options.origin_m) * (2.0 * std::numbers::pi / diagonal_m(options));
  return {std::sin(u.x() + 0.5 * u.y() + 0.3), std::sin(0.7 * u.y() - 0.4 * u.z() + 1.1),
          std::sin(0.6 * u.z() + 0.5 * u.x() - 0.8)};
}

Eigen::Quaterniond trueOrientation(int visit) {
  if (visit == 0) return Eigen::Quaterniond::Identity();
  return rotationFromVector(Eigen::Vector3d(0.9 * visit, -0.5 * visit * visit, 0.7 + 0.4 * visit));
}

Eigen::Vector3d rounded_m(const Eigen::Vector3d& p_m, double quantum_m) {
  if (quantum_m <= 0.0) return p_m;
  return p_m.unaryExpr([&](double value_m) { return std::round(value_m / quantum_m) * quantum_m; });
}

Node makeNode(const SyntheticOptions& options, const SyntheticNoise& noise, const Pose& reference_from_sensor,
              Random& random) {
  const Pose tracker_from_reference = inverse(options.reference_from_tracker);
  Pose stood = reference_from_sensor;
  stood.position_m += random.normals(noise.placing_sd_m);
  Node node;
  node.reference_from_sensor = reference_from_sensor;
  node.tracker_from_sensor = syntheticReading(options, tracker_from_reference * stood);
  Pose& tracked = node.tracker_from_sensor;
  tracked.position_m = rounded_m(tracked.position_m + random.normals(noise.position_sd_m), noise.quantum_m);
  tracked.orientation = canonical(rotationFromVector(random.normals(noise.rotation_sd_rad)) * tracked.orientation);
  node.has_orientation = options.has_orientation;
  if (!options.has_orientation) tracked.orientation = Eigen::Quaterniond::Identity();
  return node;
}

void addPlace(const SyntheticOptions& options, const SyntheticNoise& noise, const std::array<int, 3>& index,
              Random& random, CalibrationTable& table) {
  const Eigen::Vector3d steps(index[0], index[1], index[2]);
  const NodeRole role = random.uniform() < options.validation_fraction ? NodeRole::kValidation : NodeRole::kFit;
  const int place = index[0] + options.counts[0] * (index[1] + options.counts[1] * index[2]);
  for (int visit = 0; visit < options.orientations; ++visit) {
    const Pose truth{options.origin_m + options.pitch_m.cwiseProduct(steps), canonical(trueOrientation(visit))};
    Node node = makeNode(options, noise, truth, random);
    node.node = place;
    node.visit = visit;
    node.index = index;
    node.role = role;
    table.nodes.push_back(node);
  }
}

}  // namespace

Eigen::Vector3d syntheticDisplacement_m(const SyntheticOptions& options, const Eigen::Vector3d& p_true_m) {
  return options.smooth_distortion_m * waves(options, p_true_m) + options.affine * p_true_m;
}

Eigen::Quaterniond syntheticErrorRotation(const SyntheticOptions& options, const Eigen::Vector3d& p_true_m) {
  const Eigen::Vector3d turned = waves(options, p_true_m + Eigen::Vector3d(0.05, -0.03, 0.07));
  return rotationFromVector(options.orientation_error_rad * turned);
}

Pose syntheticReading(const SyntheticOptions& options, const Pose& tracker_from_sensor_true) {
  const Eigen::Vector3d& p_true_m = tracker_from_sensor_true.position_m;
  return {p_true_m + syntheticDisplacement_m(options, p_true_m),
          canonical(syntheticErrorRotation(options, p_true_m) * tracker_from_sensor_true.orientation)};
}

CalibrationTable syntheticTable(const SyntheticOptions& options, const SyntheticNoise& noise) {
  CalibrationTable table;
  Random random(noise.seed);
  for (int k = 0; k < options.counts[2]; ++k) {
    for (int j = 0; j < options.counts[1]; ++j) {
      for (int i = 0; i < options.counts[0]; ++i) addPlace(options, noise, {i, j, k}, random, table);
    }
  }
  if (noise.quantum_m > 0.0) table.metadata.quantum_m = noise.quantum_m;
  if (noise.placing_sd_m > 0.0) table.metadata.jig_tolerance_m = noise.placing_sd_m;
  return table;
}

}  // namespace fieldtrue::testing
