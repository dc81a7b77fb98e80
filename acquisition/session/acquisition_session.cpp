#include <QDate>
#include <QFileInfo>
#include <algorithm>
#include <filesystem>
#include <limits>
#include <map>

#include "acquisition/plan/place_state.h"
#include "acquisition/session/acquisition_impl.h"
#include "calib/core/json_text.h"
#include "calib/tables/metadata_keys.h"
#include "calib/tables/table_json.h"
#include "calib/tables/table_metadata.h"

/// The session half of the controller: opening, places, and what is current.
namespace fieldtrue::acquisition {

namespace {

const std::string kDefaultRig = "wooden jig";
/// Farthest the sensor need go for its stand to count as left: less than a jig is lifted to be set down again.
constexpr double kLeave_m = 0.02;
constexpr double kLeaveAtLeast_m = 0.005;
constexpr std::size_t kMostForGuess = 250;
const Eigen::Vector3d kNoTake_m = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());

Result<Plan> planOf(const QString& text, const QString& path) {
  const std::string plain = text.trimmed().toStdString();
  if (!plain.starts_with('{')) return readPlan(plain);
  const Result<nlohmann::json> json = parseJson(plain, path.toStdString() + ": plan");
  if (!json) return tl::unexpected(json.error());
  return planFromJson(*json, "plan");
}

}  // namespace

Result<SessionStore> AcquisitionController::Impl::createSession(const QString& path, const QString& plan_text) const {
  const Result<Plan> plan = planOf(plan_text, path);
  if (!plan) return tl::unexpected(plan.error());
  TableMetadata metadata = device ? device->describe() : TableMetadata{};
  if (!metadata.rig) metadata.rig = kDefaultRig;
  metadata.date = now().toLocalTime().date().toString(Qt::ISODate).toStdString();
  return SessionStore::create(path, *plan, metadata, now());
}

void AcquisitionController::Impl::open(const QString& path, const QString& create_plan_json) {
  if (isOpenAlready(path)) {
    if (create_plan_json.isEmpty())
      tellOpened(store->state("page").value_or(std::string()));
    else
      emit owner->failed(path + QStringLiteral(": this session is open already; choose another name for the new one"));
    return;
  }
  Result<SessionStore> opened =
      create_plan_json.isEmpty() ? SessionStore::open(path) : createSession(path, create_plan_json);
  Result<Content> content = opened ? readContent(*opened) : tl::unexpected(opened.error());
  if (!content) {
    emit owner->failed(QString::fromStdString(content.error().message));
    return;
  }
  close();
  // Who begins a session takes the first places by hand: nothing may be recorded before the sensor is where it belongs.
  automatic = false;
  store.emplace(*std::move(opened));
  states = std::move(content->states);
  nodes.resize(states.size());
  takes_m.assign(states.size(), kNoTake_m);
  for (std::size_t place = 0; place < states.size(); ++place) setNode(place, content->nodes[place]);
  can_undo = content->can_undo;
  can_redo = content->can_redo;
  ++revision;
  told_session.reset();
  told_recorded.reset();
  mergeMetadata();
  if (!states.empty()) spacing = spacing_m(store->places(), 0);
  judgeAll();
  setCurrent(nextPlace());
  tellOpened(content->page);
  if (!content->newest_fit.empty()) emit owner->fitOpened(QString::fromStdString(content->newest_fit));
  for (const std::string& remark : store->remarks()) emit owner->remarked(QString::fromStdString(remark));
  remarkOnTracker();
}

bool AcquisitionController::Impl::isOpenAlready(const QString& path) const {
  if (!store) return false;
  // By the file itself: links and other spellings of the path lead to it too.
  std::error_code missing;
  return std::filesystem::equivalent(QFileInfo(store->path()).filesystemFilePath(),
                                     QFileInfo(path).filesystemFilePath(), missing);
}

void AcquisitionController::Impl::tellOpened(const std::string& page) {
  const QString plan_json = QString::fromStdString(toJson(store->plan()).dump());
  emit owner->sessionOpened(store->path(), QString::fromStdString(page), plan_json);
}

