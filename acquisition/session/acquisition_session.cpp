#include <QDate>
#include <QFileInfo>
#include <algorithm>
#include <filesystem>

#include "acquisition/session/acquisition_impl.h"
#include "calib/core/json_text.h"

/// The session half of the controller: opening, what is stored, and what is current.
namespace fieldtrue::acquisition {

namespace {

/// Farthest the sensor need go for its stand to count as left: less than a jig is lifted to be set down again.
constexpr double kLeave_m = 0.02;
constexpr double kLeaveAtLeast_m = 0.005;

Result<Plan> planOf(const QString& text, const QString& path) {
  const std::string plain = text.trimmed().toStdString();
  if (!plain.starts_with('{')) return readPlan(plain);
  FT_TRY(const nlohmann::json json, parseJson(plain, path.toStdString() + ": plan"));
  return planFromJson(json, "plan");
}

}  // namespace

Result<SessionStore> AcquisitionController::Impl::createSession(const QString& path, const QString& plan_text) const {
  FT_TRY(const Plan plan, planOf(plan_text, path));
  TableMetadata metadata = said();
  if (!metadata.rig) metadata.rig = kDefaultRig;
  metadata.date = now().toLocalTime().date().toString(Qt::ISODate).toStdString();
  return SessionStore::create(path, plan, metadata, now());
}

void AcquisitionController::Impl::open(const QString& path, const QString& create_plan_json,
                                       const std::optional<TakeLength>& length) {
  if (isOpenAlready(path)) {
    if (create_plan_json.isEmpty())
      tellOpened(store->state("page").value_or(std::string()));
    else
      emit owner->failed(path + QStringLiteral(": this session is open already; choose another name for the new one"));
    return;
  }
  Result<SessionStore> opened =
      create_plan_json.isEmpty() ? SessionStore::open(path) : createSession(path, create_plan_json);
  const Result<KnownPlaces::Content> content = opened ? KnownPlaces::read(*opened) : tl::unexpected(opened.error());
  if (!told(content)) return;
  close();
  // Who begins a session takes the first places by hand: nothing may be recorded before the sensor is where it belongs.
  take.automatic = false;
  store.emplace(*std::move(opened));
  places.fill(*content);
  ++views.revision;
  useTakeLength(length && keepTakeLength(*length) ? *length : keptTakeLength());
  keepChoiceOfSensors();
  settleSensors();
  mergeMetadata();
  views.told_recorded.reset();
  places.judgeAll();
  setCurrent(places.next());
  tellOpened(content->page);
  emit owner->takeLengthKnown(take.options.length);
  if (!content->newest_fit.empty()) emit owner->fitOpened(QString::fromStdString(content->newest_fit));
  if (!content->gap.empty()) emit owner->gapOpened(QString::fromStdString(content->gap));
  for (const std::string& text : store->remarks()) remark(text);
  remarkOnTracker();
  remarkOnLeftOut();
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

TakeLength AcquisitionController::Impl::keptTakeLength() {
  const auto text = store->state(kTakeLengthState);
  if (!told(text) || text->empty()) return usual_length;
  const auto length = readTakeLength(*text);
  return told(length) ? *length : usual_length;
}

bool AcquisitionController::Impl::keepTakeLength(const TakeLength& length) {
  return told(checked(length)) && told(store->setState(kTakeLengthState, textOf(length)));
}

void AcquisitionController::Impl::useTakeLength(const TakeLength& length) {
  take.options.length = length;
  if (!take.runs()) take.sampler = TakeSampler(take.options);
  views.tellSoon();
}

void AcquisitionController::Impl::close() {
  stopTake();
  store.reset();
  clock_began.reset();
  loose = LooseReadings();
  loose_refused = false;
  other_tracker.reset();
  other_names.clear();
  late_sensors.clear();
  tracker.time_offset_s.reset();
  tracker.live.reset();
  tracker.recent_times_s.clear();
  take.forgetFailure();
  take.stillness.clear();
  take.stand = StandWatch();
  views.told_session.reset();
  views.told_recorded.reset();
  places.clear();
  settleSensors();
  views.tellSoon();
}

Result<void> AcquisitionController::Impl::reloadPlace(std::size_t place) {
  FT_TRY(const auto samples, places.reload(place));
  ++views.revision;
  views.told_recorded.reset();
  places.judgeAround(place);
  emit owner->placeChanged(static_cast<int>(place), places.rows[place], samples);
  return {};
}

std::optional<std::size_t> AcquisitionController::Impl::step(Result<std::optional<std::size_t>> (SessionStore::*go)()) {
  take.forgetFailure();
  stopTake();
  const auto place = (*store.*go)();
  if (!told(place) || !*place || !told(reloadPlace(**place))) return std::nullopt;
  settleSensors();
  return *place;
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

void AcquisitionController::Impl::setCurrent(std::optional<std::size_t> place) {
  const bool moves = place.has_value();
  places.current = place;
  take.waiting_since_s.reset();
  take.refused_at.reset();
  take.times_again = 0;
  if (moves) {
    places.spacing = spacing_m(store->places(), *place);
    take.stand.setLeaveDistance(std::clamp(0.25 * places.spacing, kLeaveAtLeast_m, kLeave_m));
  }
  places.updateGuess();
  if (moves) guide();
  views.tellSoon();
}

void AcquisitionController::Impl::advance() {
  setCurrent(places.next());
  if (!places.current) emit owner->finished();
}

void AcquisitionController::Impl::note(const std::string& kind, const std::string& text) {
  // A note that cannot be written is no reason to stop: the take it stands beside is what matters.
  if (store) (void)store->addEvent(kind, text);
}

}  // namespace fieldtrue::acquisition
