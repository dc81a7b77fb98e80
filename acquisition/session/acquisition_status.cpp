#include <algorithm>

#include "acquisition/plan/place_state.h"
#include "acquisition/sampling/stillness.h"
#include "acquisition/session/acquisition_impl.h"

/// What the views are told, and when.
namespace fieldtrue::acquisition {

namespace {

constexpr qint64 kStatusInterval_ms = 34;

}  // namespace

void AcquisitionController::Impl::changed() {
  if (status_timer.isActive()) return;
  const qint64 elapsed_ms = since_status.isValid() ? since_status.elapsed() : kStatusInterval_ms;
  status_timer.start(static_cast<int>(std::max<qint64>(0, kStatusInterval_ms - elapsed_ms)));
}

void AcquisitionController::Impl::emitStatus() {
  since_status.start();
  emit owner->statusChanged(status());
}

std::shared_ptr<const PlannedSession> AcquisitionController::Impl::plannedSession() const {
  if (!store) return std::make_shared<PlannedSession>();
  return std::make_shared<PlannedSession>(PlannedSession{store->path(), store->isReadOnly(), store->places()});
}

std::shared_ptr<const RecordedPlaces> AcquisitionController::Impl::recordedPlaces() const {
  auto recorded = std::make_shared<RecordedPlaces>();
  if (store) recorded->revision = revision;
  recorded->states = states;
  for (const auto& [place, off_m] : misfits) {
    recorded->misfits.push_back({place, off_m});
    if (states[place] == PlaceState::kDone) recorded->states[place] = PlaceState::kSuspicious;
  }
  for (const PlaceState state : states) {
    recorded->n_done += state == PlaceState::kDone || state == PlaceState::kSuspicious ? 1 : 0;
    recorded->n_skipped += state == PlaceState::kSkipped ? 1 : 0;
  }
  recorded->can_undo = can_undo;
  recorded->can_redo = can_redo;
  return recorded;
}

AcquisitionStatus AcquisitionController::Impl::status() const {
  if (!told_session) told_session = plannedSession();
  if (!told_recorded) told_recorded = recordedPlaces();
  AcquisitionStatus result;
  result.session = told_session;
  result.recorded = told_recorded;
  result.current = current;
  result.current_is_retake = current && states[*current] != PlaceState::kPlanned;
  result.take = failure.isEmpty() ? sampler.state() : TakeState::kFailed;
  result.collected = sampler.collected();
  result.wanted = options.samples_per_node;
  result.automatic = automatic;
  result.still = stillness.still();
  result.reason = reason(&result.attention);
  result.device = device_state;
  result.device_text = device_text;
  result.live = live;
  result.rate_hz = rate_hz();
  result.sd_m = stillness.spread_m();
  result.reference_from_tracker = guess.reference_from_tracker;
  result.reference_known = guess.known;
  result.distance_m = distanceToCurrent_m();
  result.distance_known = rig.usable() || guess.known;
  result.away = tooFar_m().has_value();
  result.refused = isRefused();
  return result;
}

QString AcquisitionController::Impl::reason(bool* attention) const {
  *attention = false;
  if (!store) return QStringLiteral("make a plan or open a session");
  if (!failure.isEmpty()) {
    *attention = true;
    return failure;
  }
  if (store->isReadOnly()) return QStringLiteral("nothing can be stored: the session's file cannot be written to");
  if (device_state != DeviceState::kRunning) {
    *attention = device_state == DeviceState::kFailed;
    return device_text.isEmpty() ? QStringLiteral("connect the tracker") : device_text;
  }
  if (!live && since_sample.isValid() && since_sample.elapsed() >= 2000) {
    *attention = true;
    return QStringLiteral("the tracker stopped sending: check its line and its switch");
  }
  if (!current) return QStringLiteral("all places are done");
  if (collecting()) {
    *attention = sampler.restarts() > 0 || !stillness.still();
    const bool just_restarted = sampler.restarts() > 0 && sampler.collected() < sampler.wanted() / 2;
    if (just_restarted) return QString::fromStdString(sampler.message());
    return QStringLiteral("hold still: %1 of %2").arg(sampler.collected()).arg(sampler.wanted());
  }
  *attention = stillness.reason().starts_with("no signal");
  return waitingReason();
}

QString AcquisitionController::Impl::waitingReason() const {
  if (automatic && stand.hasTaken() && !stand.left()) return QStringLiteral("move the sensor here; or press space");
  if (!stillness.still()) return QString::fromStdString(stillness.reason());
  if (automatic) return automaticReason();
  return tooFar_m() ? QStringLiteral("not at the place: carry the sensor here") : QStringLiteral("press space to take");
}

QString AcquisitionController::Impl::automaticReason() const {
  if ((guess.known && !near()) || tooFar_m())
    return QStringLiteral("still, but not at the place: move it here; or press space");
  return QStringLiteral("hold still: about to take");
}

std::optional<double> AcquisitionController::Impl::distanceToCurrent_m() const {
  if (!live || !isGood(*live) || !store || !current) return std::nullopt;
  const Eigen::Vector3d& tracked_m = live->tracker_from_sensor.position_m;
  const Eigen::Vector3d& there_m = store->places()[*current].reference_from_sensor.position_m;
  if (rig.usable()) return rig.off_m(tracked_m, there_m);
  return (guess.reference_from_tracker * tracked_m - there_m).norm();
}

double AcquisitionController::Impl::rate_hz() const {
  if (recent_times_s.size() < 2 || !live) return 0.0;
  const double span_s = recent_times_s.back() - recent_times_s.front();
  return span_s > 0.0 ? static_cast<double>(recent_times_s.size() - 1) / span_s : 0.0;
}

std::string AcquisitionController::Impl::currentName() const { return placeName(store->places()[*current]); }

}  // namespace fieldtrue::acquisition
