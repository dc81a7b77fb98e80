#include "acquisition/session/acquisition_take.h"

#include <cmath>
#include <map>

#include "acquisition/session/acquisition_impl.h"

/// The takes: begun, fed with readings, stored, failed or refused.
namespace fieldtrue::acquisition {

namespace {

constexpr double kRestUnknown_s = 0.7;  ///< Rest before an automatic take while the frame relation is unknown.
constexpr double kRestNear_s = 0.2;     ///< The same beside a place whose position is known.
constexpr double kRestFound_s = 3.0;    ///< The same for a sensor found standing at the very start.
constexpr double kLookEvery_s = 0.02;   ///< Stillness is judged no oftener, for that takes a while.
constexpr double kFailureShown_s = 8.0;
constexpr int kTimesAgain = 2;  ///< A take whose time is over is taken again by itself.

}  // namespace

void RunningTake::start(const std::vector<int>& sensors, bool is_away) {
  forgetFailure();
  taken_away = is_away;
  sampler = TakeSampler(options);
  sampler.start(sensors);
  awaits_rest = mayMove();
}

bool RunningTake::mayMove() const {
  const Rest rest = stillness.rest();
  return rest == Rest::kMoving || rest == Rest::kWatching;
}

TakeState RunningTake::add(const Sample& sample, bool is_judged) {
  awaits_rest = awaits_rest && (!is_judged || mayMove());
  if (awaits_rest) return sampler.passOver(sample);
  const int restarts = sampler.restarts(), collected = sampler.collected();
  const TakeState state = sampler.add(sample);
  awaits_rest = sampler.restarts() > restarts || sampler.collected() < collected;
  // Of the rest before the motion nothing counts.
  if (awaits_rest) stillness.clear();
  return state;
}

void RunningTake::forgetFailure() {
  failure.clear();
  refused_at.reset();
  not_stored = false;
}

void RunningTake::stayStopped(const std::optional<Sample>& live) {
  stand.setStopped(live && isGood(*live) ? std::optional(live->tracker_from_sensor) : std::nullopt);
}

bool RunningTake::watch(const Sample& sample, bool has_session) {
  stillness.add(sample);
  const bool look = !looked_at_s || std::abs(sample.time_s - *looked_at_s) >= kLookEvery_s;
  if (look) looked_at_s = sample.time_s;
  if (has_session && (automatic || held())) {
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
  const bool look = tracker.leads(sample) && follow(sample);
  if (!other_names.empty()) return;
  if (take.collecting()) return collect(sample, look);
  keepLoose(loose.between(sample));
  if (take.held()) return watchHeldTake();
  if (take.automatic && look) considerAutomaticTake();
}

void AcquisitionController::Impl::collect(const Sample& sample, bool is_judged) {
  const bool awaited_rest = take.awaits_rest;
  const TakeState state = take.add(sample, is_judged);
  if (awaited_rest && take.awaits_rest) keepLoose(loose.between(sample));
  // Asked for on the way, it is judged where the jig came to rest.
  const bool just_rests = awaited_rest && !take.awaits_rest && !take.taken_away;
  if (const auto off_m = just_rests ? places.tooFar_m(tracker.live) : std::nullopt) {
    stopTake();
    return refuse(*off_m);
  }
  endTake(state);
}

bool AcquisitionController::Impl::follow(const Sample& sample) {
  tracker.add(sample);
  const bool look = take.watch(sample, store.has_value());
  const bool over =
      sample.time_s - take.failure_time_s > kFailureShown_s || (take.refused_at && !places.tooFar_m(tracker.live));
  if (!take.failure.isEmpty() && !take.not_stored && over) take.forgetFailure();
  return look;
}

void AcquisitionController::Impl::endTake(TakeState state) {
  if (state == TakeState::kDone) finishTake();
  if (state == TakeState::kFailed) failTake(take.sampler.message());
  if (state == TakeState::kHeld) atTimeLimit();
}

void AcquisitionController::Impl::atTimeLimit() {
  if (take.at_time_limit == AtTimeLimit::kAsk) return ask();
  if (take.at_time_limit == AtTimeLimit::kKeep && take.sampler.canKeep()) return keepTake();
  if (take.at_time_limit == AtTimeLimit::kSkip) return skip(take.sampler.message());
  const auto place = places.current;
  const bool again = take.at_time_limit == AtTimeLimit::kAgain && take.times_again < kTimesAgain;
  failTake(take.sampler.message());
  // Who was told may have gone on to another place.
  if (!again || places.current != place || take.runs()) return;
  ++take.times_again;
  take.start(tracker.sensors, take.taken_away);
}

void AcquisitionController::Impl::ask() {
  const QString why = QString::fromStdString(take.sampler.message());
  note("take held", placeName(places.here()) + ": " + take.sampler.message());
  // Where it stands now is what it is carried on from.
  take.stand.forget();
  views.tellSoon();
  emit owner->takeHeld(static_cast<int>(*places.current), why, take.sampler.canKeep());
}

void AcquisitionController::Impl::watchHeldTake() {
  if (!take.stand.left()) return;
  if (take.sampler.canKeep()) return keepTake();
  failTake(take.sampler.message() + "; the jig was carried on");
}

void AcquisitionController::Impl::keepTake() {
  take.sampler.keep();
  endTake(take.sampler.state());
}

void AcquisitionController::Impl::waitLonger() {
  take.sampler.waitLonger();
  take.awaits_rest = take.mayMove();
  views.tellSoon();
}

void AcquisitionController::Impl::takeAgain() {
  stopTake();
  take.start(tracker.sensors, take.taken_away);
  views.tellSoon();
}

void AcquisitionController::Impl::skip(const std::string& why) {
  take.forgetFailure();
  stopTake();
  if (!told(store->skip(*places.current, why))) return;
  if (told(reloadPlace(*places.current))) advance();
}

void AcquisitionController::Impl::considerAutomaticTake() {
  if (!store || store->isReadOnly() || !places.current || !tracker.running() || take.not_stored) return;
  if (take.waitedInVain(*tracker.live)) failTake(take.stillness.reason());
  if (!tracker.silentSensors().empty()) return;
  if (places.current && take.hasRested(places.guess.known) && !places.isElsewhere(tracker.live))
    take.start(tracker.sensors, false);
}

void AcquisitionController::Impl::stopTake() {
  if (store && places.current) {
    const int node = places.here().node;
    for (const TakeSampler::OfSensor& one : take.sampler.ofSensors()) {
      keepLoose(loose.cancelled(node, one.sampler.abandoned()));
      keepLoose(loose.cancelled(node, one.sampler.samples()));
      keepLoose(loose.cancelled(node, one.sampler.watched()));
    }
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

void AcquisitionController::Impl::failToStore(const std::string& why) {
  take.not_stored = true;
  failTake("not stored: " + why);
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

std::string AcquisitionController::Impl::suspicionOfTake(std::size_t place) const {
  std::vector<std::string> reasons;
  const auto& of_sensors = take.sampler.ofSensors();
  const int leading = of_sensors.front().sensor;
  std::map<int, Eigen::Vector3d> means_m;
  for (const TakeSampler::OfSensor& one : of_sensors) means_m[one.sensor] = one.sampler.statistics()->mean.position_m;
  for (const TakeSampler::OfSensor& one : of_sensors) {
    // All started over together: that is said once.
    const int restarts = one.sensor == leading ? one.sampler.restarts() : 0;
    const bool is_behind = one.sensor != leading && places.staysBehind(place, means_m, leading, one.sensor);
    for (const std::string& reason :
         {std::string(is_behind ? "was not carried with the jig; leave it out of a new session" : ""),
          suspicionOf(*one.sampler.statistics(), restarts, places.neighbours(place, one.sensor)),
          one.sampler.message()})
      if (!reason.empty()) reasons.push_back(take.sampler.told(one, reason));
  }
  if (take.taken_away) reasons.emplace_back("taken away from its place, as asked");
  std::string text;
  for (const std::string& reason : reasons) text += (text.empty() ? "" : "; ") + reason;
  return text;
}

void AcquisitionController::Impl::finishTake() {
  const std::size_t place = *places.current;
  const std::string suspicious = suspicionOfTake(place);
  std::vector<SensorTake> sensors;
  for (const TakeSampler::OfSensor& one : take.sampler.ofSensors())
    sensors.push_back({one.sampler.samples(), *one.sampler.statistics()});
  const auto stored = store->storeTake(place, sensors, suspicious);
  if (!stored) return failToStore(stored.error().message);
  told(markOtherTracker());
  for (const TakeSampler::OfSensor& one : take.sampler.ofSensors())
    keepLoose(loose.cancelled(store->places()[place].node, one.sampler.abandoned()));
  take.sampler.cancel();
  stopTake();
  take.stand.setTaken(sensors.front().statistics.mean);
  const auto reread = reloadPlace(place);
  if (!reread) return failTake("stored, but it cannot be read back: " + reread.error().message);
  if (!takes_settle_sensors) settleSensors();
  const std::vector<Node> nodes = places.rows[place];
  setCurrent(places.next());
  emit owner->nodesStored(static_cast<int>(place), nodes, QString::fromStdString(suspicious));
  if (!places.current) emit owner->finished();
}

}  // namespace fieldtrue::acquisition
