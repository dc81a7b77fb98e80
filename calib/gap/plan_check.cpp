#include "calib/gap/plan_check.h"

#include <algorithm>
#include <set>

#include "calib/field/tracker_model.h"
#include "calib/gap/isolability.h"
#include "calib/identify/search.h"

namespace fieldtrue::gap {
namespace {

constexpr std::size_t kStartsEach = 60;

/// The transmitter one pitch behind the middle of the grid's first face, where no scene says otherwise.
Pose defaultTransmitter(std::span<const PlannedPlace> plan) {
  Eigen::AlignedBox3d box;
  for (const PlannedPlace& place : plan) box.extend(place.reference_from_sensor.position_m);
  Pose reference_from_tracker;
  reference_from_tracker.position_m = box.center();
  reference_from_tracker.position_m.x() = box.min().x() - std::max(0.3, 0.25 * box.sizes().x());
  return reference_from_tracker;
}

double placingSd_m(const simulation::Scene& scene) {
  return scene.rig.tolerance_m > 0.0 ? scene.rig.tolerance_m : evaluation::kUsualPlacing_m;
}

std::size_t countPlaces(std::span<const PlannedPlace> plan) {
  std::set<int> nodes;
  for (const PlannedPlace& place : plan)
    if (place.role != NodeRole::kSkipped) nodes.insert(place.node);
  return nodes.size();
}

/// The rows that a plan would give were nothing wrong, with the noise of the scene's tracker and rig.
Result<identify::GapRows> plannedRows(std::span<const PlannedPlace> plan, const simulation::Scene& scene) {
  constexpr double kSecondsEach = 10.0;
  constexpr double kSamplesEach = 60.0;
  const Pose tracker_from_reference = inverse(scene.reference_from_tracker);
  std::vector<Node> nodes;
  for (const PlannedPlace& place : plan) {
    if (place.role == NodeRole::kSkipped) continue;
    Node node;
    node.node = place.node;
    node.visit = place.visit;
    node.index = place.index;
    node.reference_from_sensor = place.reference_from_sensor;
    node.tracker_from_sensor = tracker_from_reference * place.reference_from_sensor;
    const Eigen::Matrix<double, 6, 9> by_field = field::poseByField(node.tracker_from_sensor.position_m);
    const double sd = scene.tracker.coupling_noise / scene.tracker.dipole_constant_m3;
    node.covariance_m2 = sd * sd * by_field.topRows<3>() * by_field.topRows<3>().transpose();
    node.sd_rot_rad = sd * by_field.bottomRows<3>().norm();
    node.n_used = static_cast<int>(kSamplesEach);
    node.n_effective = kSamplesEach * (1.0 - scene.tracker.correlation) / (1.0 + scene.tracker.correlation);
    node.t_start_s = kSecondsEach * static_cast<double>(nodes.size());
    node.t_end_s = node.t_start_s;
    nodes.push_back(node);
  }
  TableMetadata metadata;
  metadata.alignment_known = scene.rig.alignment_known;
  metadata.alignment_tolerance_m = scene.rig.alignment_tolerance_m;
  metadata.alignment_tolerance_rad = scene.rig.alignment_tolerance_rad;
  metadata.jig_tolerance_m = placingSd_m(scene);
  metadata.jig_tolerance_rad = scene.rig.tolerance_rad > 0.0 ? scene.rig.tolerance_rad : 3.5e-3;
  auto rows = identify::makeGapRows(nodes, metadata);
  if (rows) rows->stated_tracker_from_reference = tracker_from_reference;
  return rows;
}

}  // namespace

Result<PlanCheck> planCheck(std::span<const PlannedPlace> plan, const simulation::Scene* scene,
                            const RunControl& control) {
  simulation::Scene believed = scene != nullptr ? *scene : simulation::Scene{};
  if (scene == nullptr) believed.reference_from_tracker = defaultTransmitter(plan);
  const std::size_t fewest = identify::Thresholds{}.fewest_places_for_causes;
  const std::size_t n_places = countPlaces(plan);
  if (n_places < fewest) {
    return fail(ErrorCode::kTooFewNodes, "A plan is checked with at least " + std::to_string(fewest) +
                                             " places; this one has " + std::to_string(n_places) + ".");
  }
  FT_TRY(auto rows, plannedRows(plan, believed));
  FT_TRY(auto effects, simulation::makeEffects(believed.effects, rows.excitation));
  const identify::GapSearch search(rows, std::move(effects), identify::NoiseFrom::kStated);
  PlanCheck check{
      isolabilityOf(search, kStartsEach, Imitators::kFitted, control),
      evaluation::plannedOrientations(plan, inverse(believed.reference_from_tracker), placingSd_m(believed))};
  if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "The check of the plan was stopped.");
  return check;
}

}  // namespace fieldtrue::gap
