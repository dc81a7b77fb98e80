#include <algorithm>

#include "acquisition/session/acquisition_impl.h"

/// What the views are told, and when.
namespace fieldtrue {

namespace {

constexpr qint64 kStatusInterval_ms = 34;
/// Values with many places cost time to copy: the interval grows by this for each.
constexpr double kStatusPerPlace_ms = 0.02;

}  // namespace

void AcquisitionController::Impl::changed() {
  if (status_timer.isActive()) return;
  const auto interval_ms =
      std::max(kStatusInterval_ms, static_cast<qint64>(kStatusPerPlace_ms * static_cast<double>(states.size())));
  const qint64 elapsed_ms = since_status.isValid() ? since_status.elapsed() : interval_ms;
  status_timer.start(static_cast<int>(std::max<qint64>(0, interval_ms - elapsed_ms)));
}

void AcquisitionController::Impl::emitStatus() {
  since_status.start();
  emit owner->statusChanged(status());
}

AcquisitionStatus AcquisitionController::Impl::status() const {
  AcquisitionStatus result;
  if (store) {
    result.session_path = store->path();
    result.places = store->places();
  }
  result.states = states;
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
  result.n_done = static_cast<std::size_t>(std::count_if(states.begin(), states.end(), [](PlaceState state) {
    return state == PlaceState::kDone || state == PlaceState::kSuspicious;
  }));
  result.n_skipped = static_cast<std::size_t>(std::count(states.begin(), states.end(), PlaceState::kSkipped));
  result.can_undo = can_undo;
  result.can_redo = can_redo;
  return result;
}

QString AcquisitionController::Impl::reason(bool* attention) const {
  *attention = false;
  if (!store) return QStringLiteral("make a plan or open a session");
  if (!failure.isEmpty()) {
    *attention = true;
    return failure;
  }
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
  return automatic ? automaticReason() : QStringLiteral("press space to take");
}

QString AcquisitionController::Impl::automaticReason() const {
  if (guess.known && !near()) return QStringLiteral("still, but not at the place: move it here; or press space");
  return QStringLiteral("hold still: about to take");
}

std::optional<double> AcquisitionController::Impl::distanceToCurrent_m() const {
  if (!live || !isGood(*live) || !store || !current) return std::nullopt;
  const Eigen::Vector3d here_m = guess.reference_from_tracker * live->tracker_from_sensor.position_m;
  return (here_m - store->places()[*current].reference_from_sensor.position_m).norm();
}

double AcquisitionController::Impl::rate_hz() const {
  if (recent_times_s.size() < 2 || !live) return 0.0;
  const double span_s = recent_times_s.back() - recent_times_s.front();
  return span_s > 0.0 ? static_cast<double>(recent_times_s.size() - 1) / span_s : 0.0;
}

std::string AcquisitionController::Impl::currentName() const { return placeName(store->places()[*current]); }

}  // namespace fieldtrue
