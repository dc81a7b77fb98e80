#include "calib/recording/cleaning.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <tuple>

#include "calib/core/quantum.h"
#include "calib/core/statistics.h"
#include "calib/recording/hemisphere.h"
#include "calib/recording/reading_lattice.h"

namespace fieldtrue::recording {

namespace {

/// Readings nearer each other than this are one reading.
constexpr double kSameReading_m = 1e-9;
/// Places nearer each other than this are one place: no jig is set anew so well.
constexpr double kSamePlace_m = 1e-6;
/// Steps of the reading's lattice that two places must be apart for one reading of both to be no chance.
constexpr double kStepsApart = 4.0;
/// Where no noise is stated, finer steps are taken to be harmless.
constexpr double kCoarse_m = 5e-4;
/// Share of a reading's variance above which rounding is felt.
constexpr double kFeltShare = 0.1;
/// One row without an orientation is left out for so many rows in all.
constexpr std::size_t kRowsForOneWithout = 10;

bool isFinite(const Node& node) {
  const auto good = [](const Pose& pose) {
    return pose.position_m.allFinite() && pose.orientation.coeffs().allFinite() &&
           !isMissingMark(pose.position_m.cwiseAbs().maxCoeff());
  };
  return good(node.reference_from_sensor) && good(node.tracker_from_sensor);
}

bool isSameReading(const Node& a, const Node& b) {
  const Pose& p = a.tracker_from_sensor;
  const Pose& q = b.tracker_from_sensor;
  return (p.position_m - q.position_m).norm() < kSameReading_m && angleBetween_rad(p.orientation, q.orientation) < 1e-7;
}

double placesApart_m(const Node& a, const Node& b) {
  return (a.reference_from_sensor.position_m - b.reference_from_sensor.position_m).norm();
}

bool isSameTruth(const Node& a, const Node& b) {
  return placesApart_m(a, b) < kSamePlace_m &&
         angleBetween_rad(a.reference_from_sensor.orientation, b.reference_from_sensor.orientation) < 1e-7;
}

/// Removes the rows that `is_out` marks and adds the finding, unless there is none.
void leaveOut(Cleaned& cleaned, const std::vector<bool>& is_out, const std::string& effect, const std::string& reason) {
  std::vector<int> out;
  std::vector<Node> left;
  for (std::size_t i = 0; i < cleaned.nodes.size(); ++i) {
    if (is_out[i]) {
      out.push_back(cleaned.nodes[i].node);
    } else {
      left.push_back(cleaned.nodes[i]);
    }
  }
  if (out.empty()) return;
  const std::string rows = std::to_string(out.size()) + (out.size() == 1 ? " row " : " rows ");
  cleaned.findings.push_back({effect, rows + reason + " (" + cleaned.names.list(out) + ").", out});
  cleaned.nodes = std::move(left);
}

template <class Predicate>
std::vector<bool> marks(const std::vector<Node>& nodes, Predicate is_marked) {
  std::vector<bool> marked;
  for (const Node& node : nodes) marked.push_back(is_marked(node));
  return marked;
}

/// Rows in the order of one coordinate of a position, so that rows near each other are looked for among neighbours
/// only.
template <class Position>
std::vector<std::size_t> sortedBy(const std::vector<Node>& nodes, Position position) {
  std::vector<std::size_t> order(nodes.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return position(nodes[a]).x() < position(nodes[b]).x(); });
  return order;
}

/// Calls `found(i, j)`, i before j in the table, for pairs of one sensor whose positions differ by at most `near_m`.
template <class Position, class Found>
void forNearPairs(const std::vector<Node>& nodes, double near_m, Position position, Found found) {
  const std::vector<std::size_t> order = sortedBy(nodes, position);
  for (std::size_t a = 0; a < order.size(); ++a) {
    for (std::size_t b = a + 1; b < order.size(); ++b) {
      const Node& one = nodes[order[a]];
      const Node& other = nodes[order[b]];
      if (position(other).x() - position(one).x() > near_m) break;
      if (one.sensor != other.sensor || (position(one) - position(other)).norm() > near_m) continue;
      found(std::min(order[a], order[b]), std::max(order[a], order[b]));
    }
  }
}

Eigen::Vector3d trackedPosition_m(const Node& node) { return node.tracker_from_sensor.position_m; }
Eigen::Vector3d truePosition_m(const Node& node) { return node.reference_from_sensor.position_m; }

void leaveOutCopies(Cleaned& cleaned) {
  std::vector<bool> is_copy(cleaned.nodes.size(), false);
  forNearPairs(cleaned.nodes, kSameReading_m, trackedPosition_m, [&](std::size_t i, std::size_t j) {
    if (isSameReading(cleaned.nodes[i], cleaned.nodes[j]) && isSameTruth(cleaned.nodes[i], cleaned.nodes[j])) {
      is_copy[j] = true;
    }
  });
  leaveOut(cleaned, is_copy, "",
           "repeat an earlier row, its place and its reading alike, and were left out so as not to count twice");
}

/// The coarsest step of which the readings are multiples; two places may share a reading by chance only within it.
double readingStep_m(const CalibrationTable& table) {
  std::vector<double> values_m;
  for (const Node& node : table.nodes) {
    for (int axis = 0; axis < 3; ++axis) values_m.push_back(node.tracker_from_sensor.position_m[axis]);
  }
  return std::max({table.metadata.quantum_m.value_or(0.0), findQuantum_m(values_m).value_or(0.0),
                   values_m.empty() ? 0.0 : printedStep_m(values_m)});
}

/// Of the rows that share a reading, the one whose place the others' distances fit best is believed.
std::size_t believedRow(const std::vector<Node>& nodes, const std::vector<std::size_t>& group) {
  std::size_t best = group.front();
  double least_m = -1.0;
  for (const std::size_t i : group) {
    std::vector<double> misfits_m;
    for (std::size_t j = 0; j < nodes.size(); ++j) {
      if (std::find(group.begin(), group.end(), j) != group.end() || nodes[j].sensor != nodes[i].sensor) continue;
      const double tracked_m = (trackedPosition_m(nodes[i]) - trackedPosition_m(nodes[j])).norm();
      misfits_m.push_back(std::abs(tracked_m - placesApart_m(nodes[i], nodes[j])));
    }
    if (misfits_m.empty()) return best;
    const double misfit_m = median(std::move(misfits_m));
    if (least_m < 0.0 || misfit_m < least_m) {
      least_m = misfit_m;
      best = i;
    }
  }
  return best;
}

void leaveOutStuck(Cleaned& cleaned, double step_m) {
  const std::vector<Node>& nodes = cleaned.nodes;
  const double apart_m = std::max(kStepsApart * step_m, kSamePlace_m);
  std::vector<std::size_t> first(nodes.size());
  for (std::size_t i = 0; i < first.size(); ++i) first[i] = i;
  forNearPairs(nodes, kSameReading_m, trackedPosition_m, [&](std::size_t i, std::size_t j) {
    if (!isSameReading(nodes[i], nodes[j]) || placesApart_m(nodes[i], nodes[j]) <= apart_m) return;
    first[j] = std::min(first[j], first[i]);
  });
  std::map<std::size_t, std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < first.size(); ++i) groups[first[first[i]]].push_back(i);
  std::vector<bool> is_stuck(nodes.size(), false);
  for (const auto& [root, group] : groups) {
    if (group.size() < 2) continue;
    const std::size_t believed = believedRow(nodes, group);
    for (const std::size_t i : group) is_stuck[i] = i != believed;
  }
  leaveOut(cleaned, is_stuck, "",
           "hold the reading of another place, as when the tracker or its line stands still, and were left out");
}

