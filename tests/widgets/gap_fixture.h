#pragma once

#include "calib/gap/diagnosis.h"
#include "tests/calib/gap/gap_fixtures.h"

namespace fieldtrue::testing {

/// A room in which the withheld cause is known.
struct KnownRoom {
  CalibrationTable table;
  CalibrationTable before;  ///< Recorded at other places before the metal came.
  SampleTable samples;
  Eigen::Vector3d body_m;  ///< The metal's centre in the rig's frame.
};

inline const Eigen::Vector3d kBody_m{0.45, 0.3, -0.35};

/// A steel ball under the grid.
inline simulation::Scene steelScene() {
  simulation::Scene scene = gapScene();
  const Eigen::Vector3d in_tracker_m = inverse(scene.reference_from_tracker) * kBody_m;
  scene.effects.push_back({"compact_metal",
                           {{"center_m", {in_tracker_m.x(), in_tracker_m.y(), in_tracker_m.z()}},
                            {"radius_m", 0.14},
                            {"material", "ferromagnetic"}}});
  return scene;
}

/// 100 places over it.
inline KnownRoom roomWithSteel() {
  KnownRoom room;
  room.body_m = kBody_m;
  GapPlan plan;
  plan.counts = {5, 5, 4};
  plan.is_scattered = true;
  room.before = recordedIn(gapScene(), gapPlan(plan), 6);
  plan.is_scattered = false;
  room.table = recordedIn(steelScene(), gapPlan(plan), 7, &room.samples);
  return room;
}

/// What a diagnosis of that kind says, every part of it filled in by hand.
inline gap::GapReport writtenReport() {
  gap::GapReport report;
  report.verdict = gap::GapVerdict::kPartlyExplained;
  report.text = "Most of the gap is metal near place 2; look there first.";
  report.next_measurement = "Take place 2 again with the sensor turned by 90 degrees.";
  report.floor_position_mm = 1.5;
  for (int n = 0; n < 4; ++n) {
    gap::GapNode node;
    node.node = n;
    node.place_m = {0.5 + 0.2 * n, 0.1, 0.0};
    node.before_m = {0.001 * (n + 1), 0.0, 0.0};
    node.after_m = {0.0, 0.0005, 0.0};
    node.is_flagged = n == 2;
    report.nodes.push_back(node);
  }
  gap::SelectedEffect metal;
  metal.effect = "compact_metal";
  metal.equivalents = {"compact_metal", "finite_plate"};
  metal.probability = 0.75;
  metal.location_m = Eigen::Vector3d(0.9, 0.1, -0.4);
  metal.location_covariance_m2 = Eigen::Vector3d(4e-4, 1e-4, 1e-4).asDiagonal();
  metal.shrinkage = {4.0, 1.0, 0.75, 0.6, 0.85};
  metal.scene_parameters = {{"center_m", {0.9, 0.1, -0.4}}, {"radius_m", 0.1}, {"material", "conductive"}};
  gap::GapCandidate drift;
  drift.effect = "gain_drift";
  drift.probability = 0.2;
  drift.shrinkage = {4.0, 3.6, 0.1, -0.1, 0.2};
  drift.is_plausible = false;
  drift.doubt = "a drift of 9 percent an hour";
  gap::GapCandidate none;
  none.effect = "none";
  none.probability = 0.05;
  report.selected = {metal};
  report.candidates = {metal, drift, none};
  report.sequence = {{"", 4.0, 3.0, 5.0}, {"compact_metal", 1.0, 0.5, 1.5}};
  report.by_range = {{0.4, 0.8, 2.0, 1.5}, {0.8, 1.2, 4.0, 1.5}};
  report.by_time = {{0.0, 60.0, 3.0, 1.5}};
  report.origin = {0.8, 0.1, 0.05, 0.05};
  report.findings = {{"", "Places 0 and 3 hold the same reading.", {0, 3}}};
  report.predictions = {{"compact_metal", 0, 2, 31.0, 12.0, 4.0}};
  return report;
}

}  // namespace fieldtrue::testing
