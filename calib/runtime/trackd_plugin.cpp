#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "calib/core/pose.h"
#include "calib/core/trimmed.h"
#include "calib/core/units.h"
#include "calib/runtime/fieldtrue_runtime.h"

/// A calibration plug-in as trackd loads it: calib_init once, calib_evaluate for every reading, calib_exit at the end.
/// A parameter is `key=value`, or the path of a file of such lines; relative paths start from that file's folder.
///   calibration=FILE   the *.ftcal.json
///   units=feet         of the positions: m, cm, mm, inch, feet
///   angles=deg         deg or rad
///   order=x,y,z,azimuth,elevation,roll    where each number stands in the pose
///   sensor=-1          whose mounting counts; -1: the first one that was calibrated
namespace fieldtrue::runtime {
namespace {

constexpr std::array<std::string_view, 6> kNumbers = {"x", "y", "z", "azimuth", "elevation", "roll"};

struct Unit {
  std::string_view name;
  double in_m;
};
constexpr std::array<Unit, 5> kUnits = {{{"m", 1.0}, {"cm", 0.01}, {"mm", 0.001}, {"inch", 0.0254}, {"feet", 0.3048}}};

struct Plugin {
  fieldtrue_calibration* calibration = nullptr;
  std::filesystem::path file;
  double unit_m = 0.3048;
  double angle_rad = 1.0 / kDegPerRad;
  std::array<std::size_t, 6> place = {0, 1, 2, 3, 4, 5};  ///< Of x, y, z, azimuth, elevation, roll in the pose.
  int sensor = FIELDTRUE_FIRST_SENSOR;

