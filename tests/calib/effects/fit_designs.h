#pragma once

#include <array>
#include <vector>

#include "calib/effects/effect_fit.h"
#include "tests/support/random_geometry.h"

namespace fieldtrue::testing {

/// A design and the settings it points to.
struct OwnedDesign {
  std::vector<field::SensorSetting> settings;
  effects::FitDesign design;
};

/// Where the rig stands in the designs below: shifted and turned, so that no axis of it is one of the tracker's.
inline Pose rigInTracker() { return {{0.9, 0.05, -0.1}, rotationFromVector(Eigen::Vector3d(0.1, -0.2, 0.5))}; }

inline void finish(OwnedDesign& owned, double pitch_m, bool has_times) {
  effects::FitDesign& design = owned.design;
  design.pitch_m = pitch_m;
  for (std::size_t i = 0; i < owned.settings.size(); ++i) {
    owned.settings[i].time_s = has_times ? 20.0 + 6.0 * static_cast<double>(i) : 0.0;
    design.places_m.extend(owned.settings[i].tracker_from_sensor.position_m);
  }
  design.has_times = has_times;
  design.start_s = owned.settings.front().time_s;
  design.end_s = owned.settings.back().time_s;
  design.settings = owned.settings;
}

/// 5 x 5 x 4 places 0.3 m apart about the rig's origin.
/// @param turns each place is visited once with every one of these orientations, rig's frame
inline OwnedDesign gridDesign(const std::vector<Eigen::Quaterniond>& turns, bool has_times, bool alignment_known) {
  OwnedDesign owned;
  const Pose tracker_from_reference = rigInTracker();
  for (const Eigen::Quaterniond& turn : turns) {
    for (int node = 0; node < 100; ++node) {
      const std::array<int, 3> index{node % 5, (node / 5) % 5, node / 25};
      const Pose reference_from_sensor{{0.3 * (index[0] - 2), 0.3 * (index[1] - 2), 0.3 * (index[2] - 1.5)}, turn};
      owned.settings.push_back({tracker_from_reference * reference_from_sensor, tracker_from_reference, index, 0.0});
    }
  }
  finish(owned, 0.3, has_times);
  owned.design.alignment_known = alignment_known;
  owned.design.several_orientations = turns.size() > 1;
  return owned;
}

inline std::vector<Eigen::Quaterniond> fourTurns() {
  const double quarter_rad = 1.5707963267948966;
  return {Eigen::Quaterniond::Identity(), rotationFromVector({quarter_rad, 0.0, 0.0}),
          rotationFromVector({0.0, quarter_rad, 0.0}), rotationFromVector({0.0, 0.0, quarter_rad})};
}

/// 80 scattered places, each with an orientation of its own.
inline OwnedDesign scatteredDesign(bool has_times, bool alignment_known) {
  OwnedDesign owned;
  RandomGeometry random(11);
  const Pose tracker_from_reference = rigInTracker();
  while (owned.settings.size() < 80) {
    const Pose reference_from_sensor{random.pointInCube_m(0.7), random.rotation()};
    const Pose tracker_from_sensor = tracker_from_reference * reference_from_sensor;
    if (tracker_from_sensor.position_m.norm() < 0.3) continue;
    owned.settings.push_back({tracker_from_sensor, tracker_from_reference, std::nullopt, 0.0});
  }
  finish(owned, 0.2, has_times);
  owned.design.alignment_known = alignment_known;
  owned.design.several_orientations = true;
  return owned;
}

}  // namespace fieldtrue::testing
