#include "calib/gap/diagnosis.h"

#include <algorithm>
#include <cmath>

#include "calib/core/file_io.h"
#include "calib/gap/cleaning.h"
#include "calib/gap/gap_candidates.h"
#include "calib/gap/gap_held_out.h"
#include "calib/gap/gap_isolability.h"
#include "calib/gap/gap_next.h"
#include "calib/gap/gap_search.h"
#include "calib/gap/gap_traces.h"
#include "calib/gap/gap_where.h"
#include "calib/gap/sample_findings.h"

namespace fieldtrue {
namespace {

constexpr std::size_t kStartsForIsolability = 24;

Result<std::vector<std::unique_ptr<PhysicalEffect>>> believedEffects(const Scene* scene, const Excitation& excitation) {
  std::vector<std::unique_ptr<PhysicalEffect>> effects;
  if (scene == nullptr) return effects;
  for (const EffectInstance& instance : scene->effects) {
    auto effect = makeEffect(instance.id, instance.parameters, excitation);
    if (!effect) return tl::unexpected<Error>(effect.error());
    effects.push_back(std::move(*effect));
  }
  return effects;
}

void takeFromScene(const Scene* scene, const TableMetadata& metadata, GapRows& rows) {
  if (scene == nullptr) return;
  if (!metadata.excitation) {
    rows.excitation.is_pulsed_dc = scene->tracker.excitation == "pulsed_dc";
    rows.excitation.sampling_delay_s = scene->tracker.sampling_delay_s;
  }
  if (!metadata.carrier_hz) rows.excitation.carrier_hz = scene->tracker.carrier_hz;
  if (!rows.placing_sd_m && scene->rig.tolerance_m > 0.0) rows.placing_sd_m = scene->rig.tolerance_m;
  if (!rows.placing_sd_rad && scene->rig.tolerance_rad > 0.0) rows.placing_sd_rad = scene->rig.tolerance_rad;
  if (metadata.alignment_known && metadata.frame != "tracker")
    rows.stated_tracker_from_reference = inverse(scene->reference_from_tracker);
}

/// What the verdict goes by.
struct Evidence {
  bool has_effect = false;      ///< One of the catalogue was selected.
  bool has_structure = false;   ///< Before any effect.
  bool is_above_floor = false;  ///< Clearly larger than a stated floor, structured or not.
  double fraction = 1.0;        ///< What is surely left over what there was before, amplitude.
};

/// What a selection leaves: all that smooth physics could make, and single traces of what no catalogue holds.
struct LeftOver {
  Structure structure;
  std::vector<Trace> traces;
};

LeftOver leftBy(const GapSearch& search, const GapModel& model, const GapRows& rows) {
  const Linearized at(search.physics(), model, search.whitening(), search.spaceBlocks());
  return {findStructure(at, rows, false), findTraces(at, rows)};
}

constexpr double kSureTrace = 1e-5;

Evidence weigh(const GapSearch& search, const Selection& selection, const HeldOutGap& held_out, const LeftOver& left,
               const GapRows& stated) {
  constexpr double kSure = 1e-4;
  constexpr double kSureOfNothingNamed = 1e-6;  // F tests of many columns are a little too sure.
  constexpr double kClearlyAbove = 1.6;         // A floor stated 20 % too low is no gap, nor is one stated by guess.
  const bool has_trace = left.traces.front().p_value < kSureTrace;
  Evidence evidence;
  evidence.has_effect = !selection.ways.empty();
  evidence.has_structure = search.structureOfNone().p_value < kSureOfNothingNamed || has_trace;
  const double placed_mm = stated.placing_sd_m ? 1e3 * *stated.placing_sd_m : 0.0;
  evidence.is_above_floor = placed_mm > 0.0 && 1e3 * search.placingSd_m() > kClearlyAbove * placed_mm;
  if (!evidence.has_effect) return evidence;
  const GapRows& rows = search.physics().rows();
  const double count = static_cast<double>(rows.rows.size()) * rows.channels();
  double sure_left = 0.0;
  if (left.structure.p_value < kSure) sure_left = std::max(0.0, held_out.left - 1.645 * held_out.left_sd);
  if (has_trace) sure_left = std::max(sure_left, left.traces.front().explained / count);
  evidence.fraction = std::sqrt(std::min(1.0, sure_left / std::max(held_out.before, 1e-12)));
  return evidence;
}

GapVerdict verdictOf(const Evidence& evidence) {
  if (!evidence.has_effect)
    return evidence.has_structure || evidence.is_above_floor ? GapVerdict::kUnexplained : GapVerdict::kNoGap;
  if (evidence.fraction <= 0.15) return GapVerdict::kExplained;
  return evidence.fraction <= 0.5 ? GapVerdict::kPartlyExplained : GapVerdict::kUnexplained;
}

std::string labelOf(const std::string& id) {
  const auto effect = findEffect(id);
  return effect ? (*effect)->label : id;
}

std::string shown(double value) {
  const double scale = value >= 10.0 ? 1.0 : value >= 1.0 ? 10.0 : 100.0;
  return formatNumber(std::round(value * scale) / scale);
}

std::string causesText(const GapReport& report) {
  std::string text;
  for (const SelectedEffect& effect : report.selected) {
    std::string name = labelOf(effect.effect);
    for (const std::string& other : effect.equivalents)
      if (other != effect.effect) name += " or " + labelOf(other) + " (this grid cannot tell)";
    text += (text.empty() ? "" : ", and ") + name;
  }
  return text;
}

constexpr double kPoorlyPredicted = 0.5;

std::string verdictText(const GapReport& report) {
  const std::string gap =
      shown(report.position_rms_mm) + " mm where noise alone would be " + shown(report.floor_position_mm) + " mm";
  const std::string percent = shown(100.0 * std::max(0.0, 1.0 - report.remaining_fraction)) + " %";
  switch (report.verdict) {
    case GapVerdict::kNoGap:
      return "No gap: the recording agrees with the simulation within its noise (" + gap + ").";
    case GapVerdict::kExplained:
      return "The gap (" + gap + ") is explained by: " + causesText(report) +
             "; on places the fit did not see it takes " + percent + " of it away" +
             (report.remaining_fraction > kPoorlyPredicted
                  ? ", because these lie where nothing else tells of it; nothing is left where it was measured."
                  : ".");
    case GapVerdict::kPartlyExplained:
      return "The gap (" + gap + ") is partly explained by: " + causesText(report) + "; this takes " + percent +
             " of it away, the rest has another cause.";
    case GapVerdict::kUnexplained:
      return "There is a gap (" + gap + "), but no known effect explains it" +
             (report.selected.empty()
                  ? std::string(".")
                  : "; the nearest, " + causesText(report) + ", takes only " + percent + " of it away.");
  }
  return {};
}

void addSequence(const HeldOutGap& held_out, double mm_per_unit, GapReport& report) {
  const auto mm = [&](double mean_square) { return mm_per_unit * std::sqrt(std::max(0.0, mean_square)); };
  report.sequence.push_back({"", mm(held_out.before), mm(held_out.before_low90), mm(held_out.before_high90)});
  for (std::size_t s = 0; s < report.selected.size(); ++s) {
    report.sequence.push_back(
        {report.selected[s].effect, mm(held_out.after[s]), mm(held_out.after_low90[s]), mm(held_out.after_high90[s])});
  }
}

void addRemaining(const HeldOutGap& held_out, const Evidence& evidence, GapReport& report) {
  double sum = 0.0;
  std::vector<std::pair<double, int>> worst;
  for (const GapNode& node : report.nodes) {
    sum += node.after_m.squaredNorm();
    worst.emplace_back(node.after_m.norm(), node.node);
  }
  report.remaining_position_rms_mm = 1e3 * std::sqrt(sum / static_cast<double>(report.nodes.size()));
  report.remaining_fraction = held_out.fractionAfter(report.selected.size());
  if (evidence.has_effect) report.remaining_fraction = std::max(report.remaining_fraction, evidence.fraction);
  std::sort(worst.rbegin(), worst.rend());
  for (const auto& [size_m, node] : worst) {
    if (1e3 * size_m < 2.5 * report.floor_position_mm || report.remaining_where.size() >= 10) break;
    if (std::find(report.remaining_where.begin(), report.remaining_where.end(), node) == report.remaining_where.end())
      report.remaining_where.push_back(node);
  }
}

void addTraces(const std::vector<Trace>& traces, GapReport& report) {
  for (const Trace& trace : traces)
    if (trace.p_value < kSureTrace)
      report.findings.push_back({"", "What no known effect explains looks as if " + trace.text + ".", {}});
}

/// Effects that single readings show stand beside those that the poses show.
void selectSignalFindings(GapReport& report) {
  for (const GapFinding& finding : report.findings) {
    if (finding.effect.empty()) continue;
    const auto is_same = [&](const SelectedEffect& e) { return e.effect == finding.effect; };
    if (std::any_of(report.selected.begin(), report.selected.end(), is_same)) continue;
    SelectedEffect effect;
    effect.effect = finding.effect;
    effect.equivalents = {finding.effect};
    effect.probability = 1.0;
    report.selected.push_back(std::move(effect));
  }
}

void describeInput(const GapRows& rows, const SampleTable* samples, GapReport& report) {
  report.input.places = static_cast<int>(rows.place_nodes.size());
  report.input.rows = static_cast<int>(rows.rows.size());
  report.input.samples = samples != nullptr ? static_cast<int>(samples->rows.size()) : 0;
  report.input.orientations = rows.n_orientations;
  report.input.position_only = !rows.has_orientation;
}

/// A part of the whole's progress.
RunControl partOf(const RunControl& control, double from, double to) {
  RunControl part = control;
  part.progress = [progress = control.progress, from, to](double fraction) { progress(from + (to - from) * fraction); };
  return part;
}

}  // namespace

Result<GapReport> diagnose(const CalibrationTable& table, const SampleTable* samples, const Scene* scene,
                           const DiagnosisOptions& options, const RunControl& control) {
  GapReport report;
  Cleaned cleaned = cleanRows(table);
  auto rows = makeGapRows(cleaned.nodes, table.metadata);
  if (!rows) return tl::unexpected<Error>(rows.error());
  takeFromScene(scene, table.metadata, *rows);
  auto believed = believedEffects(scene, rows->excitation);
  if (!believed) return tl::unexpected<Error>(believed.error());
  describeInput(*rows, samples, report);
  report.findings = std::move(cleaned.findings);
  for (GapFinding& finding : sampleFindings(samples, table, scene)) report.findings.push_back(std::move(finding));
  control.progress(0.03);

  const GapSearch search(*rows, std::move(*believed));
  control.progress(0.1);
  SelectionOptions selecting;
  const bool has_enough = rows->place_nodes.size() >= kFewestPlacesForCauses;
  selecting.most_effects = has_enough ? options.most_effects : 0;
  const Selection selection = selectEffects(search, selecting, partOf(control, 0.1, 0.7));
  if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "The diagnosis was stopped.");
  control.progress(0.7);
  const LeftOver left = leftBy(search, selection.model.model, *rows);
  const HeldOutGap held_out = holdOut(search, selection, left.structure, partOf(control, 0.7, 0.9));
  if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "The diagnosis was stopped.");
  control.progress(0.9);

  describeWhere(search, selection.model.model, report);
  report.tracker_from_reference = selection.model.model.alignment.tracker_from_reference;
  report.sensor_from_mount = inverse(selection.model.model.alignment.mount_from_sensor);
  report.p_value = search.structureOfNone().p_value;
  report.origin = search.structureOfNone().origin;
  report.candidates = describeCandidates(search, selection, held_out, report.floor_position_mm);
  report.selected = describeSelected(search, selection, held_out, report.candidates, report.floor_position_mm);
  const Evidence evidence = weigh(search, selection, held_out, left, *rows);
  report.verdict = verdictOf(evidence);
  addTraces(left.traces, report);
  addSequence(held_out, report.floor_position_mm, report);
  addRemaining(held_out, evidence, report);
  report.smallest_detectable = smallestDetectable(search, selecting.least_gain_first);
  report.isolability = isolabilityOf(search, kStartsForIsolability, control);
  if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "The diagnosis was stopped.");
  suggestNext(search, selection, report);
  report.text = verdictText(report);
  if (!has_enough) {
    report.text += " Causes are not looked for: " + std::to_string(report.input.places) + " places are too few, " +
                   std::to_string(kFewestPlacesForCauses) + " are needed.";
  }
  selectSignalFindings(report);
  control.progress(1.0);
  return report;
}

