#include "acquisition/session/acquisition_places.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "acquisition/sampling/stillness.h"

namespace fieldtrue::acquisition {

namespace {

/// Takes nearest to a place that judge it: the cost of a take stays the same.
constexpr std::size_t kMostAround = 64;
constexpr std::size_t kMostForGuess = 250;
constexpr std::size_t kNeighbours = 6;
constexpr double kCarried_m = 0.05;   ///< From place to place the jig is carried so far at least.
constexpr double kShareBehind = 0.2;  ///< A sensor that moved no more of it was not carried along.
const Eigen::Vector3d kNoTake_m = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());

}  // namespace

Result<KnownPlaces::Content> KnownPlaces::read(const SessionStore& store) {
  const auto states = store.states();
  const auto table = store.nodeTable();
  const auto page = store.state("page");
  const auto gap = store.state("gap");
  const auto fits = store.fits();
  const auto can_undo = store.canUndo(), can_redo = store.canRedo();
  if (!states) return tl::unexpected(states.error());
  if (!table) return tl::unexpected(table.error());
  if (!page) return tl::unexpected(page.error());
  if (!gap) return tl::unexpected(gap.error());
  if (!fits) return tl::unexpected(fits.error());
  if (!can_undo) return tl::unexpected(can_undo.error());
  if (!can_redo) return tl::unexpected(can_redo.error());
  Content content{*states, {}, *can_undo, *can_redo, *page, fits->empty() ? std::string() : fits->front().second, *gap};
  content.rows.resize(states->size());
  std::map<std::pair<int, int>, std::size_t> index;
  for (std::size_t place = 0; place < states->size(); ++place) {
    index[{store.places()[place].node, store.places()[place].visit}] = place;
  }
  for (const Node& node : table->nodes) content.rows[index.at({node.node, node.visit})].push_back(node);
  return content;
}

void KnownPlaces::fill(const Content& content) {
  states = content.states;
  rows.resize(states.size());
  takes_m.assign(states.size(), kNoTake_m);
  for (std::size_t place = 0; place < states.size(); ++place) setRows(place, content.rows[place]);
  can_undo = content.can_undo;
  can_redo = content.can_redo;
}

void KnownPlaces::clear() {
  states.clear();
  rows.clear();
  done_nodes.clear();
  takes_m.clear();
  current.reset();
  led_by.reset();
  misfits.clear();
  can_undo = can_redo = false;
  updateGuess();
}

Result<std::vector<Sample>> KnownPlaces::reload(std::size_t place) {
  const auto state = store->state(place);
  const auto stored = store->nodes(place);
  auto samples = store->samples(place);
  const auto undoable = store->canUndo(), redoable = store->canRedo();
  if (!state) return tl::unexpected(state.error());
  if (!stored) return tl::unexpected(stored.error());
  if (!samples) return samples;
  if (!undoable) return tl::unexpected(undoable.error());
  if (!redoable) return tl::unexpected(redoable.error());
  states[place] = *state;
  setRows(place, *stored);
  can_undo = *undoable;
  can_redo = *redoable;
  return samples;
}

void KnownPlaces::setRows(std::size_t place, const std::vector<Node>& rows_now) {
  const bool replaces = counted(place);
  rows[place] = rows_now;
  const Node* now = counted(place);
  takes_m[place] = now ? now->reference_from_sensor.position_m : kNoTake_m;
  if (!replaces) {
    if (now) done_nodes.push_back(*now);
    return;
  }
  gatherDone();
}

const Node* KnownPlaces::leading(std::size_t place) const {
  if (led_by) return rowOf(place, *led_by);
  return rows[place].empty() ? nullptr : &rows[place].front();
}

const Node* KnownPlaces::counted(std::size_t place) const {
  const Node* node = leading(place);
  return node && node->role != NodeRole::kSkipped ? node : nullptr;
}

void KnownPlaces::gatherDone() {
  done_nodes.clear();
  for (std::size_t at = 0; at < rows.size(); ++at)
    if (const Node* node = counted(at)) done_nodes.push_back(*node);
}

void KnownPlaces::leadBy(std::optional<int> sensor) {
  if (led_by == sensor) return;
  led_by = sensor;
  for (std::size_t place = 0; place < rows.size(); ++place) {
    const Node* now = counted(place);
    takes_m[place] = now ? now->reference_from_sensor.position_m : kNoTake_m;
  }
  gatherDone();
  judgeAll();
  updateGuess();
}

std::vector<int> KnownPlaces::sensors() const {
  std::vector<int> found;
  for (const auto& of_place : rows)
    for (const Node& node : of_place)
      if (std::find(found.begin(), found.end(), node.sensor) == found.end()) found.push_back(node.sensor);
  return found;
}

std::optional<std::size_t> KnownPlaces::next() const {
  const auto next = std::find(states.begin(), states.end(), PlaceState::kPlanned);
  if (next == states.end()) return std::nullopt;
  return static_cast<std::size_t>(next - states.begin());
}

