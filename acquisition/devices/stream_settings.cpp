#include "acquisition/devices/stream_settings.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "acquisition/devices/line_address.h"

namespace fieldtrue::acquisition {
namespace {

tl::unexpected<Error> wrongSetting(const std::string& key, const std::string& text, const std::string& needed) {
  return fail(ErrorCode::kBadInput, "its setting " + key + " is '" + text + "'; it must be " + needed);
}

/// Takes a whole number from the front of the text.
bool takeWhole(std::string_view& text, int& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

}  // namespace

Result<std::string> streamText(const StreamSettings& settings, const std::string& key) {
  const auto found = settings.find(key);
  if (found == settings.end()) return fail(ErrorCode::kBadInput, "its setting " + key + " is missing");
  return found->second;
}

Result<double> streamNumber(const StreamSettings& settings, const std::string& key) {
  FT_TRY(const std::string text, streamText(settings, key));
  double number = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error == std::errc() && end == text.data() + text.size() && std::isfinite(number)) return number;
  return wrongSetting(key, text, "a number");
}

Result<bool> streamFlag(const StreamSettings& settings, const std::string& key) {
  FT_TRY(const std::string text, streamText(settings, key));
  if (text == "yes" || text == "no") return text == "yes";
  return wrongSetting(key, text, "yes or no");
}

Result<std::vector<int>> streamStations(const StreamSettings& settings, int most) {
  FT_TRY(const std::string text, streamText(settings, "stations"));
  const auto stations = readStations({{"stations", text}}, "trace", most);
  if (stations && !stations->empty()) return *stations;
  return wrongSetting("stations", text, "numbers from 1 to " + std::to_string(most) + " joined by +");
}

Result<std::map<int, int>> streamSensors(const StreamSettings& settings) {
  FT_TRY(const std::string text, streamText(settings, "sensors"));
  std::map<int, int> sensors;
  std::string_view rest = text;
  while (true) {
    int name = 0, sensor = 0;
    bool good = takeWhole(rest, name) && rest.starts_with('=');
    if (good) rest.remove_prefix(1);
    good = good && takeWhole(rest, sensor) && (rest.empty() || rest.starts_with('+'));
    if (!good) return wrongSetting("sensors", text, "pairs such as 10=0+11=1");
    sensors[name] = sensor;
    if (rest.empty()) return sensors;
    rest.remove_prefix(1);
  }
}

std::string sensorsText(const std::map<int, int>& sensors) {
  std::string text;
  for (const auto& [name, sensor] : sensors) {
    text += (text.empty() ? "" : "+") + std::to_string(name) + "=" + std::to_string(sensor);
  }
  return text;
}

}  // namespace fieldtrue::acquisition