void nameSharedPlaces(Cleaned& cleaned) {
  std::set<int> shared;
  forNearPairs(cleaned.nodes, kSamePlace_m, truePosition_m, [&](std::size_t i, std::size_t j) {
    if (cleaned.nodes[i].node == cleaned.nodes[j].node) return;
    shared.insert({cleaned.nodes[i].node, cleaned.nodes[j].node});
  });
  if (shared.empty()) return;
  const std::vector<int> nodes(shared.begin(), shared.end());
  cleaned.findings.push_back({"",
                              "Places of different numbers have the same true position (" + cleaned.names.list(nodes) +
                                  "): visits of one place carry one number, or the jig's position was noted wrongly.",
                              nodes});
}

void mirrorBack(Cleaned& cleaned) {
  const std::vector<bool> is_mirrored = mirroredRows(cleaned.nodes);
  std::vector<int> mirrored;
  for (std::size_t i = 0; i < cleaned.nodes.size(); ++i) {
    if (!is_mirrored[i]) continue;
    cleaned.nodes[i].tracker_from_sensor.position_m *= -1.0;
    mirrored.push_back(cleaned.nodes[i].node);
  }
  if (mirrored.empty()) return;
  const std::string rows = std::to_string(mirrored.size()) + (mirrored.size() == 1 ? " row is" : " rows are");
  cleaned.findings.push_back({"hemisphere_flip",
                              rows + " reported on the far side of the transmitter, at -p instead of p (" +
                                  cleaned.names.list(mirrored) +
                                  "), and were mirrored back; set the tracker's hemisphere before recording.",
                              mirrored});
}

