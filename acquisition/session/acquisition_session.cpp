#include <QDate>
#include <QFileInfo>
#include <algorithm>
#include <map>

#include "acquisition/session/acquisition_impl.h"
#include "acquisition/session/metadata_json.h"

/// The session half of the controller: opening, places, and what is current.
namespace fieldtrue {

namespace {

const std::string kDefaultRig = "wooden jig";
/// Farthest the sensor need go for its stand to count as left: less than a jig is lifted to be set down again.
constexpr double kLeave_m = 0.02;
constexpr double kLeaveAtLeast_m = 0.005;

Result<Plan> planOf(const QString& text, const QString& path) {
  const std::string plain = text.trimmed().toStdString();
  if (!plain.starts_with('{')) return readPlan(plain);
  const auto json = nlohmann::json::parse(plain, nullptr, false);
  if (json.is_discarded()) return fail(ErrorCode::kBadInput, path.toStdString() + ": the plan is not valid JSON");
  return planFromJson(json, "plan");
}

}  // namespace

Result<SessionStore> AcquisitionController::Impl::createSession(const QString& path, const QString& plan_text) const {
  const Result<Plan> plan = planOf(plan_text, path);
  if (!plan) return tl::unexpected(plan.error());
  TableMetadata metadata = device ? device->describe() : TableMetadata{};
  if (!metadata.rig) metadata.rig = kDefaultRig;
  metadata.date = QDate::currentDate().toString(Qt::ISODate).toStdString();
  return SessionStore::create(path, *plan, metadata);
}

void AcquisitionController::Impl::open(const QString& path, const QString& create_plan_json) {
  if (store && QFileInfo(store->path()) == QFileInfo(path)) close();
  Result<SessionStore> opened =
      create_plan_json.isEmpty() ? SessionStore::open(path) : createSession(path, create_plan_json);
  if (!opened) {
    emit owner->failed(QString::fromStdString(opened.error().message));
    return;
  }
  close();
  store.emplace(*std::move(opened));
  mergeMetadata();
  loadPlaces();
  setCurrent(store->nextPlace());
  const QString plan_json = QString::fromStdString(toJson(store->plan()).dump());
  emit owner->sessionOpened(path, QString::fromStdString(store->state("page")), plan_json);
  const auto fits = store->fits();
  if (!fits.empty()) emit owner->fitOpened(QString::fromStdString(fits.front().second));
}

void AcquisitionController::Impl::close() {
  stopTake();
  store.reset();
  states.clear();
  nodes.clear();
  current.reset();
  time_offset_s.reset();
  live.reset();
  recent_times_s.clear();
  failure.clear();
  can_undo = can_redo = false;
  stillness.clear();
  stand = StandWatch();
  updateGuess();
  changed();
}

void AcquisitionController::Impl::loadPlaces() {
  states = store->states();
  nodes.assign(states.size(), std::nullopt);
  std::map<std::pair<int, int>, std::size_t> index;
  for (std::size_t place = 0; place < states.size(); ++place) {
    index[{store->places()[place].node, store->places()[place].visit}] = place;
  }
  for (const Node& node : store->nodeTable().nodes) nodes[index.at({node.node, node.visit})] = node;
  can_undo = store->canUndo();
  can_redo = store->canRedo();
  updateGuess();
}

void AcquisitionController::Impl::reloadPlace(std::size_t place) {
  states = store->states();
  nodes[place] = store->node(place);
  can_undo = store->canUndo();
  can_redo = store->canRedo();
  updateGuess();
}

void AcquisitionController::Impl::setCurrent(std::optional<std::size_t> place) {
  const bool moves = place.has_value();
  current = place;
  waiting_since_s.reset();
  if (moves) {
    spacing = spacing_m(store->places(), *place);
    stand.setLeaveDistance(std::clamp(0.25 * spacing, kLeaveAtLeast_m, kLeave_m));
    updateGuess();
    guide();
  }
  changed();
}

void AcquisitionController::Impl::goOn() {
  setCurrent(store->nextPlace());
  if (!current) emit owner->finished();
}

void AcquisitionController::Impl::note(const std::string& kind, const std::string& text) {
  // A note that cannot be written is no reason to stop: the take it stands beside is what matters.
  if (store) (void)store->addEvent(kind, text);
}

std::vector<Node> AcquisitionController::Impl::doneNodes() const {
  std::vector<Node> done;
  for (const auto& node : nodes) {
    if (node && node->role != NodeRole::kSkipped) done.push_back(*node);
  }
  return done;
}

void AcquisitionController::Impl::updateGuess() {
  const std::vector<Node> done = doneNodes();
  const bool alignment_known = store && store->metadata().alignment_known;
  guess = guessReference(done, believed_reference, alignment_known);
  if (store && current) {
    near_m = nearDistance_m(store->places()[*current], spacing, done, guess.reference_from_tracker);
  }
}

void AcquisitionController::Impl::mergeMetadata() {
  if (!store || !device || device_state != DeviceState::kRunning) return;
  const TableMetadata said = device->describe();
  TableMetadata known = store->metadata();
  if (known.rig == kDefaultRig && said.rig) known.rig = said.rig;
  const TableMetadata both = merged(known, said);
  if (known.tracker && said.tracker && *known.tracker != *said.tracker) {
    note("tracker", "recorded with " + *said.tracker + " from here on; the session was begun with " + *known.tracker);
  }
  if (toJson(both) == toJson(store->metadata())) return;
  if (const auto kept = store->setMetadata(both); !kept) {
    emit owner->failed(QString::fromStdString(kept.error().message));
  }
}

}  // namespace fieldtrue
