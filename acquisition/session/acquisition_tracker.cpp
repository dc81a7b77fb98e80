#include "acquisition/session/acquisition_tracker.h"

#include <algorithm>
#include <utility>

#include "acquisition/protocols/sample_status.h"
#include "acquisition/session/acquisition_impl.h"
#include "acquisition/session/guarded_call.h"
#include "acquisition/session/recorded_sensors.h"
#include "acquisition/session/sensor_names.h"
#include "calib/tables/metadata_keys.h"
#include "calib/tables/table_json.h"
#include "calib/tables/table_metadata.h"

/// The tracker and its stream, and what the session tells of it.
namespace fieldtrue::acquisition {

namespace {

constexpr int kSilenceCheck_ms = 250;
constexpr qint64 kSilence_ms = 3000;  ///< No reading for so long: the line is dead.
constexpr std::size_t kRateReadings = 120;
constexpr int kFirstRetry_ms = 500;
constexpr int kLastRetry_ms = 8000;
constexpr qint64 kReturnShown_ms = 4000;
constexpr int kTimesHeard = 3;
constexpr int kMissedAfter = 30;  ///< Readings of another sensor.

}  // namespace

TrackerLink::TrackerLink(QObject* receiver) : owner(receiver), silence_timer(receiver), retry_timer(receiver) {
  silence_timer.setInterval(kSilenceCheck_ms);
  retry_timer.setSingleShot(true);
}

bool TrackerLink::silent() const { return running() && since_sample.elapsed() >= kSilence_ms; }

bool TrackerLink::justReturned() const {
  return running() && since_return.isValid() && since_return.elapsed() < kReturnShown_ms;
}

double TrackerLink::rate_hz() const {
  if (recent_times_s.size() < 2 || !live) return 0.0;
  const double span_s = recent_times_s.back() - recent_times_s.front();
  return span_s > 0.0 ? static_cast<double>(recent_times_s.size() - 1) / span_s : 0.0;
}

void TrackerLink::retryLater() {
  retry_timer.start(std::min(kFirstRetry_ms << std::min(retries, 8), kLastRetry_ms));
  ++retries;
}

void TrackerLink::beginStream() {
  heard.clear();
  newest_s.clear();
  began_s.reset();
  now_s.reset();
  told_missing = false;
  unsorted.clear();
  time_offset_s.reset();
  recent_times_s.clear();
  since_sample.start();
  silence_timer.start();
}

std::vector<Sample> TrackerLink::recorded(const Sample& sample, bool takes_newcomers) {
  const auto is_recorded = [&] { return isAmong(sample.sensor, sensors); };
  // That it is gone is no report of it.
  if (sample.status == kStatusUnplugged) return is_recorded() ? std::vector{sample} : std::vector<Sample>();
  int& times = heard[sample.sensor];
  times = std::min(times + 1, kMissedAfter);
  newest_s[sample.sensor] = sample.time_s;
  now_s = sample.time_s;
  if (!began_s) began_s = now_s;
  if (sensors.empty()) {
    unsorted.push_back(sample);
    // Sensors report in turn: by then each has, even if a line lost its first reading.
    if (times < kTimesHeard) return {};
    sensors = reporting();
    return std::exchange(unsorted, {});
  }
  // Behind the others: which one leads does not change under the operator's hands.
  if (takes_newcomers && times == kTimesHeard && !is_recorded()) sensors.push_back(sample.sensor);
  return is_recorded() ? std::vector{sample} : std::vector<Sample>();
}

std::vector<int> TrackerLink::reporting() const {
  std::vector<int> sensors_heard;
  for (const auto& [sensor, times] : heard) sensors_heard.push_back(sensor);
  return sensors_heard;
}

std::vector<int> TrackerLink::silentSensors() const {
  std::vector<int> silent;
  for (const int sensor : sensors) {
    const auto newest = newest_s.find(sensor);
    const auto since_s = newest == newest_s.end() ? began_s : newest->second;
    if (since_s && *now_s - *since_s >= kSilent_s) silent.push_back(sensor);
  }
  return silent;
}

bool TrackerLink::isSure() const {
  return std::any_of(heard.begin(), heard.end(), [](const auto& one) { return one.second == kMissedAfter; });
}

bool TrackerLink::joinsLate(const Sample& sample) const {
  const auto times = heard.find(sample.sensor);
  return times != heard.end() && times->second == kTimesHeard && isSure();
}

std::vector<int> TrackerLink::missingSensors() const {
  std::vector<int> missing;
  for (const int sensor : isSure() ? sensors : std::vector<int>())
    if (!heard.contains(sensor)) missing.push_back(sensor);
  return missing;
}

void TrackerLink::add(const Sample& sample) {
  live = sample;
  recent_times_s.push_back(sample.time_s);
  if (recent_times_s.size() > kRateReadings) recent_times_s.pop_front();
}

void TrackerLink::cut() {
  if (!device) return;
  QObject::disconnect(device.get(), nullptr, owner, nullptr);
  device->stop();
}

void TrackerLink::drop() {
  last_trace = device->trace();
  cut();
  // It may be on the call stack below us.
  device.release()->deleteLater();
  state = DeviceState::kClosed;
  text.clear();
  live.reset();
}

void AcquisitionController::Impl::adopt(std::unique_ptr<TrackerDevice> next, const Pose& believed) {
  FT_CHECK(next != nullptr);
  dropDevice();
  tracker.device = std::move(next);
  places.believed_reference = believed;
  places.updateGuess();
  TrackerDevice* device = tracker.device.get();
  QObject::connect(device, &TrackerDevice::stateChanged, owner, [this](DeviceState state, const QString& text) {
    guarded(*owner, [&] { onDeviceState(state, text); });
  });
  QObject::connect(device, &TrackerDevice::samplesReceived, owner,
                   [this](const std::vector<Sample>& samples) { guarded(*owner, [&] { onSamples(samples); }); });
  device->start();
  views.tellSoon();
}

void AcquisitionController::Impl::dropDevice() {
  tracker.silence_timer.stop();
  tracker.retry_timer.stop();
  tracker.lost = false;
  tracker.since_return.invalidate();
  tracker.sensors.clear();
  other_names.clear();
  if (!tracker.device) return;
  if (take.runs()) failTake("the tracker was disconnected; this take counts for no place");
  tracker.drop();
  heard.clear();
  take.stillness.clear();
}

void AcquisitionController::Impl::onDeviceState(DeviceState state, const QString& text) {
  if (tracker.lost && state != DeviceState::kRunning) {
    // Why it was lost stays to be read; what the attempts to reach it meet is of no use to anybody.
    if (state == DeviceState::kFailed) tracker.retryLater();
    return;
  }
  const bool was_lost = tracker.lost, was_running = tracker.running(), was_taking = take.runs();
  const bool fails = state == DeviceState::kFailed && (state != tracker.state || text != tracker.text);
  const QString why = text.endsWith(QLatin1Char('.')) ? text.chopped(1) : text;
  tracker.lost = state == DeviceState::kFailed && was_running && tracker.reconnects;
  tracker.state = state;
  tracker.text = tracker.lost ? why + QStringLiteral(" (trying again by itself)") : text;
  if (state == DeviceState::kRunning) {
    if (!was_running) beginStream();
  } else {
    tracker.silence_timer.stop();
    tracker.live.reset();
    heard.clear();
    take.stillness.clear();
    if (fails) emit owner->deviceFailed(tracker.text);
    if (was_taking) failTake("the tracker was lost: " + why.toStdString() + ". This take counts for no place");
    if (fails) note("device", "failed: " + text.toStdString());
  }
  if (tracker.lost) {
    tracker.retries = 0;
    tracker.retryLater();
  }
  if (was_lost) {
    tracker.since_return.start();
    emit owner->deviceBack();
  }
  views.tellSoon();
}

void AcquisitionController::Impl::beginStream() {
  tracker.beginStream();
  settleSensors();
  take.stillness.clear();
  if (!take.not_stored) take.failure.clear();
  mergeMetadata();
  remarkOnTracker();
  places.updateGuess();
  note("device", "running: " + tracker.text.toStdString());
  guide();
}

void AcquisitionController::Impl::guide() {
  if (tracker.running() && places.current) tracker.device->guideTo(places.here().reference_from_sensor);
}

void AcquisitionController::Impl::checkSilence() {
  if (!tracker.silent()) return;
  tracker.live.reset();
  take.stillness.clear();
  if (take.collecting()) failTake("the tracker stopped sending; this take counts for no place");
  views.tellSoon();
}

QDateTime AcquisitionController::Impl::clockBegan() {
  if (clock_began) return *clock_began;
  const auto kept = store->state(kClockState);
  const auto newest = store->newestSample_s();
  const bool is_kept = told(kept) && !kept->empty();
  if (is_kept) clock_began = QDateTime::fromString(QString::fromStdString(*kept), Qt::ISODateWithMs);
  if (is_kept && clock_began->isValid()) return *clock_began;
  // Sessions with readings of which it is not kept counted from when they were made.
  clock_began = newest && *newest ? store->created() : now();
  told(store->setState(kClockState, clock_began->toString(Qt::ISODateWithMs).toStdString()));
  return *clock_began;
}

double AcquisitionController::Impl::sessionTime_s(double device_time_s) {
  if (!store) return device_time_s;
  if (!tracker.time_offset_s) {
    const auto newest = store->newestSample_s();
    told(newest);
    const double wall_s = 1e-3 * static_cast<double>(clockBegan().msecsTo(now()));
    // A session that goes on keeps its clock, across reconnections and days, and never steps back.
    const double least_s = newest && newest->has_value() ? newest->value() + 1.0 : 0.0;
    tracker.time_offset_s = std::max(wall_s, least_s) - device_time_s;
  }
  return device_time_s + *tracker.time_offset_s;
}

void AcquisitionController::Impl::onSamples(const std::vector<Sample>& samples) {
  tracker.since_sample.start();
  for (const Sample& sample : samples) {
    heard.add(sample);
    const std::vector<Sample> recorded = tracker.recorded(sample, !sensors_are_settled && !take.runs());
    if (take.collecting() && take.sampler.ofSensors().empty()) take.sampler.start(tracker.sensors);
    for (Sample of_sensor : recorded) {
      of_sensor.time_s = sessionTime_s(of_sensor.time_s);
      addSample(of_sensor);
    }
    if (recorded.empty() && !tracker.sensors.empty() && take.collecting())
      endTake(take.sampler.passTime(sessionTime_s(sample.time_s)));
    if (takes_settle_sensors && !tracker.told_missing) remarkOnMissing();
    if (!sensors_are_settled || takes_settle_sensors) noticeLate(sample);
  }
  views.tellSoon();
}

void AcquisitionController::Impl::compareTrackers(TableMetadata& known, const TableMetadata& said) {
  other_tracker.reset();
  const bool is_other = known.tracker && said.tracker && *known.tracker != *said.tracker;
  const std::string change = differenceText(known.setup, said.setup);
  if (!is_other && change.empty()) return;
  if (std::all_of(places.rows.begin(), places.rows.end(), [](const auto& rows) { return rows.empty(); })) {
    if (is_other) known.tracker = said.tracker;
    for (const auto& [key, value] : said.setup) known.setup[key] = value;
    return;
  }
  other_tracker = is_other ? *said.tracker : "a set-up with " + change;
  note("tracker", "recorded with " + *other_tracker + " from here on; the session was begun with " +
                      known.tracker.value_or("another tracker"));
}

void AcquisitionController::Impl::compareNames(TableMetadata& known, const TableMetadata& said) {
  if (places.sensors().empty()) {
    if (!sensorNames(said).empty()) forgetSensorNames(known);
    return;
  }
  other_names = otherNamesText(sensorsOfSession(), sensorNames(known), sensorNames(said));
  if (!other_names.empty()) note("tracker", other_names);
}

void AcquisitionController::Impl::remarkOnTracker() {
  if (!other_names.empty()) remark(other_names, RemarkKind::kOtherSensors);
  if (!other_tracker) return;
  remark("This session was begun with " + store->metadata().tracker.value_or("another tracker") +
         ", and what is taken now is of " + *other_tracker +
         ": one calibration of both is wrong. Connect the first again, or begin a new session.");
}

void AcquisitionController::Impl::remark(const std::string& text, RemarkKind kind) {
  emit owner->remarked(QString::fromStdString(text), kind);
}

Result<void> AcquisitionController::Impl::markOtherTracker() {
  if (!other_tracker) return {};
  TableMetadata metadata = store->metadata();
  if (!metadata.other.emplace(kOtherTracker, *other_tracker).second) return {};
  auto stored = store->setMetadata(metadata);
  if (stored) emit owner->metadataChanged(metadata);
  return stored;
}

TableMetadata AcquisitionController::Impl::said() const {
  TableMetadata said = tracker.device ? tracker.device->describe() : TableMetadata{};
  for (const auto& [key, value] : stated_setup) said.setup[key] = value;
  return said;
}

void AcquisitionController::Impl::correctSetup(const Setup& stated) {
  const Setup before = std::exchange(stated_setup, stated);
  if (!store) return;
  Setup setup = store->metadata().setup;
  for (const SetupFact& fact : setupFacts()) {
    const auto was = factOf(before, fact.key), is = factOf(stated, fact.key);
    if (was != is) told(state(setup, fact.key, is.value_or("")));
  }
  keepSetup(setup);
}

void AcquisitionController::Impl::setSetupOfTracker(const Setup& stated) {
  const Setup before = std::exchange(stated_setup, stated);
  if (!store) return;
  Setup setup = store->metadata().setup;
  for (const auto& [key, value] : stated)
    if (factOf(before, key) != value) setup[key] = value;
  keepSetup(setup);
}

void AcquisitionController::Impl::keepSetup(const Setup& setup) {
  TableMetadata metadata = store->metadata();
  if (store->isReadOnly() || metadata.setup == setup) return;
  metadata.setup = setup;
  if (told(store->setMetadata(metadata))) emit owner->metadataChanged(metadata);
}

void AcquisitionController::Impl::mergeMetadata() {
  other_names.clear();
  if (!store || store->isReadOnly() || !tracker.running()) return;
  const TableMetadata now_said = said();
  TableMetadata known = store->metadata();
  if (known.rig == kDefaultRig && now_said.rig) known.rig = now_said.rig;
  compareTrackers(known, now_said);
  compareNames(known, now_said);
  const TableMetadata both = merged(known, now_said);
  if (toJson(both) == toJson(store->metadata())) return;
  if (told(store->setMetadata(both))) emit owner->metadataChanged(both);
}

}  // namespace fieldtrue::acquisition
