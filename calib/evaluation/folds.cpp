#include "calib/evaluation/folds.h"

#include <algorithm>
#include <charconv>
#include <iterator>
#include <map>
#include <set>

#include "calib/calibration/coincident_places.h"
#include "calib/evaluation/base/index_source.h"
#include "calib/tables/true_box.h"

namespace fieldtrue::evaluation {
namespace {

constexpr int kOctants = 8;

/// Group of each place -> folds: the rows of one group are scored by a fit on all others. Empty groups give no fold.
std::vector<Fold> foldsOfGroups(std::span<const Node> nodes, const std::map<int, std::size_t>& group_of_place,
                                std::size_t n_groups) {
  std::vector<Fold> folds(n_groups);
  for (std::size_t row = 0; row < nodes.size(); ++row) {
    const std::size_t group = group_of_place.at(nodes[row].node);
    for (std::size_t k = 0; k < n_groups; ++k) (k == group ? folds[k].scored : folds[k].fitted).push_back(row);
  }
  std::erase_if(folds, [](const Fold& fold) { return fold.scored.empty(); });
  return folds;
}

std::map<int, std::size_t> shuffledGroups(std::vector<int> places, std::size_t n_groups, std::uint64_t seed) {
  IndexSource source(seed);
  for (std::size_t i = places.size(); i > 1; --i) std::swap(places[i - 1], places[source.below(i)]);
  std::map<int, std::size_t> groups;
  for (std::size_t i = 0; i < places.size(); ++i) groups[places[i]] = i % n_groups;
  return groups;
}

/// Octants about the middle of the box of true positions; of each place its first row.
std::map<int, std::size_t> octantGroups(std::span<const Node> nodes) {
  const Eigen::Vector3d middle_m = trueBox_m(nodes).center();
  std::map<int, std::size_t> groups;
  for (const Node& node : nodes) {
    const Eigen::Vector3d offset_m = node.reference_from_sensor.position_m - middle_m;
    const std::size_t octant =
        (offset_m.x() > 0.0 ? 1U : 0U) + (offset_m.y() > 0.0 ? 2U : 0U) + (offset_m.z() > 0.0 ? 4U : 0U);
    groups.try_emplace(node.node, octant);
  }
  return groups;
}

Result<std::vector<Fold>> roleFold(std::span<const Node> nodes) {
  std::set<int> validation_places;
  for (const Node& node : nodes)
    if (node.role == NodeRole::kValidation) validation_places.insert(node.node);
  Fold fold;
  for (std::size_t row = 0; row < nodes.size(); ++row) {
    if (nodes[row].role == NodeRole::kValidation) fold.scored.push_back(row);
    if (nodes[row].role == NodeRole::kFit && !validation_places.contains(nodes[row].node)) fold.fitted.push_back(row);
  }
  if (fold.scored.empty())
    return fail(
        ErrorCode::kBadInput,
        "Validation by role needs rows with role 'validation', and this table has none; use loo, kfold or block");
  if (fold.fitted.empty())
    return fail(
        ErrorCode::kTooFewNodes,
        "Validation by role needs places whose rows are all for fitting, and every place of this table is validation");
  return std::vector<Fold>{std::move(fold)};
}

/// Takes rows from the fits of folds that score another sensor at the same true position.
void leaveSharedOut(std::vector<Fold>& folds, std::span<const Node> nodes) {
  const std::map<int, std::set<int>> shared = calibration::placesSharedBySensors(nodes);
  if (shared.empty()) return;
  for (Fold& fold : folds) {
    std::set<int> near;
    for (const std::size_t row : fold.scored)
      if (const auto found = shared.find(nodes[row].node); found != shared.end())
        near.insert(found->second.begin(), found->second.end());
    std::vector<std::size_t> kept;
    for (const std::size_t row : fold.fitted) (near.contains(nodes[row].node) ? fold.unused : kept).push_back(row);
    fold.fitted = std::move(kept);
  }
}

Result<int> countAfter(const std::string& text, std::size_t colon, int low, int high) {
  int count = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data() + colon + 1, end, count);
  if (error != std::errc() || rest != end || count < low || count > high)
    return fail(ErrorCode::kBadInput, "Validation '" + text + "' needs a whole number from " + std::to_string(low) +
                                          " to " + std::to_string(high) + " after the colon");
  return count;
}

Result<std::vector<Fold>> foldsOf(std::span<const Node> nodes, const Validation& validation, std::uint64_t seed) {
  if (validation.kind == ValidationKind::kRole) return roleFold(nodes);
  const std::vector<int> places = placesOf(nodes);
  if (places.size() < 2)
    return fail(ErrorCode::kTooFewNodes,
                "Holding places out needs at least 2 places, got " + std::to_string(places.size()));
  if (validation.kind == ValidationKind::kBlocks) {
    std::vector<Fold> folds = foldsOfGroups(nodes, octantGroups(nodes), kOctants);
    if (folds.size() < 2)
      return fail(ErrorCode::kDegenerate, "All places lie in one octant, so that none can be held out");
    return folds;
  }
  if (validation.kind == ValidationKind::kFolds) {
    FT_CHECK(validation.count >= 2);
    const std::size_t n_groups = std::min(places.size(), static_cast<std::size_t>(validation.count));
    return foldsOfGroups(nodes, shuffledGroups(places, n_groups, seed), n_groups);
  }
  std::map<int, std::size_t> own_group;
  for (std::size_t i = 0; i < places.size(); ++i) own_group[places[i]] = i;
  return foldsOfGroups(nodes, own_group, places.size());
}

}  // namespace

