#include "acquisition/devices/line_address.h"

#include <algorithm>
#include <charconv>

#include "calib/core/declare.h"

namespace fieldtrue::acquisition {
namespace {

std::optional<std::vector<int>> stationsOf(const std::string& text, int most) {
  std::vector<int> stations;
  const char* end = text.data() + text.size();
  const bool digits = most <= 9 && text.find('+') == std::string::npos;
  for (const char* at = text.data(); at != end;) {
    int station = 0;
    const auto [next, error] = std::from_chars(at, digits ? at + 1 : end, station);
    if (error != std::errc() || station < 1 || station > most) return std::nullopt;
    stations.push_back(station);
    at = next;
    if (digits || at == end) continue;
    if (*at != '+' || ++at == end) return std::nullopt;
  }
  std::sort(stations.begin(), stations.end());
  stations.erase(std::unique(stations.begin(), stations.end()), stations.end());
  return stations.empty() ? std::nullopt : std::optional(stations);
}

}  // namespace

Result<Settings> readDeviceSettings(const std::string& owner, const std::vector<Setting>& declared,
                                    const std::string& text) {
  if (text.empty()) return resolveSettings(owner, declared, {});
  FT_TRY(auto parsed, parseMethodText(owner + ":" + text));
  return resolveSettings(owner, declared, parsed.given);
}

Result<LineAddress> readLineAddress(const std::string& address, const std::vector<Setting>& declared,
                                    LineSetup& setup) {
  const std::size_t comma = std::min(address.find(','), address.size());
  LineAddress read{address.substr(0, comma), {}};
  FT_TRY(read.settings, readDeviceSettings(setup.id, declared, address.substr(std::min(comma + 1, address.size()))));
  setup.where = read.line;
  const std::size_t at = read.line.rfind('@');
  setup.device_text = setup.id + ":" + read.line.substr(0, at);
  const bool has_rate = !read.line.empty() && !read.line.starts_with("tcp:");
  if (at == std::string::npos && has_rate) read.line += "@" + std::to_string(setup.baud);
  // Made once now, so that an address that cannot be read is refused here and not when the device is started.
  FT_TRY_VOID(makeTransport(read.line));
  if (at != std::string::npos)
    std::from_chars(read.line.data() + at + 1, read.line.data() + read.line.size(), setup.baud);
  return read;
}

Setting stationsSetting(int most) {
  return declare::choice(
      "stations", "Stations", {}, "auto",
      "Receivers to read, e.g. 1+2 of " + std::to_string(most) + "; auto takes those that are plugged in.");
}

Result<std::vector<int>> readStations(const Settings& settings, const std::string& owner, int most) {
  const std::string& text = choiceSetting(settings, "stations");
  if (text == "auto") return std::vector<int>{};
  if (auto stations = stationsOf(text, most)) return *stations;
  return fail(ErrorCode::kBadInput, owner + ": stations must be auto or numbers from 1 to " + std::to_string(most) +
                                        " joined by +, as in 1+2, got '" + text + "'");
}

std::string stationsText(const std::vector<int>& stations) {
  std::string text;
  for (const int station : stations) text += (text.empty() ? "" : "+") + std::to_string(station);
  return text;
}

std::vector<int> wantedStations(const std::vector<int>& wanted, unsigned plugged) {
  std::vector<int> stations;
  for (int station = 1; station <= 32; ++station) {
    const bool is_wanted = wanted.empty() || std::find(wanted.begin(), wanted.end(), station) != wanted.end();
    if (is_wanted && (plugged >> (station - 1) & 1u) != 0) stations.push_back(station);
  }
  return stations;
}

Setting hemisphereSetting() {
  return declare::choice(
      "hemisphere", "Hemisphere", {"+x", "-x", "+y", "-y", "+z", "-z", "tracked"}, "+x",
      "Side of the transmitter on which the sensor is; tracked follows it as long as it is not interrupted.");
}

Eigen::Vector3d hemisphereVector(const std::string& name) {
  Eigen::Vector3d towards = Eigen::Vector3d::Zero();
  if (name.size() == 2) towards[name[1] - 'x'] = name[0] == '-' ? -1.0 : 1.0;
  return towards;
}

}  // namespace fieldtrue::acquisition
