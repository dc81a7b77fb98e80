#include <algorithm>
#include <cmath>

#include "acquisition/sampling/stillness.h"
#include "acquisition/session/acquisition_impl.h"
#include "acquisition/session/guarded_call.h"

/// The device half of the controller: samples in, takes out.
namespace fieldtrue::acquisition {

namespace {

constexpr double kRestUnknown_s = 0.7;  ///< Rest before an automatic take while the frame relation is unknown.
constexpr double kRestNear_s = 0.2;     ///< The same beside a place whose position is known.
constexpr double kRestFound_s = 3.0;    ///< The same for a sensor found standing at the very start.
constexpr qint64 kSilence_ms = 3000;    ///< No reading for so long: the line is dead.
constexpr double kLookEvery_s = 0.02;   ///< Stillness is judged no oftener, for that takes a while.
constexpr double kFailureShown_s = 8.0;
constexpr std::size_t kRateReadings = 120;
constexpr std::size_t kNeighbours = 6;
constexpr int kFirstRetry_ms = 500;
constexpr int kLastRetry_ms = 8000;

}  // namespace

void AcquisitionController::Impl::adopt(std::unique_ptr<TrackerDevice> next, const Pose& believed) {
  FT_CHECK(next != nullptr);
  dropDevice();
  device = std::move(next);
  believed_reference = believed;
  updateGuess();
  QObject::connect(device.get(), &TrackerDevice::stateChanged, owner, [this](DeviceState state, const QString& text) {
    guarded(*owner, [&] { onDeviceState(state, text); });
  });
  QObject::connect(device.get(), &TrackerDevice::samplesReceived, owner,
                   [this](const std::vector<Sample>& samples) { guarded(*owner, [&] { onSamples(samples); }); });
  device->start();
  changed();
}

void AcquisitionController::Impl::dropDevice() {
  silence_timer.stop();
  retry_timer.stop();
  lost = false;
  if (!device) return;
  if (collecting()) failTake("the tracker was disconnected; nothing of this take was stored");
  QObject::disconnect(device.get(), nullptr, owner, nullptr);
  device->stop();
  // It may be on the call stack below us.
  device.release()->deleteLater();
  device_state = DeviceState::kClosed;
  device_text.clear();
  live.reset();
  stillness.clear();
}

void AcquisitionController::Impl::onDeviceState(DeviceState state, const QString& text) {
  if (lost && state != DeviceState::kRunning) {
    // Why it was lost stays to be read; what the attempts to reach it meet is of no use to anybody.
    if (state == DeviceState::kFailed) retryLater();
    return;
  }
  const bool was_lost = lost;
  const bool breaks = state == DeviceState::kFailed && device_state == DeviceState::kRunning;
  lost = breaks && reconnects;
  const bool was_collecting = collecting();
  const bool same = state == device_state && text == device_text;
  const bool begins = state == DeviceState::kRunning && device_state != DeviceState::kRunning;
  device_state = state;
  device_text = text;
  const QString why = text.endsWith(QLatin1Char('.')) ? text.chopped(1) : text;
  if (lost) device_text = why + QStringLiteral(" (trying again by itself)");
  if (begins) beginStream();
  if (state != DeviceState::kRunning) {
    silence_timer.stop();
    live.reset();
    stillness.clear();
    if (state == DeviceState::kFailed && !same) emit owner->deviceFailed(device_text);
    if (was_collecting) failTake("the tracker was lost: " + why.toStdString() + ". Nothing of this take was stored");
  }
  if (state == DeviceState::kFailed && !same) {
    note("device", "failed: " + text.toStdString());
  }
  if (lost) {
    retries = 0;
    retryLater();
  }
  if (was_lost) emit owner->deviceBack();
  changed();
}

void AcquisitionController::Impl::retryLater() {
  retry_timer.start(std::min(kFirstRetry_ms << std::min(retries, 8), kLastRetry_ms));
  ++retries;
}

void AcquisitionController::Impl::beginStream() {
  sensor.reset();
  time_offset_s.reset();
  recent_times_s.clear();
  stillness.clear();
  since_sample.start();
  silence_timer.start();
  failure.clear();
  mergeMetadata();
  remarkOnTracker();
  updateGuess();
  note("device", "running: " + device_text.toStdString());
  guide();
}

void AcquisitionController::Impl::guide() {
  if (device && device_state == DeviceState::kRunning && store && current) {
    device->guideTo(store->places()[*current].reference_from_sensor);
  }
}

void AcquisitionController::Impl::checkSilence() {
  if (device_state != DeviceState::kRunning || since_sample.elapsed() < kSilence_ms) return;
  live.reset();
  stillness.clear();
  if (collecting()) failTake("the tracker stopped sending; nothing of this take was stored");
  changed();
}

double AcquisitionController::Impl::sessionTime_s(double device_time_s) {
  if (!store) return device_time_s;
  if (!time_offset_s) {
    const auto newest = store->newestSample_s();
    if (!newest) emit owner->failed(QString::fromStdString(newest.error().message));
    const double wall_s = 1e-3 * static_cast<double>(store->created().msecsTo(now()));
    // A session that goes on keeps its clock, across reconnections and days, and never steps back.
    const double begin_s = newest && newest->has_value() ? std::max(wall_s, newest->value() + 1.0) : 0.0;
    time_offset_s = begin_s - device_time_s;
  }
  return device_time_s + *time_offset_s;
}

void AcquisitionController::Impl::onSamples(const std::vector<Sample>& samples) {
  since_sample.start();
  for (Sample sample : samples) {
    if (!sensor) sensor = sample.sensor;
    if (sample.sensor != *sensor) continue;
    sample.time_s = sessionTime_s(sample.time_s);
    addSample(sample);
  }
  changed();
}

void AcquisitionController::Impl::addSample(const Sample& sample) {
  live = sample;
  recent_times_s.push_back(sample.time_s);
  if (recent_times_s.size() > kRateReadings) recent_times_s.pop_front();
  stillness.add(sample);
  const bool look = !looked_at_s || std::abs(sample.time_s - *looked_at_s) >= kLookEvery_s;
  if (look) looked_at_s = sample.time_s;
  if (store && automatic) {
    if (look) stood_still = stillness.still();
    stand.add(sample, stood_still);
  }
  const bool over = sample.time_s - failure_time_s > kFailureShown_s || (refused_at && !tooFar_m());
  if (!failure.isEmpty() && over) {
    failure.clear();
    refused_at.reset();
  }
  if (collecting()) {
    const TakeState after = sampler.add(sample);
    if (after == TakeState::kDone) finishTake();
    if (after == TakeState::kFailed) failTake(sampler.message());
  } else {
    keepLoose(loose.between(sample));
    if (automatic && look) considerAutomaticTake();
  }
}

void AcquisitionController::Impl::considerAutomaticTake() {
  if (!store || store->isReadOnly() || !current || device_state != DeviceState::kRunning) return;
  checkNoSignal();
  if (!current || !stood_still) return;
  if (stand.hasTaken() && !stand.left()) return;
  const double wanted_rest_s = guess.known ? kRestNear_s : stand.left() ? kRestUnknown_s : kRestFound_s;
  if (stand.rested_s() >= wanted_rest_s && (!guess.known || near()) && !tooFar_m()) startTake();
}

void AcquisitionController::Impl::checkNoSignal() {
  const bool usable = isGood(*live);
  if (usable || !waiting_since_s) waiting_since_s = live->time_s;
  if (live->time_s - *waiting_since_s < options.time_limit_s) return;
  waiting_since_s = live->time_s;
  failTake(stillness.reason());
}

bool AcquisitionController::Impl::near() const {
  const auto distance_m = distanceToCurrent_m();
  return distance_m && *distance_m <= near_m;
}

void AcquisitionController::Impl::startTake() {
  failure.clear();
  refused_at.reset();
  taken_away = false;
  sampler = NodeSampler(options);
  sampler.start();
  changed();
}

void AcquisitionController::Impl::stopTake() {
  keepCancelledTake();
  sampler.cancel();
  waiting_since_s.reset();
}

void AcquisitionController::Impl::failTake(const std::string& why) {
  const std::string text = (current ? currentName() + ": " : std::string()) + why;
  stopTake();
  failure = QString::fromStdString(text);
  failure_time_s = recent_times_s.empty() ? 0.0 : recent_times_s.back();
  note("take failed", text);
  changed();
  emit owner->takeFailed(failure, current ? static_cast<int>(*current) : -1);
}

void AcquisitionController::Impl::finishTake() {
  const std::size_t place = *current;
  const NodeStatistics statistics = *sampler.statistics();
  std::string suspicious = suspicionOf(statistics, sampler.restarts(), neighbours(place));
  if (taken_away) suspicious += (suspicious.empty() ? "" : "; ") + std::string("taken away from its place, as asked");
  const auto stored = store->storeTake(place, sampler.samples(), statistics, suspicious);
  if (!stored) {
    failTake("not stored: " + stored.error().message);
    return;
  }
  told(markOtherTracker());
  keepLoose(loose.cancelled(store->places()[place].node, sampler.abandoned()));
  sampler.cancel();
  stopTake();
  stand.setTaken(statistics.mean);
  if (const auto reread = reloadPlace(place); !reread) {
    failTake("stored, but it cannot be read back: " + reread.error().message);
    return;
  }
  const Node node = nodes[place].value();
  setCurrent(nextPlace());
  emit owner->nodeStored(static_cast<int>(place), node, QString::fromStdString(suspicious));
  if (!current) emit owner->finished();
}

std::vector<NeighbourTake> AcquisitionController::Impl::neighbours(std::size_t place) const {
  std::vector<NeighbourTake> takes;
  for (const std::size_t other : nearestTakes(place, kNeighbours + 1)) {
    if (other == place || takes.size() == kNeighbours) continue;
    const Node& node = *nodes[other];
    takes.push_back({std::sqrt(node.covariance_m2->trace()), node.tracker_from_sensor.position_m.norm()});
  }
  return takes;
}

}  // namespace fieldtrue::acquisition