std::vector<std::size_t> KnownPlaces::nearestTakes(std::size_t place, std::size_t most) const {
  const Eigen::Vector3d& here_m = store->places()[place].reference_from_sensor.position_m;
  std::vector<std::pair<double, std::size_t>> by_distance;
  by_distance.reserve(takes_m.size());
  for (std::size_t other = 0; other < takes_m.size(); ++other) {
    const double distance_m2 = (takes_m[other] - here_m).squaredNorm();
    if (!std::isnan(distance_m2)) by_distance.emplace_back(distance_m2, other);
  }
  const std::size_t kept = std::min(most, by_distance.size());
  std::partial_sort(by_distance.begin(), by_distance.begin() + static_cast<std::ptrdiff_t>(kept), by_distance.end());
  std::vector<std::size_t> takes;
  for (std::size_t i = 0; i < kept; ++i) takes.push_back(by_distance[i].second);
  return takes;
}

std::vector<NeighbourTake> KnownPlaces::neighbours(std::size_t place, int sensor) const {
  std::vector<NeighbourTake> takes;
  for (const std::size_t other : nearestTakes(place, kNeighbours + 1)) {
    if (other == place || takes.size() == kNeighbours) continue;
    const Node* node = rowOf(other, sensor);
    if (node && node->covariance_m2)
      takes.push_back({std::sqrt(node->covariance_m2->trace()), node->tracker_from_sensor.position_m.norm()});
  }
  return takes;
}

const Node* KnownPlaces::rowOf(std::size_t place, int sensor) const {
  for (const Node& node : rows[place])
    if (node.sensor == sensor) return &node;
  return nullptr;
}

bool KnownPlaces::staysBehind(std::size_t place, const std::map<int, Eigen::Vector3d>& means_m, int leading,
                              int sensor) const {
  for (const std::size_t other : nearestTakes(place, kNeighbours + 1)) {
    const Node *lead = rowOf(other, leading), *same = rowOf(other, sensor);
    if (other == place || !lead || !same) continue;
    const double carried_m = (means_m.at(leading) - lead->tracker_from_sensor.position_m).norm();
    if (carried_m < kCarried_m) continue;
    return (means_m.at(sensor) - same->tracker_from_sensor.position_m).norm() < kShareBehind * carried_m;
  }
  return false;
}

RigFit KnownPlaces::fitOf(const std::vector<std::size_t>& takes) const {
  std::vector<Node> done;
  for (const std::size_t place : takes) done.push_back(*leading(place));
  const bool is_known = store->metadata().alignment_known;
  return {done, spacing, is_known ? std::optional(believed_reference) : std::nullopt};
}

void KnownPlaces::judgeAround(std::size_t place, std::vector<bool>* is_judged) {
  const std::vector<std::size_t> takes = nearestTakes(place, kMostAround);
  // Those at the rim of what is looked at lack neighbours; they are judged with the takes around them.
  const std::size_t judged = takes.size() < kMostAround ? takes.size() : kMostAround / 2;
  misfits.erase(place);
  for (std::size_t i = 0; i < judged; ++i) {
    misfits.erase(takes[i]);
    if (is_judged) (*is_judged)[takes[i]] = true;
  }
  for (const RigFit::Misfit& misfit : fitOf(takes).misfits()) {
    if (misfit.take < judged) misfits[takes[misfit.take]] = misfit.off_m;
  }
}

void KnownPlaces::judgeAll() {
  if (!states.empty()) spacing = spacing_m(store->places(), 0);
  misfits.clear();
  std::vector<bool> is_judged(rows.size(), false);
  for (std::size_t place = 0; place < rows.size(); ++place) {
    if (!is_judged[place] && leading(place)) judgeAround(place, &is_judged);
  }
}

void KnownPlaces::updateGuess() {
  const bool alignment_known = store && store->metadata().alignment_known;
  // A part of many places, spread over all, tells the frame as well; all of them would make every place cost more.
  const std::size_t step = 1 + done_nodes.size() / kMostForGuess;
  std::vector<Node> spread;
  for (std::size_t i = 0; i < done_nodes.size(); i += step) spread.push_back(done_nodes[i]);
  guess = guessReference(spread, believed_reference, alignment_known);
  rig = RigFit();
  if (!current) return;
  const std::vector<std::size_t> around = nearestTakes(*current, kMostAround);
  rig = fitOf(around);
  // One wrong take must not turn the room for all the others.
  if (rig.usable()) guess.reference_from_tracker = rig.reference_from_tracker();
  std::vector<Node> near_nodes;
  for (const std::size_t place : around) near_nodes.push_back(*leading(place));
  near_m = nearDistance_m(here(), spacing, near_nodes, guess.reference_from_tracker);
}

std::optional<double> KnownPlaces::distance_m(const std::optional<Sample>& live) const {
  if (!live || !isGood(*live) || !current) return std::nullopt;
  const Eigen::Vector3d& tracked_m = live->tracker_from_sensor.position_m;
  const Eigen::Vector3d& there_m = here().reference_from_sensor.position_m;
  if (rig.usable()) return rig.off_m(tracked_m, there_m);
  return (guess.reference_from_tracker * tracked_m - there_m).norm();
}

std::optional<double> KnownPlaces::tooFar_m(const std::optional<Sample>& live) const {
  const auto off_m = rig.usable() ? distance_m(live) : std::nullopt;
  if (!off_m || *off_m <= rig.limit_m(here().reference_from_sensor.position_m)) return std::nullopt;
  return off_m;
}

bool KnownPlaces::isElsewhere(const std::optional<Sample>& live) const {
  if (tooFar_m(live)) return true;
  const auto off_m = distance_m(live);
  return guess.known && !(off_m && *off_m <= near_m);
}

}  // namespace fieldtrue::acquisition
