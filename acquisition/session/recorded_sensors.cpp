#include "acquisition/session/recorded_sensors.h"

#include <algorithm>
#include <charconv>
#include <string_view>

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
