#include <optional>
#include <utility>

#include "acquisition/session/acquisition_impl.h"
#include "acquisition/session/recorded_sensors.h"
#include "calib/tables/table_sensors.h"

/// Which sensors a session records, and what is told of those that it does not.
namespace fieldtrue::acquisition {

void AcquisitionController::Impl::settleSensors() {
  sensors_of_session = places.sensors();
  std::vector<int> settled = sensorsOfSession();
  takes_settle_sensors = !settled.empty();
  leadPlaces(settled);
  if (settled.empty() && store) settled = sensorsOfState(kSensorsState);
  if (settled.empty()) settled = tracker.asked_sensors;
  sensors_are_settled = !settled.empty();
  // Before a stream is heard, and where it is not heard any more, it stays as it was.
  if (settled.empty())
    settled = tracker.sensors.empty() || tracker.heard.empty() ? tracker.sensors : tracker.reporting();
  if (settled == tracker.sensors) return;
  stopTake();
  const bool stays_led = !settled.empty() && !tracker.sensors.empty() && settled.front() == tracker.sensors.front();
  tracker.sensors = settled;
  if (stays_led) return;
  tracker.live.reset();
  tracker.recent_times_s.clear();
  take.stillness.clear();
  // Another sensor stands elsewhere on the jig: that is no motion.
  take.stand.forget();
}

std::vector<int> AcquisitionController::Impl::sensorsOfSession() {
  std::vector<int> sensors = places.sensors();
  return sensors.empty() ? sensors : goingOn(std::move(sensors), sensorsOfState(kGoingOnState));
}

void AcquisitionController::Impl::leadPlaces(const std::vector<int>& going_on) {
  const bool some_left_out = !going_on.empty() && !sensorsOfState(kGoingOnState).empty();
  const auto leader = some_left_out ? std::optional(going_on.front()) : std::nullopt;
  if (leader == places.led_by) return;
  places.leadBy(leader);
  ++views.revision;
  views.told_recorded.reset();
}

std::vector<int> AcquisitionController::Impl::sensorsOfState(const std::string& key) {
  const auto text = store->state(key);
  const auto sensors = text ? readSensors(*text) : tl::unexpected(text.error());
  return told(sensors) ? *sensors : std::vector<int>();
}

void AcquisitionController::Impl::keepChoiceOfSensors() {
  const std::vector<int> asked = std::exchange(tracker.asked_sensors, {});
  if (asked.empty() || store->isReadOnly() || !sensorsOfState(kSensorsState).empty()) return;
  told(store->setState(kSensorsState, textOf(asked)));
}

void AcquisitionController::Impl::chooseSensors(const std::vector<int>& sensors) {
  if (!store) {
    tracker.asked_sensors = sensors;
  } else if (takes_settle_sensors) {
    goOnWith(sensors);
  } else {
    told(store->setState(kSensorsState, textOf(sensors)));
  }
  settleSensors();
  views.tellSoon();
}

void AcquisitionController::Impl::goOnWith(const std::vector<int>& sensors) {
  const std::vector<int> of_session = places.sensors(), going_on = goingOn(of_session, sensors);
  const std::vector<int> before = sensorsOfSession();
  if (!areAmong(sensors, of_session) || store->isReadOnly() || going_on == before) return;
  const int leader = before.front();
  if (!isAmong(leader, going_on) && tracker.running() && isAmong(leader, tracker.reporting()) &&
      !isAmong(leader, tracker.silentSensors())) {
    const std::string led = "Sensor " + std::to_string(leader) + " leads and reports: it cannot be left out.";
    remark(led);
    return;
  }
  if (!told(store->setState(kGoingOnState, textOf(sensors)))) return;
  const std::string text = goingOnText(of_session, going_on);
  note("tracker", text);
  remark(text);
}

void AcquisitionController::Impl::remarkOnLeftOut() {
  const std::vector<int> of_session = places.sensors(), going_on = sensorsOfSession();
  if (going_on.size() < of_session.size()) remark(goingOnText(of_session, going_on));
}

void AcquisitionController::Impl::noticeLate(const Sample& sample) {
  if (tracker.joinsLate(sample) && !isAmong(sample.sensor, tracker.sensors)) late_sensors.push_back(sample.sensor);
  if (!takes_settle_sensors) return;
  for (const int late : std::exchange(late_sensors, {})) {
    const std::string sensor = "Sensor " + std::to_string(late);
    const std::string text =
        isAmong(late, places.sensors())
            ? sensor + " reports again and is left out of this session: tick it on Connect to record it again."
            : sensor + " reports and is not recorded in this session: its takes settled that " +
                  fieldtrue::sensorsText(tracker.sensors) + (tracker.sensors.size() == 1 ? " is" : " are") + ".";
    note("tracker", text);
    remark(text);
  }
}

void AcquisitionController::Impl::remarkOnMissing() {
  const std::vector<int> missing = tracker.missingSensors();
  if (missing.empty()) return;
  tracker.told_missing = true;
  const bool is_one = missing.size() == 1;
  std::string text = fieldtrue::sensorsText(missing) + (is_one ? " is" : " are") +
                     " recorded in this session, and the tracker does not send " + (is_one ? "it" : "them") +
                     ", only " + fieldtrue::sensorsText(tracker.reporting()) + ": plug " + (is_one ? "it" : "them") +
                     " in again, or go on without (untick it on Connect; acquire --sensor).";
  text[0] = 'S';
  remark(text);
}

}  // namespace fieldtrue::acquisition