Scene updatedScene(const Scene& scene, const GapReport& report) {
  Scene updated = scene;
  updated.reference_from_tracker = inverse(report.tracker_from_reference);
  for (const SelectedEffect& effect : report.selected)
    if (effect.scene_parameters.is_object()) updated.effects.push_back({effect.effect, effect.scene_parameters});
  return updated;
}

namespace {

/// The transmitter one pitch behind the middle of the grid's first face, where no scene says otherwise.
Pose defaultTransmitter(std::span<const PlannedPlace> plan) {
  Eigen::AlignedBox3d box;
  for (const PlannedPlace& place : plan) box.extend(place.reference_from_sensor.position_m);
  Pose reference_from_tracker;
  reference_from_tracker.position_m = box.center();
  reference_from_tracker.position_m.x() = box.min().x() - std::max(0.3, 0.25 * box.sizes().x());
  return reference_from_tracker;
}

/// The rows that a plan would give were nothing wrong, with the noise of the scene's tracker and rig.
Result<GapRows> plannedRows(std::span<const PlannedPlace> plan, const Scene& scene) {
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
    const Eigen::Matrix<double, 6, 9> by_field = poseByField(node.tracker_from_sensor.position_m);
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
  metadata.jig_tolerance_m = scene.rig.tolerance_m > 0.0 ? scene.rig.tolerance_m : 2e-3;
  metadata.jig_tolerance_rad = scene.rig.tolerance_rad > 0.0 ? scene.rig.tolerance_rad : 3.5e-3;
  auto rows = makeGapRows(nodes, metadata);
  if (rows) rows->stated_tracker_from_reference = tracker_from_reference;
  return rows;
}

}  // namespace

Result<Isolability> planCheck(std::span<const PlannedPlace> plan, const Scene* scene, const RunControl& control) {
  Scene believed = scene != nullptr ? *scene : Scene{};
  if (scene == nullptr) believed.reference_from_tracker = defaultTransmitter(plan);
  auto rows = plannedRows(plan, believed);
  if (!rows) return tl::unexpected<Error>(rows.error());
  if (rows->place_nodes.size() < kFewestPlacesForCauses) {
    return fail(ErrorCode::kTooFewNodes, "A plan is checked with at least " + std::to_string(kFewestPlacesForCauses) +
                                             " places; this one has " + std::to_string(rows->place_nodes.size()) + ".");
  }
  auto effects = believedEffects(&believed, rows->excitation);
  if (!effects) return tl::unexpected<Error>(effects.error());
  const GapSearch search(*rows, std::move(*effects), NoiseFrom::kStated);
  Isolability isolability = isolabilityOf(search, 60, control);
  if (control.stop.stop_requested()) return fail(ErrorCode::kCancelled, "The check of the plan was stopped.");
  return isolability;
}

}  // namespace fieldtrue
