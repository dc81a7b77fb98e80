#include "calib/gap/findings.h"

#include <algorithm>
#include <cmath>

#include "calib/core/units.h"
#include "calib/gap/verdict.h"
#include "calib/identify/search.h"
#include "calib/identify/traces.h"
#include "calib/tables/table_sensors.h"

namespace fieldtrue::gap {
namespace {

constexpr std::size_t kMostNamed = 10;  ///< Places of a list.

/// What is left beside the named effects and varies smoothly, where it is worth telling.
void addRest(const Judgement& judgement, const identify::Thresholds& thresholds, GapReport& report) {
  const double start_m2 = judgement.far.excess_m2.front().value;
  constexpr double kTold_m2 = 1e-10;  // 0.01 mm: less reads as nothing.
  if (judgement.selection.ways.empty() || !(judgement.rest_m2 > std::max(kTold_m2, thresholds.told_rest * start_m2)))
    return;
  report.findings.push_back({"",
                             "Beside what is named, " + shown(signedRoot_mm(judgement.rest_m2)) +
                                 " mm vary smoothly from place to place and have no name.",
                             {}});
}

void addTraces(const std::vector<identify::Trace>& traces, const identify::Thresholds& thresholds, GapReport& report) {
  for (const identify::Trace& trace : traces)
    if (trace.p_value < thresholds.sure_trace)
      report.findings.push_back({"", "What no known effect explains looks as if " + trace.text + ".", {}});
}

void addOnce(int node, std::vector<int>& nodes) {
  if (std::find(nodes.begin(), nodes.end(), node) == nodes.end()) nodes.push_back(node);
}

/// Each flagged place once, the one that stands out most first.
std::vector<int> flaggedPlaces(const GapReport& report) {
  std::vector<const GapNode*> flagged;
  for (const GapNode& node : report.nodes)
    if (node.is_flagged) flagged.push_back(&node);
  std::stable_sort(flagged.begin(), flagged.end(),
                   [](const GapNode* a, const GapNode* b) { return a->excess > b->excess; });
  std::vector<int> nodes;
  for (const GapNode* node : flagged) addOnce(node->node, nodes);
  return nodes;
}

/// Whether what is largest there is of that place: it falls to half nearer than its middle is wide or uncertain.
bool isLocal(const Hotspot& hotspot) {
  return hotspot.half_m && hotspot.sd_m && std::max(hotspot.radius_m, *hotspot.sd_m) < *hotspot.half_m;
}

/// What has no name is at least placed: where it is largest, and which places stand out.
void addMisfits(bool has_gap, const identify::GapRows& rows, GapReport& report) {
  if (!has_gap || !report.selected.empty()) return;
  const std::vector<int> nodes = flaggedPlaces(report);
  if (nodes.empty()) return;
  const bool are_few = nodes.size() * 3 < rows.place_nodes.size();
  std::string text = nodes.size() == 1 ? "One place does not fit the others: "
                     : are_few         ? "Places that do not fit the others: "
                               : std::to_string(nodes.size()) + " of " + std::to_string(rows.place_nodes.size()) +
                                     " places lie off, most of all ";
  text += report.names.listInOrder(nodes, kMostNamed) + ".";
  if (report.hotspot && !rows.has_dipoles && (are_few || isLocal(*report.hotspot))) {
    const Eigen::Vector3d& at = report.hotspot->center_m;
    text += " Something local acts within " + shown(report.hotspot->radius_m) + " m of (" + shown(at.x()) + ", " +
            shown(at.y()) + ", " + shown(at.z()) + ") m";
    if (report.hotspot->sd_m) text += " (+- " + shown(*report.hotspot->sd_m) + " m)";
    text += report.hotspot->half_m ? "; half of it is gone " + shown(*report.hotspot->half_m) + " m from there."
                                   : "; within these places it does not fall to half.";
  }
  report.findings.push_back({"", text, nodes});
}

/// Mean variance of the rows' samples alone, an axis [m^2].
double ownVariance_m2(const identify::GapRows& rows) {
  double sum = 0.0;
  for (const identify::GapRow& row : rows.rows) sum += row.mean_covariance_m2.trace() / 3.0;
  return sum / static_cast<double>(rows.rows.size());
}

/// A tolerance that is stated too large is a finding where the readings of the places, samples and placing together,
/// scatter clearly less than it alone would make them.
void addStatedTooLarge(const identify::GapSearch& search, const identify::GapRows& stated, GapReport& report) {
  const double said_m = stated.placing_sd_m.value_or(0.0), seen_m = search.placingSd_m();
  const double own_m = std::sqrt(ownVariance_m2(stated));
  const double factor = search.thresholds().stated_too_small * search.thresholds().told_tolerance;
  if (std::hypot(said_m, own_m) < factor * std::hypot(seen_m, own_m)) return;
  report.findings.push_back({"",
                             "The places are more exact than stated: " + shown(1e3 * seen_m) + " mm instead of " +
                                 shown(1e3 * said_m) +
                                 " mm (SD per axis). State what the jig keeps: a fit trusts the readings by it.",
                             {}});
}

/// Beside what is named, single places that lie farther off than it and noise put them.
void addStrays(const HowFar& far, const identify::GapRows& rows, GapReport& report) {
  if (report.selected.empty() || far.strays.empty()) return;
  std::vector<std::size_t> strays = far.strays;
  std::stable_sort(strays.begin(), strays.end(),
                   [&](std::size_t a, std::size_t b) { return far.size_m[a] > far.size_m[b]; });
  std::vector<int> nodes;
  for (const std::size_t i : strays) addOnce(rows.rows[i].node, nodes);
  report.findings.push_back({"",
                             (nodes.size() == 1 ? "Beside what is named, one place does not fit the others: "
                                                : "Beside what is named, places do not fit the others: ") +
                                 report.names.listInOrder(nodes, kMostNamed) + ".",
                             nodes});
}

/// What the physics of the tracker is taken to be is said where it matters.
void addAssumption(const TableMetadata& metadata, GapReport& report) {
  const std::string model = metadata.transmitter_model.value_or("");
  if (model == "dipole") return;
  const std::string text = model.empty()
                               ? "The table states no transmitter_model: a transmitter of dipoles is assumed."
                               : "The transmitter is no dipole (transmitter_model: " + model +
                                     "): only errors of the rig are named; metal and coils would need its own physics.";
  report.findings.push_back({"", text, {}});
}

/// A tolerance that is stated too small is a finding: what scatters so is no gap.
void addStatedTooSmall(const identify::GapSearch& search, const identify::GapRows& stated, GapReport& report) {
  const identify::Thresholds& thresholds = search.thresholds();
  const auto tell = [&](double seen, double said, double most, const std::string& unit) {
    if (!(said > 0.0) || seen < thresholds.told_tolerance * said || seen > most) return;
    report.findings.push_back({"",
                               "The places are less exact than stated: " + shown(seen) + " " + unit + " instead of " +
                                   shown(said) + " " + unit + " (SD per axis). That is no gap.",
                               {}});
  };
  tell(1e3 * search.placingSd_m(), 1e3 * stated.placing_sd_m.value_or(0.0),
       1e3 * identify::worstPlacing_m(stated, thresholds), "mm");
  if (stated.has_orientation)
    tell(kDegPerRad * search.placingSd_rad(), kDegPerRad * stated.placing_sd_rad.value_or(0.0),
         kDegPerRad * identify::worstPlacing_rad(stated, thresholds), "degrees");
}

/// What scatters from place to place beyond what can be placing is told.
void addBoundOfFloor(const identify::GapSearch& search, const identify::GapRows& stated, GapReport& report) {
  const auto tell = [&](double seen, double bound, const std::optional<double>& said, const std::string& unit,
                        const std::string& by_hand, const std::string& remedy) {
    if (!(seen > 1.001 * bound)) return;
    const std::string why =
        said
            ? "The tolerance that is stated is " + shown(*said) + " " + unit +
                  ", and may be too small by a factor of " + shown(search.thresholds().stated_too_small) +
                  ": the floor is held at " + shown(bound) + " " + unit +
                  ", and what is above it counts as gap. Set the jig anew at ten places: where the readings come back, "
                  "something shifts single places; where they do not, state what the jig really keeps."
            : "No tolerance is stated, and a person with a jig stays within " + shown(bound) + " " + unit + " (" +
                  by_hand + "): the floor is held there, and what is above it counts as gap. " + remedy;
    report.findings.push_back(
        {"",
         "The places scatter by " + shown(seen) + " " + unit + " (SD per axis) about any smooth field. " + why,
         {}});
  };
  const auto times = [](double factor, const std::optional<double>& value) {
    return value ? std::optional(factor * *value) : std::nullopt;
  };
  tell(1e3 * search.placingSd_m(), 1e3 * search.floorPlacingSd_m(), times(1e3, stated.placing_sd_m), "mm",
       "a foot set on its mark within a finger's breadth",
       "Are true and tracked positions of the same places and of one sensor? Else state jig_tolerance_m.");
  tell(kDegPerRad * search.placingSd_rad(), kDegPerRad * search.floorPlacingSd_rad(),
       times(kDegPerRad, stated.placing_sd_rad), "degrees", "turned and held upright by eye within ten degrees",
       "Are the true orientations those of the places, and all rows of one sensor? Else state jig_tolerance_rad, or "
       "leave the columns of the orientation out.");
}

void addMirrored(const std::vector<int>& mirrored, std::size_t n_sensors, GapReport& report) {
  report.findings.push_back({"",
                             "True and tracked positions " +
                                 (n_sensors > 1 ? "of " + sensorsText(mirrored) + " " : std::string()) +
                                 "are mirror images: an axis has the wrong sign, or two are exchanged. Put that right "
                                 "first; causes are not looked for.",
                             {}});
}

void addAstray(double share, GapReport& report) {
  report.findings.push_back(
      {"",
       "True and tracked positions do not belong together: after the best alignment half of the readings "
       "still lie off by " +
           shown(100.0 * share) +
           " % of the places' own spread or more. Are the rows of one recording, in one order, and "
           "of one rig? Put that right first; causes are not looked for.",
       {}});
}

}  // namespace

bool addInputFindings(const TableMetadata& metadata, const identify::GapSearch& search, GapReport& report) {
  addAssumption(metadata, report);
  const double astray = search.shareAstray();
  const identify::GapRows& rows = search.physics().rows();
  const std::vector<int> mirrored = identify::mirroredSensors(rows, search.thresholds());
  if (!mirrored.empty()) {
    addMirrored(mirrored, rows.sensors.size(), report);
  } else if (astray > search.thresholds().astray) {
    addAstray(astray, report);
  }
  return search.belongTogether();
}

void addFindings(const identify::GapSearch& search, const identify::GapRows& stated, const Judgement& judgement,
                 bool has_gap, GapReport& report) {
  if (has_gap && stated.has_dipoles) addTraces(judgement.left.traces, search.thresholds(), report);
  addRest(judgement, search.thresholds(), report);
  addMisfits(has_gap, stated, report);
  addStrays(judgement.far, stated, report);
  addStatedTooSmall(search, stated, report);
  addStatedTooLarge(search, stated, report);
  addBoundOfFloor(search, stated, report);
}

}  // namespace fieldtrue::gap