/// A lattice matters in rows of few readings, whose means lie on it.
void nameLattice(const TableMetadata& metadata, Cleaned& cleaned) {
  const std::optional<double> quantum_m = latticeOfRows_m(cleaned.nodes);
  if (!quantum_m || *quantum_m < 1.2 * metadata.quantum_m.value_or(0.0)) return;
  std::vector<double> variances_m2;
  for (const Node& node : cleaned.nodes) {
    if (node.covariance_m2) variances_m2.push_back(node.covariance_m2->trace() / 3.0);
  }
  const double rounding_m2 = *quantum_m * *quantum_m / 12.0;
  const bool is_felt =
      variances_m2.empty() ? *quantum_m >= kCoarse_m : rounding_m2 > kFeltShare * median(std::move(variances_m2));
  if (!is_felt) return;
  char text[160];
  std::snprintf(text, sizeof text,
                "Positions are reported in steps of %.3g mm and hardly averaged: rounding alone is %.2g mm SD.",
                1e3 * *quantum_m, 1e3 * std::sqrt(rounding_m2));
  cleaned.findings.push_back({"quantization", text, {}});
}

/// Rows as they were recorded, so that what is found does not depend on how a file has them in order.
void putInOrder(std::vector<Node>& nodes) {
  const bool has_times =
      std::all_of(nodes.begin(), nodes.end(), [](const Node& node) { return node.t_start_s.has_value(); });
  const auto key = [has_times](const Node& node) {
    return std::tuple(has_times ? *node.t_start_s : 0.0, node.node, node.visit, node.sensor);
  };
  std::stable_sort(nodes.begin(), nodes.end(), [&](const Node& a, const Node& b) { return key(a) < key(b); });
}

/// Few rows without an orientation are left out, for the orientations of all others would be in vain.
void settleOrientations(Cleaned& cleaned) {
  const std::vector<bool> is_without = marks(cleaned.nodes, [](const Node& node) { return !node.has_orientation; });
  const auto n_without = static_cast<std::size_t>(std::count(is_without.begin(), is_without.end(), true));
  if (n_without == 0 || n_without == cleaned.nodes.size()) return;
  if (kRowsForOneWithout * n_without <= cleaned.nodes.size())
    return leaveOut(cleaned, is_without, "", "without an orientation left out, so that those of the others count");
  cleaned.findings.push_back({"",
                              std::to_string(n_without) + " of " + std::to_string(cleaned.nodes.size()) +
                                  " rows have no orientation, so that no orientation is used.",
                              {}});
}

}  // namespace

Cleaned cleanRows(const CalibrationTable& table) {
  Cleaned cleaned;
  cleaned.nodes = table.nodes;
  putInOrder(cleaned.nodes);
  cleaned.names = PlaceNames(table.nodes);
  leaveOut(cleaned, marks(cleaned.nodes, [](const Node& node) { return node.role == NodeRole::kSkipped; }), "",
           "marked as skipped were left out");
  leaveOut(cleaned, marks(cleaned.nodes, [](const Node& node) { return !isFinite(node); }), "",
           "hold no usable number and were left out");
  settleOrientations(cleaned);
  leaveOutCopies(cleaned);
  leaveOutStuck(cleaned, readingStep_m(table));
  nameSharedPlaces(cleaned);
  mirrorBack(cleaned);
  nameLattice(table.metadata, cleaned);
  return cleaned;
}

}  // namespace fieldtrue::recording
