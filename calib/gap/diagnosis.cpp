#include "calib/gap/diagnosis.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/core/file_io.h"
#include "calib/core/statistics.h"
#include "calib/core/units.h"
#include "calib/effects/registry.h"
#include "calib/field/tracker_model.h"
#include "calib/gap/candidates.h"
#include "calib/gap/change.h"
#include "calib/gap/findings.h"
#include "calib/gap/isolability.h"
#include "calib/gap/judgement.h"
#include "calib/gap/next_measurement.h"
#include "calib/gap/replicates.h"
#include "calib/gap/source_shape.h"
#include "calib/gap/verdict.h"
#include "calib/identify/sample_findings.h"
#include "calib/identify/selection.h"
#include "calib/recording/cleaning.h"
#include "calib/recording/finding.h"
#include "calib/recording/own_samples.h"
#include "calib/tables/table_sensors.h"

namespace fieldtrue::gap {
namespace {

constexpr std::size_t kStartsForIsolability = 24;

Result<std::vector<std::unique_ptr<field::PhysicalEffect>>> believedEffects(const simulation::Scene* scene,
                                                                            const field::Excitation& excitation) {
  if (scene == nullptr) return std::vector<std::unique_ptr<field::PhysicalEffect>>();
  return simulation::makeEffects(scene->effects, excitation);
}

void takeFromScene(const simulation::Scene* scene, const TableMetadata& metadata, identify::GapRows& rows) {
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

/// What stands above the floor after each step, in mm or degrees.
struct Step {
  std::optional<double> excess, low90, high90;
};

/// @param unit what one metre, or one radian, is
std::vector<Step> stepsOf(const std::vector<Bounded>& excess, double unit) {
  const auto root = [unit](double square) { return unit * std::copysign(std::sqrt(std::abs(square)), square); };
  std::vector<Step> steps;
  for (const Bounded& one : excess) {
    Step step{root(one.value), {}, {}};
    if (one.low90) step.low90 = root(*one.low90);
    if (one.high90) step.high90 = root(*one.high90);
    steps.push_back(step);
  }
  return steps;
}

/// What is left in the end has one interval, that of the verdict.
void boundAsRemaining(const HowFar& far, const std::vector<Bounded>& excess, double unit, std::vector<Step>& steps) {
  const Bounded left = far.remaining();
  const double start = excess.front().value;
  if (steps.size() < 2 || !left.low90 || !left.high90 || !(start > 0.0)) return;
  const std::vector<Step> ends = stepsOf({{*left.low90 * start, {}, {}}, {*left.high90 * start, {}, {}}}, unit);
  steps.back().low90 = ends.front().excess;
  steps.back().high90 = ends.back().excess;
}

void addSequence(const HowFar& far, bool has_orientation, GapReport& report) {
  constexpr double kMillimetres = 1e3;
  std::vector<Step> in_mm = stepsOf(far.excess_m2, kMillimetres);
  std::vector<Step> in_deg = stepsOf(far.excess_rad2, kDegPerRad);
  if (far.by_rotation) {
    boundAsRemaining(far, far.excess_rad2, kDegPerRad, in_deg);
  } else {
    boundAsRemaining(far, far.excess_m2, kMillimetres, in_mm);
  }
  for (std::size_t s = 0; s < in_mm.size(); ++s) {
    GapStep step{s == 0 ? "" : report.selected[s - 1].effect, *in_mm[s].excess, in_mm[s].low90, in_mm[s].high90};
    if (has_orientation) {
      step.excess_deg = in_deg[s].excess;
      step.low90_deg = in_deg[s].low90;
      step.high90_deg = in_deg[s].high90;
    }
    report.sequence.push_back(std::move(step));
  }
}

Remaining remainingOf(const HowFar& far, const identify::GapRows& rows, const identify::Thresholds& thresholds) {
  Remaining remaining;
  remaining.fraction = far.remaining().value;
  remaining.low90 = far.remaining().low90;
  remaining.high90 = far.remaining().high90;
  remaining.is_of_rotation = far.by_rotation;
  remaining.excess2_before_mm2 = 1e6 * far.excess_m2.front().value;
  remaining.excess2_after_mm2 = 1e6 * far.excess_m2.back().value;
  remaining.position_rms_mm = 1e3 * std::sqrt(far.excess_m2.back().value + far.floor_m2);
  std::vector<std::pair<double, int>> worst;
  for (std::size_t i = 0; i < rows.rows.size(); ++i) worst.emplace_back(far.size_m[i], rows.rows[i].node);
  remaining.p50_mm = 1e3 * quantile(far.size_m, 0.5);
  remaining.p90_mm = 1e3 * quantile(far.size_m, 0.9);
  remaining.p95_mm = 1e3 * quantile(far.size_m, 0.95);
  std::sort(worst.rbegin(), worst.rend());
  remaining.worst_mm = 1e3 * worst.front().first;
  remaining.worst_node = worst.front().second;
  constexpr std::size_t kMostNamed = 10;
  for (const auto& [size_m, node] : worst) {
    if (size_m < thresholds.told_place * std::sqrt(far.floor_m2) || remaining.where.size() >= kMostNamed) break;
    if (std::find(remaining.where.begin(), remaining.where.end(), node) == remaining.where.end())
      remaining.where.push_back(node);
  }
  return remaining;
}

RivalReport rivalOf(const Judgement& judgement) {
  RivalReport rival;
  rival.nats_over_unnamed = judgement.nats_over_unnamed;
  rival.unnamed_nats = judgement.unnamed_nats;
  rival.unseen_gain = judgement.unseen_gain.value;
  rival.unseen_gain_low90 = judgement.unseen_gain.low90;
  rival.named_share = judgement.named_share;
  rival.refused = judgement.refused;
  rival.why = whyRefused(judgement);
  return rival;
}

/// Effects that single readings show stand beside those that the poses show.
void selectSignalFindings(GapReport& report) {
  constexpr double kNotTold = std::numeric_limits<double>::quiet_NaN();  // The means do not show it.
  for (const recording::GapFinding& finding : report.findings) {
    if (finding.effect.empty()) continue;
    const auto is_same = [&](const SelectedEffect& e) { return e.effect == finding.effect; };
    if (std::any_of(report.selected.begin(), report.selected.end(), is_same)) continue;
    SelectedEffect effect;
    effect.effect = finding.effect;
    effect.equivalents = {finding.effect};
    effect.probability = 1.0;
    effect.shrinkage = {kNotTold, kNotTold, kNotTold, {}, {}};
    effect.credit_fraction = effect.excess2_before_mm2 = effect.excess2_after_mm2 = kNotTold;
    report.selected.push_back(std::move(effect));
  }
}

/// What single readings show of each sensor, said of which where there are several.
void addSignalFindings(const CalibrationTable& table, const SampleTable* samples, const simulation::Scene* scene,
                       const recording::LineRules& lines, recording::Cleaned& cleaned) {
  const std::vector<int> sensors = sensorsOf(cleaned.nodes);
  for (const int sensor : sensors) {
    const auto own = rowsOfSensor(table, sensor);
    std::optional<SampleTable> own_samples;
    if (samples != nullptr) own_samples = rowsOfSensor(*samples, sensor);
    for (auto& found :
         identify::sampleFindings(own_samples ? &*own_samples : nullptr, own ? *own : table, scene, lines)) {
      if (sensors.size() > 1) found.text = "Sensor " + std::to_string(sensor) + ": " + found.text;
      cleaned.findings.push_back(std::move(found));
    }
  }
}

void describeInput(const identify::GapRows& rows, const SampleTable* samples, GapReport& report) {
  report.input.places = static_cast<int>(rows.place_nodes.size());
  report.input.rows = static_cast<int>(rows.rows.size());
  if (samples != nullptr) {
    report.input.samples = static_cast<int>(
        std::count_if(samples->rows.begin(), samples->rows.end(), [](const SampleRow& row) { return row.node >= 0; }));
  }
  report.input.orientations = rows.n_orientations;
  report.input.position_only = !rows.has_orientation;
}

/// A part of the whole's progress.
RunControl partOf(const RunControl& control, double from, double to) {
  RunControl part = control;
  part.progress = [progress = control.progress, from, to](double fraction) { progress(from + (to - from) * fraction); };
  return part;
}

void describeAlignment(const identify::GapAlignment& alignment, const identify::GapRows& rows, GapReport& report) {
  report.tracker_from_reference = alignment.tracker_from_reference;
  report.sensor_from_mount = inverse(alignment.mount_from_sensor.front());
  for (std::size_t s = 0; s < rows.sensors.size(); ++s)
    report.sensors_from_mounts[rows.sensors[s]] = inverse(alignment.mount_from_sensor[s]);
}

/// Everything that follows from what was judged.
/// @param known_gap whether there is a gap, where that is known already
/// @param belongs_together whether the rows are of one set-up; else nothing is told of what they leave, it means
/// nothing
void describeJudgement(const identify::GapSearch& search, const Judgement& judgement, std::optional<bool> known_gap,
                       bool belongs_together, const RunControl& control, GapReport& report) {
  const identify::GapRows& rows = search.physics().rows();
  const bool has_gap = decide(search, judgement, known_gap, report);
  describeAlignment(judgement.selection.model.model.alignment, rows, report);
  report.p_value = search.structureOfNone().p_value;
  report.origin = search.structureOfNone().origin;
  report.selected = describeSelected(search, judgement, report.candidates, control);
  report.rival = rivalOf(judgement);
  if (report.not_looked_for.empty() && report.candidates.size() > 1 && report.candidates[1].probability > 0.0)
    report.odds_over_next = report.candidates[0].probability / report.candidates[1].probability;
  if (belongs_together) addFindings(search, rows, judgement, has_gap, report);
  if (belongs_together && has_gap && rows.has_dipoles) report.source_shape = sourceShapeOf(search, judgement.selection);
  if (report.source_shape && report.source_shape->shape != Shape::kUnclear)
    report.findings.push_back({"", sourceShapeText(*report.source_shape), {}});
  addSequence(judgement.far, rows.has_orientation, report);
  report.remaining = remainingOf(judgement.far, rows, search.thresholds());
}

/// Makes the recording again and again under what was found.
void addReplicates(const identify::GapSearch& search, const Judgement& judgement, const simulation::Scene* scene,
                   const DiagnosisOptions& options, int most_effects, const RunControl& control, GapReport& report) {
  ReplicateOptions replicating;
  replicating.wanted = options.replicates;
  replicating.seed = options.seed;
  replicating.most_effects = most_effects;
  const field::Excitation& excitation = search.physics().rows().excitation;
  const auto believedAgain = [&] { return believedEffects(scene, excitation).value(); };
  report.replicates = replicate(search, judgement, report.candidates, believedAgain, replicating, control);
}

/// @param known_gap whether there is a gap, where that is known already; causes are looked for only if it may be
Result<GapReport> diagnoseRows(recording::Cleaned cleaned, const TableMetadata& metadata, const SampleTable* samples,
                               const simulation::Scene* scene, const DiagnosisOptions& options,
                               std::optional<bool> known_gap, const RunControl& control) {
  const auto stopped = [&] { return fail(ErrorCode::kCancelled, "The diagnosis was stopped."); };
  GapReport report;
  FT_TRY(auto rows, identify::makeGapRows(cleaned.nodes, metadata, options.thresholds));
  takeFromScene(scene, metadata, rows);
  FT_TRY(auto believed, believedEffects(scene, rows.excitation));
  report.names = std::move(cleaned.names);
  describeInput(rows, samples, report);
  report.findings = std::move(cleaned.findings);
  control.progress(0.01);

  const identify::GapSearch search(rows, std::move(believed), identify::NoiseFrom::kResiduals, options.thresholds,
                                   control);
  const bool belongs_together = addInputFindings(metadata, search, report);
  identify::EffectSelectionOptions selecting;
  const std::size_t fewest = options.thresholds.fewest_places_for_causes;
  const bool has_enough = rows.place_nodes.size() >= fewest;
  selecting.most_effects = has_enough && belongs_together && known_gap.value_or(true) ? options.most_effects : 0;
  if (!has_enough)
    report.not_looked_for =
        std::to_string(report.input.places) + " places are too few, " + std::to_string(fewest) + " are needed";
  if (!belongs_together) report.not_looked_for = "the readings do not belong to their places as the table states them";
  const double part = options.replicates > 0 ? 0.1 : 1.0;  // Of the progress, without replicates.
  const identify::EffectSelection selection =
      identify::selectEffects(search, selecting, partOf(control, 0.1 * part, 0.7 * part));
  if (control.stop.stop_requested()) return stopped();
  control.progress(0.7 * part);
  const Judgement judgement = judge(search, selection, partOf(control, 0.7 * part, 0.9 * part));
  if (control.stop.stop_requested()) return stopped();
  control.progress(0.9 * part);

  describeJudgement(search, judgement, known_gap, belongs_together, control, report);
  report.smallest_detectable = smallestDetectable(search);
  report.isolability = isolabilityOf(search, kStartsForIsolability, Imitators::kOfCoarseGrid, control);
  if (control.stop.stop_requested()) return stopped();
  if (belongs_together) {
    suggestNext(search, judgement.selection, report);
  } else {
    report.next_measurement = "Nothing needs to be measured: put the table right, and diagnose it again.";
  }
  report.text = verdictText(report, known_gap ? "change" : "gap");
  selectSignalFindings(report);
  if (options.replicates > 0) {
    addReplicates(search, judgement, scene, options, selecting.most_effects, partOf(control, part, 1.0), report);
    if (control.stop.stop_requested()) return stopped();
  }
  control.progress(1.0);
  return report;
}

/// What changed since an earlier recording: nothing, or the change diagnosed as a gap is.
Result<GapReport> diagnoseChange(const CalibrationTable& table, const simulation::Scene* scene,
                                 const DiagnosisOptions& options, const RunControl& control) {
  FT_TRY(auto change, changeSince(*options.against, table, options.thresholds, control));
  std::optional<simulation::Scene> tracker;  // What was wrong then is believed already.
  if (scene != nullptr) {
    tracker = *scene;
    tracker->effects.clear();
  }
  // Whether what is astray is a change, its diagnosis decides.
  const auto known = change.isAstray() ? std::nullopt : std::optional(change.changed);
  FT_TRY(auto report, diagnoseRows(std::move(change.rows), change.metadata, nullptr, tracker ? &*tracker : nullptr,
                                   options, known, partOf(control, 0.2, 1.0)));
  describeChange(change, options.thresholds, report);
  return report;
}

}  // namespace

Result<GapReport> diagnose(const CalibrationTable& table, const SampleTable* samples, const simulation::Scene* scene,
                           const DiagnosisOptions& options, const RunControl& control) {
  if (options.against != nullptr) return diagnoseChange(table, scene, options, control);
  recording::Cleaned cleaned = recording::cleanRows(table);
  if (samples != nullptr) {
    FT_TRY(auto foreign, recording::foreignSamples(*samples, table));
    if (foreign) cleaned.findings.push_back(*std::move(foreign));
  }
  addSignalFindings(table, samples, scene, options.thresholds.lines, cleaned);
  return diagnoseRows(std::move(cleaned), table.metadata, samples, scene, options, {}, control);
}

simulation::Scene updatedScene(const simulation::Scene& scene, const TableMetadata& recording,
                               const GapReport& report) {
  simulation::Scene updated = scene;
  constexpr double kMostOfScene = 1.0;  // Metre or radian.
  const auto takeOver = [](std::optional<double> stated, double& tolerance) {
    if (stated && *stated <= kMostOfScene) tolerance = *stated;
  };
  takeOver(recording.jig_tolerance_m, updated.rig.tolerance_m);
  takeOver(recording.jig_tolerance_rad, updated.rig.tolerance_rad);
  updated.reference_from_tracker = inverse(report.tracker_from_reference);
  updated.mount_from_sensor = inverse(report.sensor_from_mount);
  for (const SelectedEffect& effect : report.selected)
    if (effect.scene_parameters.is_object()) updated.effects.push_back({effect.effect, effect.scene_parameters});
  return updated;
}

}  // namespace fieldtrue::gap
