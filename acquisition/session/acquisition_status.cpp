#include "acquisition/session/acquisition_status.h"

#include <algorithm>

#include "acquisition/session/acquisition_impl.h"
#include "calib/tables/table_sensors.h"

/// What the views are told, and when.
namespace fieldtrue::acquisition {

std::string silentText(const std::vector<int>& sensors) {
  return fieldtrue::sensorsText(sensors) + (sensors.size() == 1 ? " does" : " do") + " not report: plug " +
         (sensors.size() == 1 ? "it" : "them") + " in again";
}

void ViewUpdates::tellSoon() {
  constexpr qint64 kStatusInterval_ms = 34;
  if (status_timer.isActive()) return;
  const qint64 elapsed_ms = since_status.isValid() ? since_status.elapsed() : kStatusInterval_ms;
  status_timer.start(static_cast<int>(std::max<qint64>(0, kStatusInterval_ms - elapsed_ms)));
}

std::shared_ptr<const PlannedSession> ViewUpdates::session(const std::optional<SessionStore>& store) const {
  if (told_session) return told_session;
  PlannedSession session;
  if (store) session = {store->path(), store->isReadOnly(), store->places()};
  return told_session = std::make_shared<PlannedSession>(std::move(session));
}

std::shared_ptr<const RecordedPlaces> ViewUpdates::recorded(const KnownPlaces& places) const {
  if (told_recorded) return told_recorded;
  auto recorded = std::make_shared<RecordedPlaces>();
  if (places.store) recorded->revision = revision;
  recorded->states = places.states;
  for (const auto& [place, off_m] : places.misfits) {
    recorded->misfits.push_back({place, off_m});
    if (places.states[place] == PlaceState::kDone) recorded->states[place] = PlaceState::kSuspicious;
  }
  for (const PlaceState state : places.states) {
    recorded->n_done += state == PlaceState::kDone || state == PlaceState::kSuspicious ? 1 : 0;
    recorded->n_skipped += state == PlaceState::kSkipped ? 1 : 0;
  }
  recorded->can_undo = places.can_undo;
  recorded->can_redo = places.can_redo;
  return told_recorded = recorded;
}

AcquisitionStatus AcquisitionController::Impl::status() const {
  AcquisitionStatus result;
  result.session = views.session(store);
  result.recorded = views.recorded(places);
  result.current = places.current;
  result.current_is_retake = places.isRetake();
  result.take = take.failure.isEmpty() ? take.sampler.state() : TakeState::kFailed;
  result.collected = take.sampler.collected();
  result.wanted = take.sampler.wanted();
  result.can_keep = take.held() && take.sampler.canKeep();
  result.automatic = take.automatic;
  result.still = take.stillness.still();
  result.reason = reason(&result.attention);
  result.device = tracker.state;
  result.device_text = tracker.text;
  result.reconnecting = tracker.lost;
  result.just_returned = tracker.justReturned();
  result.live = tracker.live;
  result.rate_hz = tracker.rate_hz();
  result.sd_m = take.stillness.spread_m();
  result.reference_from_tracker = places.guess.reference_from_tracker;
  result.reference_known = places.guess.known;
  result.distance_m = places.distance_m(tracker.live);
  result.distance_known = places.rig.usable() || places.guess.known;
  result.away = places.tooFar_m(tracker.live).has_value();
  result.refused = take.isRefusedAt(places.current);
  result.not_stored = take.not_stored;
  result.has_trace = tracker.device ? tracker.device->hasTrace() : tracker.last_trace.has_value();
  result.sensors = progress();
  result.reporting = tracker.reporting();
  result.missing = tracker.missingSensors();
  result.other_names = QString::fromStdString(other_names);
  result.takes_settle_sensors = takes_settle_sensors;
  result.of_session = sensors_of_session;
  return result;
}

std::vector<SensorProgress> AcquisitionController::Impl::progress() const {
  std::vector<SensorProgress> sensors;
  for (const int sensor : tracker.sensors) {
    const NodeSampler* sampler = take.sampler.of(sensor);
    sensors.push_back({sensor, sampler ? sampler->collected() : 0, sampler ? sampler->wanted() : 0});
  }
  for (const int silent : tracker.running() ? tracker.silentSensors() : std::vector<int>())
    for (SensorProgress& one : sensors) one.silent = one.silent || one.sensor == silent;
  return sensors;
}

QString AcquisitionController::Impl::reason(bool* attention) const {
  *attention = false;
  if (!store) return QStringLiteral("make a plan or open a session");
  *attention = !take.failure.isEmpty();
  if (*attention) return take.failure;
  if (store->isReadOnly()) return QStringLiteral("nothing can be stored: the session's file cannot be written to");
  if (!tracker.running()) {
    *attention = tracker.state == DeviceState::kFailed;
    return tracker.text.isEmpty() ? QStringLiteral("connect the tracker") : tracker.text;
  }
  *attention = !other_names.empty();
  if (*attention) return QString::fromStdString(other_names);
  *attention = !tracker.live && tracker.since_sample.isValid() && tracker.since_sample.elapsed() >= 2000;
  if (*attention) return QStringLiteral("the tracker stopped sending: check its line and its switch");
  if (!places.current) return QStringLiteral("all places are done");
  *attention = take.held();
  if (*attention) {
    const char* onward = take.sampler.canKeep() ? ". Carrying the jig on keeps it" : "";
    return QString::fromStdString(take.sampler.message() + onward);
  }
  const std::vector<int> silent = tracker.silentSensors();
  *attention = !silent.empty();
  if (*attention) return QString::fromStdString(silentText(silent));
  if (take.collecting()) {
    const TakeSampler& sampler = take.sampler;
    const bool began_again = !sampler.message().empty();
    *attention = sampler.restarts() > 0 || began_again || !take.stillness.still();
    if (take.awaits_rest && !began_again && !take.stillness.still())
      return QString::fromStdString(take.stillness.reason());
    const bool just_restarted = began_again && sampler.collected() < sampler.wanted() / 2;
    if (just_restarted) return QString::fromStdString(sampler.message());
    return QStringLiteral("hold still: %1 of %2").arg(sampler.collected()).arg(sampler.wanted());
  }
  *attention = take.stillness.reason().starts_with("no signal");
  return waitingReason();
}

QString AcquisitionController::Impl::waitingReason() const {
  if (take.automatic && take.isWhereTaken()) {
    return take.stand.wasStopped() ? QStringLiteral("stopped: lift the sensor and set it down again; or press space")
                                   : QStringLiteral("move the sensor here; or press space");
  }
  if (!take.stillness.still()) return QString::fromStdString(take.stillness.reason());
  if (take.automatic) {
    return places.isElsewhere(tracker.live)
               ? QStringLiteral("still, but not at the place: move it here; or press space")
               : QStringLiteral("hold still: about to take");
  }
  return places.tooFar_m(tracker.live) ? QStringLiteral("not at the place: carry the sensor here")
                                       : QStringLiteral("press space to take");
}

}  // namespace fieldtrue::acquisition
