#include "acquisition/session/sensor_names.h"

#include <algorithm>
#include <charconv>
#include <optional>

namespace fieldtrue::acquisition {

namespace {

/// Of a key as `openigtlink_sensor_1`: there they are counted from 1.
std::optional<int> sensorOfKey(const std::string& key) {
  constexpr std::string_view kMark = "_sensor_";
  const std::size_t mark = key.rfind(kMark);
  if (mark == std::string::npos) return std::nullopt;
  const char* const end = key.data() + key.size();
  int number = 0;
  const auto [read_to, error] = std::from_chars(key.data() + mark + kMark.size(), end, number);
  return error == std::errc() && read_to == end && number > 0 ? std::optional(number - 1) : std::nullopt;
}

/// Without the type of message behind it: `Probe (TDATA)` sent as `Probe (TRANSFORM)` is the same sensor.
std::string nameAlone(const std::string& text) { return text.substr(0, text.rfind(" (")); }

}  // namespace

std::map<int, std::string> sensorNames(const TableMetadata& metadata) {
  std::map<int, std::string> names;
  for (const auto& [key, text] : metadata.other)
    if (const auto sensor = sensorOfKey(key)) names[*sensor] = nameAlone(text);
  return names;
}

void forgetSensorNames(TableMetadata& metadata) {
  std::erase_if(metadata.other, [](const auto& one) { return sensorOfKey(one.first).has_value(); });
}

std::string otherNamesText(const std::vector<int>& sensors, const std::map<int, std::string>& then,
                           const std::map<int, std::string>& now) {
  std::string text;
  for (const int sensor : sensors) {
    const auto was = then.find(sensor), is = now.find(sensor);
    if (was == then.end() || is == now.end() || was->second == is->second) continue;
    text += (text.empty() ? "Sensor " : ", sensor ") + std::to_string(sensor) + " was " + was->second +
            " in this session and is " + is->second + " now";
  }
  return text.empty()
             ? text
             : text + ": nothing is recorded; connect them in the order of the session, or begin a new session.";
}

}  // namespace fieldtrue::acquisition