void AcquisitionController::Impl::close() {
  stopTake();
  store.reset();
  loose = LooseReadings();
  loose_refused = false;
  states.clear();
  nodes.clear();
  done_nodes.clear();
  takes_m.clear();
  current.reset();
  time_offset_s.reset();
  live.reset();
  recent_times_s.clear();
  failure.clear();
  refused_at.reset();
  misfits.clear();
  can_undo = can_redo = false;
  told_session.reset();
  told_recorded.reset();
  stillness.clear();
  stand = StandWatch();
  updateGuess();
  changed();
}

Result<AcquisitionController::Impl::Content> AcquisitionController::Impl::readContent(const SessionStore& store) {
  const auto states = store.states();
  const auto table = store.nodeTable();
  const auto page = store.state("page");
  const auto fits = store.fits();
  const auto can_undo = store.canUndo(), can_redo = store.canRedo();
  if (!states) return tl::unexpected(states.error());
  if (!table) return tl::unexpected(table.error());
  if (!page) return tl::unexpected(page.error());
  if (!fits) return tl::unexpected(fits.error());
  if (!can_undo) return tl::unexpected(can_undo.error());
  if (!can_redo) return tl::unexpected(can_redo.error());
  Content content{*states, {}, *can_undo, *can_redo, *page, fits->empty() ? std::string() : fits->front().second};
  content.nodes.resize(states->size());
  std::map<std::pair<int, int>, std::size_t> index;
  for (std::size_t place = 0; place < states->size(); ++place) {
    index[{store.places()[place].node, store.places()[place].visit}] = place;
  }
  for (const Node& node : table->nodes) content.nodes[index.at({node.node, node.visit})] = node;
  return content;
}

Result<void> AcquisitionController::Impl::reloadPlace(std::size_t place) {
  const auto state = store->state(place);
  const auto node = store->node(place);
  const auto samples = store->samples(place);
  const auto undoable = store->canUndo(), redoable = store->canRedo();
  if (!state) return tl::unexpected(state.error());
  if (!node) return tl::unexpected(node.error());
  if (!samples) return tl::unexpected(samples.error());
  if (!undoable) return tl::unexpected(undoable.error());
  if (!redoable) return tl::unexpected(redoable.error());
  states[place] = *state;
  setNode(place, *node);
  can_undo = *undoable;
  can_redo = *redoable;
  ++revision;
  told_recorded.reset();
  judgeAround(place);
  emit owner->placeChanged(static_cast<int>(place), *node, *samples);
  return {};
}

std::optional<std::size_t> AcquisitionController::Impl::nextPlace() const {
  const auto next = std::find(states.begin(), states.end(), PlaceState::kPlanned);
  if (next == states.end()) return std::nullopt;
  return static_cast<std::size_t>(next - states.begin());
}

bool AcquisitionController::Impl::told(const Result<void>& done) {
  if (!done) emit owner->failed(QString::fromStdString(done.error().message));
  return done.has_value();
}

void AcquisitionController::Impl::keepLoose(const std::vector<LooseSample>& readings) {
  if (readings.empty() || !store || store->isReadOnly()) return;
  const auto kept = store->keepLoose(readings);
  if (!kept && !loose_refused) {
    emit owner->failed(QString::fromStdString("Readings between the places are not stored: " + kept.error().message));
  }
  loose_refused = !kept;
  std::vector<SampleRow> rows;
  for (const LooseSample& reading : readings) rows.push_back(rowOf(reading));
  emit owner->looseKept(rows);
}

void AcquisitionController::Impl::keepCancelledTake() {
  if (!store || !current || sampler.state() == TakeState::kIdle) return;
  const int node = store->places()[*current].node;
  keepLoose(loose.cancelled(node, sampler.abandoned()));
  keepLoose(loose.cancelled(node, sampler.samples()));
}

void AcquisitionController::Impl::setCurrent(std::optional<std::size_t> place) {
  const bool moves = place.has_value();
  current = place;
  waiting_since_s.reset();
  refused_at.reset();
  if (moves) {
    spacing = spacing_m(store->places(), *place);
    stand.setLeaveDistance(std::clamp(0.25 * spacing, kLeaveAtLeast_m, kLeave_m));
  }
  updateGuess();
  if (moves) guide();
  changed();
}