  Plugin() = default;
  Plugin(const Plugin&) = delete;
  Plugin& operator=(const Plugin&) = delete;
  ~Plugin() { fieldtrue_free(calibration); }
};

/// What is wrong with a parameter, as one sentence; none where it was taken.
using Problem = std::optional<std::string>;

Problem takeOrder(Plugin& plugin, std::string_view order) {
  std::array<bool, 6> seen{};
  std::size_t place = 0;
  while (place < 6) {
    const std::size_t comma = order.find(',');
    const auto number = std::find(kNumbers.begin(), kNumbers.end(), trimmed(order.substr(0, comma)));
    if (number == kNumbers.end()) break;
    const auto which = static_cast<std::size_t>(number - kNumbers.begin());
    plugin.place[which] = place++;
    seen[which] = true;
    if (comma == std::string_view::npos) break;
    order.remove_prefix(comma + 1);
  }
  if (place == 6 && std::all_of(seen.begin(), seen.end(), [](bool one) { return one; })) return std::nullopt;
  return "order needs x, y, z, azimuth, elevation and roll, each once, with commas between them";
}

Problem takeSensor(Plugin& plugin, const std::string& text) {
  int end = 0;
  if (std::sscanf(text.c_str(), "%d%n", &plugin.sensor, &end) == 1 && static_cast<std::size_t>(end) == text.size())
    return std::nullopt;
  return "sensor needs a whole number, not '" + text + "'";
}

Problem take(Plugin& plugin, const std::string& parameter, const std::filesystem::path& folder);

Problem takeFile(Plugin& plugin, const std::filesystem::path& path) {
  std::ifstream lines(path);
  if (!lines) return path.string() + " cannot be opened; a parameter is key=value, or a file of such lines";
  for (std::string line; std::getline(lines, line);) {
    const std::string parameter(trimmed(line));
    if (parameter.empty() || parameter.front() == '#') continue;
    if (parameter.find('=') == std::string::npos) return path.string() + ": '" + parameter + "' is not key=value";
    if (auto problem = take(plugin, parameter, path.parent_path())) return problem;
  }
  return std::nullopt;
}

Problem take(Plugin& plugin, const std::string& parameter, const std::filesystem::path& folder) {
  const std::size_t equals = parameter.find('=');
  if (equals == std::string::npos) return takeFile(plugin, folder / parameter);
  const std::string key(trimmed(std::string_view(parameter).substr(0, equals)));
  const std::string value(trimmed(std::string_view(parameter).substr(equals + 1)));
  if (key == "order") return takeOrder(plugin, value);
  if (key == "sensor") return takeSensor(plugin, value);
  if (key == "calibration") {
    plugin.file = folder / value;
    return std::nullopt;
  }
  if (key == "angles" && (value == "deg" || value == "rad")) {
    plugin.angle_rad = value == "deg" ? 1.0 / kDegPerRad : 1.0;
    return std::nullopt;
  }
  if (key == "units") {
    const auto unit = std::find_if(kUnits.begin(), kUnits.end(), [&](const Unit& one) { return one.name == value; });
    if (unit == kUnits.end()) return "units are m, cm, mm, inch or feet, not '" + value + "'";
    plugin.unit_m = unit->in_m;
    return std::nullopt;
  }
  return "'" + parameter + "' is none of calibration=FILE, units=, angles=deg|rad, order=, sensor=";
}

Problem start(Plugin& plugin, const char* const* parameters, int n) {
  for (int i = 0; i < n; ++i)
    if (parameters[i] != nullptr && *parameters[i] != '\0')
      if (auto problem = take(plugin, parameters[i], {})) return problem;
  if (plugin.file.empty()) return "calibration=FILE is missing";
  if (fieldtrue_load(plugin.file.c_str(), &plugin.calibration) != FIELDTRUE_OK) return std::string(fieldtrue_error());
  return std::nullopt;
}

/// In place, in the host's units.
void evaluate(const Plugin& plugin, float* pose) {
  const auto at = [&](std::size_t number) -> float& { return pose[plugin.place[number]]; };
  const Eigen::Vector3d angles_rad = plugin.angle_rad * Eigen::Vector3d(double(at(3)), double(at(4)), double(at(5)));
  const Eigen::Quaterniond q = rotationFromEuler(angles_rad);
  const fieldtrue_pose tracked = {
      {plugin.unit_m * double(at(0)), plugin.unit_m * double(at(1)), plugin.unit_m * double(at(2))},
      {q.w(), q.x(), q.y(), q.z()}};
  fieldtrue_pose corrected;
  fieldtrue_correct(plugin.calibration, plugin.sensor, &tracked, &corrected);
  const double* wxyz = corrected.orientation_wxyz;
  const Eigen::Vector3d turned_rad = eulerFromRotation_rad(Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]));
  for (std::size_t i = 0; i < 3; ++i) {
    at(i) = static_cast<float>(corrected.position_m[i] / plugin.unit_m);
    at(3 + i) = static_cast<float>(turned_rad[static_cast<Eigen::Index>(i)] / plugin.angle_rad);
  }
}

}  // namespace
}  // namespace fieldtrue::runtime

using fieldtrue::runtime::Plugin;

extern "C" {

/// @return what the other two need; null, and a sentence on standard error, where the calibration cannot be used
FIELDTRUE_API void* calib_init(const char* const* params, int n) {
  try {
    auto plugin = std::make_unique<Plugin>();
    const auto problem = fieldtrue::runtime::start(*plugin, params, n);
    if (!problem) return plugin.release();
    std::fprintf(stderr, "Fieldtrue: %s. Readings stay as they are.\n", problem->c_str());
  } catch (...) {
    std::fprintf(stderr, "Fieldtrue: not enough memory for the calibration. Readings stay as they are.\n");
  }
  return nullptr;
}

/// Corrects a pose of six numbers in place; without a calibration it stays.
FIELDTRUE_API void calib_evaluate(void* data, float* pose) {
  if (data != nullptr && pose != nullptr) fieldtrue::runtime::evaluate(*static_cast<const Plugin*>(data), pose);
}

FIELDTRUE_API void calib_exit(void* data) { delete static_cast<Plugin*>(data); }
}