Result<Validation> parseValidation(const std::string& text) {
  constexpr int kMostFolds = 1000000;
  if (text == "role") return Validation{ValidationKind::kRole, 0};
  if (text == "loo") return Validation{ValidationKind::kLeaveOneOut, 0};
  const std::size_t colon = text.find(':');
  const std::string kind = text.substr(0, colon);
  if (colon != std::string::npos && kind == "kfold")
    return countAfter(text, colon, 2, kMostFolds).map([](int n) { return Validation{ValidationKind::kFolds, n}; });
  if (colon != std::string::npos && kind == "block")
    return countAfter(text, colon, kOctants, kOctants).map([](int n) {
      return Validation{ValidationKind::kBlocks, n};
    });
  return fail(ErrorCode::kBadInput, "Validation '" + text + "' is not known; there are: role, loo, kfold:10, block:8");
}

Validation defaultValidation(const CalibrationTable& table, bool needs_refits) {
  const bool has_validation = std::any_of(table.nodes.begin(), table.nodes.end(),
                                          [](const Node& node) { return node.role == NodeRole::kValidation; });
  if (has_validation) return {ValidationKind::kRole, 0};
  return needs_refits ? Validation{ValidationKind::kFolds, 10} : Validation{ValidationKind::kLeaveOneOut, 0};
}

std::string toText(const Validation& validation) {
  switch (validation.kind) {
    case ValidationKind::kRole:
      return "role";
    case ValidationKind::kLeaveOneOut:
      return "loo";
    case ValidationKind::kFolds:
      return "kfold:" + std::to_string(validation.count);
    case ValidationKind::kBlocks:
      return "block:" + std::to_string(validation.count);
  }
  return {};
}

std::vector<int> placesOf(std::span<const Node> nodes) {
  std::vector<int> places;
  std::set<int> seen;
  for (const Node& node : nodes)
    if (seen.insert(node.node).second) places.push_back(node.node);
  return places;
}

std::vector<std::size_t> leftOut(const Fold& fold) {
  std::vector<std::size_t> rows;
  std::merge(fold.scored.begin(), fold.scored.end(), fold.unused.begin(), fold.unused.end(), std::back_inserter(rows));
  return rows;
}

Result<std::vector<Fold>> makeFolds(std::span<const Node> nodes, const Validation& validation, std::uint64_t seed) {
  FT_TRY(auto folds, foldsOf(nodes, validation, seed));
  leaveSharedOut(folds, nodes);
  return folds;
}

}  // namespace fieldtrue::evaluation