void AcquisitionController::Impl::goOn() {
  setCurrent(nextPlace());
  if (!current) emit owner->finished();
}

void AcquisitionController::Impl::note(const std::string& kind, const std::string& text) {
  // A note that cannot be written is no reason to stop: the take it stands beside is what matters.
  if (store) (void)store->addEvent(kind, text);
}

void AcquisitionController::Impl::setNode(std::size_t place, const std::optional<Node>& node) {
  const auto counts = [](const std::optional<Node>& row) { return row && row->role != NodeRole::kSkipped; };
  const bool replaces = counts(nodes[place]);
  nodes[place] = node;
  takes_m[place] = counts(node) ? node->reference_from_sensor.position_m : kNoTake_m;
  if (!replaces) {
    if (counts(node)) done_nodes.push_back(*node);
    return;
  }
  done_nodes.clear();
  for (const auto& row : nodes) {
    if (counts(row)) done_nodes.push_back(*row);
  }
}

void AcquisitionController::Impl::updateGuess() {
  const bool alignment_known = store && store->metadata().alignment_known;
  // A part of many places, spread over all, tells the frame as well; all of them would make every place cost more.
  const std::size_t step = 1 + done_nodes.size() / kMostForGuess;
  std::vector<Node> spread;
  for (std::size_t i = 0; i < done_nodes.size(); i += step) spread.push_back(done_nodes[i]);
  guess = guessReference(spread, believed_reference, alignment_known);
  const std::vector<std::size_t> around = store && current ? takesNear(*current) : std::vector<std::size_t>();
  rig = store && current ? fitOf(around) : RigFit();
  // One wrong take must not turn the room for all the others.
  if (rig.usable()) guess.reference_from_tracker = rig.reference_from_tracker();
  if (store && current) {
    std::vector<Node> near_nodes;
    for (const std::size_t place : around) near_nodes.push_back(*nodes[place]);
    near_m = nearDistance_m(store->places()[*current], spacing, near_nodes, guess.reference_from_tracker);
  }
}

void AcquisitionController::Impl::compareTrackers(TableMetadata& known, const TableMetadata& said) {
  other_tracker.reset();
  if (!known.tracker || !said.tracker || *known.tracker == *said.tracker) return;
  const bool has_takes =
      std::any_of(nodes.begin(), nodes.end(), [](const std::optional<Node>& node) { return node.has_value(); });
  if (!has_takes) {
    known.tracker = said.tracker;
    return;
  }
  other_tracker = said.tracker;
  note("tracker", "recorded with " + *said.tracker + " from here on; the session was begun with " + *known.tracker);
}

void AcquisitionController::Impl::remarkOnTracker() {
  if (!other_tracker) return;
  emit owner->remarked(
      QString::fromStdString("This session was begun with " + store->metadata().tracker.value_or("another tracker") +
                             ", and what is taken now is of " + *other_tracker +
                             ": one calibration of both is wrong. Connect the first again, or begin a new session."));
}

Result<void> AcquisitionController::Impl::markOtherTracker() {
  if (!other_tracker) return {};
  TableMetadata metadata = store->metadata();
  if (!metadata.other.emplace(kOtherTracker, *other_tracker).second) return {};
  auto stored = store->setMetadata(metadata);
  if (stored) emit owner->metadataChanged(metadata);
  return stored;
}

void AcquisitionController::Impl::mergeMetadata() {
  if (!store || store->isReadOnly() || !device || device_state != DeviceState::kRunning) return;
  const TableMetadata said = device->describe();
  TableMetadata known = store->metadata();
  if (known.rig == kDefaultRig && said.rig) known.rig = said.rig;
  compareTrackers(known, said);
  const TableMetadata both = merged(known, said);
  if (toJson(both) == toJson(store->metadata())) return;
  if (told(store->setMetadata(both))) emit owner->metadataChanged(both);
}

}  // namespace fieldtrue::acquisition
