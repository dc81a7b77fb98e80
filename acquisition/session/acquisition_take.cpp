#include "acquisition/session/acquisition_take.h"

#include <cmath>

#include "acquisition/session/acquisition_impl.h"

/// The takes: begun, fed with readings, stored, failed or refused.
namespace fieldtrue::acquisition {

namespace {

constexpr double kRestUnknown_s = 0.7;  ///< Rest before an automatic take while the frame relation is unknown.
constexpr double kRestNear_s = 0.2;     ///< The same beside a place whose position is known.
constexpr double kRestFound_s = 3.0;    ///< The same for a sensor found standing at the very start.
constexpr double kLookEvery_s = 0.02;   ///< Stillness is judged no oftener, for that takes a while.
constexpr double kFailureShown_s = 8.0;

}  // namespace

void RunningTake::start(bool is_away) {
  forgetFailure();
  taken_away = is_away;
  sampler = NodeSampler(options);
  sampler.start();
}

void RunningTake::forgetFailure() {
  failure.clear();
  refused_at.reset();
}

bool RunningTake::watch(const Sample& sample, bool has_session) {
  stillness.add(sample);
  const bool look = !looked_at_s || std::abs(sample.time_s - *looked_at_s) >= kLookEvery_s;
  if (look) looked_at_s = sample.time_s;
  if (has_session && automatic) {
    if (look) stood_still = stillness.still();
    stand.add(sample, stood_still);
  }
  return look;
}

bool RunningTake::hasRested(bool reference_known) const {
  if (!stood_still || isWhereTaken()) return false;
  return stand.rested_s() >= (reference_known ? kRestNear_s : stand.left() ? kRestUnknown_s : kRestFound_s);
}

bool RunningTake::waitedInVain(const Sample& live) {
  if (isGood(live) || !waiting_since_s) waiting_since_s = live.time_s;
  if (live.time_s - *waiting_since_s < options.time_limit_s) return false;
  waiting_since_s = live.time_s;
  return true;
}

void AcquisitionController::Impl::addSample(const Sample& sample) {
  tracker.add(sample);
  const bool look = take.watch(sample, store.has_value());
  const bool over =
      sample.time_s - take.failure_time_s > kFailureShown_s || (take.refused_at && !places.tooFar_m(tracker.live));
  if (!take.failure.isEmpty() && over) take.forgetFailure();
  if (take.collecting()) {
    const TakeState after = take.sampler.add(sample);
    if (after == TakeState::kDone) finishTake();
    if (after == TakeState::kFailed) failTake(take.sampler.message());
  } else {
    keepLoose(loose.between(sample));
    if (take.automatic && look) considerAutomaticTake();
  }
}

void AcquisitionController::Impl::considerAutomaticTake() {
  if (!store || store->isReadOnly() || !places.current || !tracker.running()) return;
  if (take.waitedInVain(*tracker.live)) failTake(take.stillness.reason());
  if (places.current && take.hasRested(places.guess.known) && !places.isElsewhere(tracker.live)) take.start(false);
}

void AcquisitionController::Impl::stopTake() {
  if (store && places.current && take.sampler.state() != TakeState::kIdle) {
    const int node = places.here().node;
    keepLoose(loose.cancelled(node, take.sampler.abandoned()));
    keepLoose(loose.cancelled(node, take.sampler.samples()));
  }
  take.sampler.cancel();
  take.waiting_since_s.reset();
}

void AcquisitionController::Impl::failTake(const std::string& why) {
  const std::string text = (places.current ? placeName(places.here()) + ": " : std::string()) + why;
  stopTake();
  take.failure = QString::fromStdString(text);
  take.failure_time_s = tracker.recent_times_s.empty() ? 0.0 : tracker.recent_times_s.back();
  note("take failed", text);
  views.tellSoon();
  emit owner->takeFailed(take.failure, places.current ? static_cast<int>(*places.current) : -1);
}

void AcquisitionController::Impl::refuse(double off_m) {
  take.failure =
      QStringLiteral("not taken: the sensor is not at this place. Carry it there, or press again to take it here");
  take.failure_time_s = tracker.live->time_s;
  take.refused_at = places.current;
  note("take refused", placeName(places.here()) + ": the sensor is " + std::to_string(off_m) + " m from it");
  views.tellSoon();
  emit owner->takeRefused(static_cast<int>(*places.current), off_m);
}

void AcquisitionController::Impl::finishTake() {
  const std::size_t place = *places.current;
  const NodeStatistics statistics = *take.sampler.statistics();
  std::string suspicious = suspicionOf(statistics, take.sampler.restarts(), places.neighbours(place));
  if (const std::string& short_of = take.sampler.message(); !short_of.empty())
    suspicious += (suspicious.empty() ? "" : "; ") + short_of;
  if (take.taken_away) {
    suspicious += (suspicious.empty() ? "" : "; ") + std::string("taken away from its place, as asked");
  }
  const auto stored = store->storeTake(place, take.sampler.samples(), statistics, suspicious);
  if (!stored) return failTake("not stored: " + stored.error().message);
  told(markOtherTracker());
  keepLoose(loose.cancelled(store->places()[place].node, take.sampler.abandoned()));
  take.sampler.cancel();
  stopTake();
  take.stand.setTaken(statistics.mean);
  const auto reread = reloadPlace(place);
  if (!reread) return failTake("stored, but it cannot be read back: " + reread.error().message);
  const Node node = places.nodes[place].value();
  setCurrent(places.next());
  emit owner->nodeStored(static_cast<int>(place), node, QString::fromStdString(suspicious));
  if (!places.current) emit owner->finished();
}

}  // namespace fieldtrue::acquisition
