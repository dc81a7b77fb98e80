#include "acquisition/session/recorded_sensors.h"

#include <algorithm>
#include <charconv>
#include <string_view>
#include <utility>

#include "calib/tables/table_sensors.h"

namespace fieldtrue::acquisition {

namespace {

constexpr int kMostNumber = 1000;

/// The number that is all of the text. @return -1 where it is none
int numberOf(std::string_view text) {
  int number = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? number : -1;
}

}  // namespace

bool isAmong(int sensor, const std::vector<int>& others) {
  return std::find(others.begin(), others.end(), sensor) != others.end();
}

bool areAmong(const std::vector<int>& some, const std::vector<int>& others) {
  return std::all_of(some.begin(), some.end(), [&others](int sensor) { return isAmong(sensor, others); });
}

std::vector<int> goingOn(std::vector<int> of_session, const std::vector<int>& chosen) {
  if (chosen.empty()) return of_session;
  std::vector<int> going_on = std::move(of_session);
  const int led_by = going_on.empty() ? 0 : going_on.front();
  std::erase_if(going_on, [&chosen](int sensor) { return !isAmong(sensor, chosen); });
  if (!isAmong(led_by, going_on)) std::sort(going_on.begin(), going_on.end());
  return going_on;
}

std::string goingOnText(const std::vector<int>& of_session, const std::vector<int>& going_on) {
  std::vector<int> left_out;
  for (const int sensor : of_session)
    if (!isAmong(sensor, going_on)) left_out.push_back(sensor);
  if (left_out.empty()) return "Every sensor of this session is recorded again from here on.";
  std::string text = sensorsText(left_out) + (left_out.size() == 1 ? " is" : " are") +
                     " left out of this session from here on: what is taken now has no rows of " +
                     (left_out.size() == 1 ? "it." : "them.");
  text[0] = 'S';
  if (going_on.front() != of_session.front()) text += " Sensor " + std::to_string(going_on.front()) + " leads.";
  return text;
}

Result<std::vector<int>> readSensors(const std::string& text) {
  std::vector<int> sensors;
  if (text.empty() || text == "all") return sensors;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t end = std::min(text.find('+', from), text.size());
    const int sensor = numberOf(text.substr(from, end - from));
    if (sensor < 0 || sensor > kMostNumber)
      return fail(ErrorCode::kBadInput, "'" + text + "' names no sensors: all, 0 or 0+2 (numbers up to 1000) do");
    if (std::find(sensors.begin(), sensors.end(), sensor) != sensors.end())
      return fail(ErrorCode::kBadInput, "'" + text + "' names sensor " + std::to_string(sensor) + " twice");
    sensors.push_back(sensor);
    from = end + 1;
  }
  return sensors;
}

std::string textOf(const std::vector<int>& sensors) {
  std::string text = sensors.empty() ? "all" : "";
  for (const int sensor : sensors) text += (text.empty() ? "" : "+") + std::to_string(sensor);
  return text;
}

}  // namespace fieldtrue::acquisition
