#include "calib/effects/effect_listing.h"

#include <array>
#include <cstdio>
#include <numbers>

#include "calib/effects/registry.h"

namespace fieldtrue::effects {

namespace {

constexpr double kPitch_m = 0.3;
constexpr double kSession_s = 3600.0;

std::vector<field::SensorSetting> exampleSettings() {
  const double quarter_rad = 0.5 * std::numbers::pi;
  const Pose tracker_from_reference{{1.2, 0.0, 0.0}, Eigen::Quaterniond::Identity()};
  const std::array<Eigen::Vector3d, 4> turns_rad{
      {{0.0, 0.0, 0.0}, {quarter_rad, 0.0, 0.0}, {0.0, quarter_rad, 0.0}, {0.0, 0.0, quarter_rad}}};
  std::vector<field::SensorSetting> settings;
  for (const Eigen::Vector3d& turn_rad : turns_rad) {
    for (int place = 0; place < 100; ++place) {
      const std::array<int, 3> index{place % 5, place / 5 % 5, place / 25};
      const Eigen::Vector3d p_m(kPitch_m * (index[0] - 2), kPitch_m * (index[1] - 2), kPitch_m * (index[2] - 1.5));
      const double time_s = kSession_s / 400.0 * static_cast<double>(settings.size());
      settings.push_back(
          {tracker_from_reference * Pose{p_m, rotationFromVector(turn_rad)}, tracker_from_reference, index, time_s});
    }
  }
  return settings;
}

nlohmann::json toJson(const std::vector<FitParameter>& parameters) {
  nlohmann::json list = nlohmann::json::array();
  for (const FitParameter& parameter : parameters) {
    list.push_back(
        {{"name", parameter.name}, {"unit", parameter.unit}, {"low", parameter.low}, {"high", parameter.high}});
  }
  return list;
}

/// Three digits are enough for people.
std::string rangeText(double low, double high) {
  char text[64];
  std::snprintf(text, sizeof text, "%.3g to %.3g", low, high);
  return text;
}

std::string parameterText(const Setting& parameter) {
  std::string text = "    " + parameter.key + "  " + shapeOf(parameter);
  if (!parameter.unit.empty()) text += " [" + parameter.unit + "]";
  for (std::size_t i = 0; i < parameter.choices.size(); ++i) text += (i == 0 ? ", " : " or ") + parameter.choices[i];
  const nlohmann::json usual = fieldtrue::toJson(parameter.default_value);
  text += usual.is_null() ? ", may be left out" : ", default " + usual.dump();
  if (parameter.isBounded()) text += ", " + rangeText(parameter.min, parameter.max);
  if (parameter.hasPlausibleRange()) {
    text += ", plausible " + rangeText(parameter.plausible_min, parameter.plausible_max);
  }
  return text + "\n        " + parameter.help + "\n";
}

std::string wayText(const ListedWay& way) {
  std::string text = "    fitted as " + way.name + ":";
  bool is_first = true;
  for (const auto* parameters : {&way.searched, &way.linear}) {
    for (const FitParameter& parameter : *parameters) {
      text += (is_first ? " " : ", ") + parameter.name + " " + rangeText(parameter.low, parameter.high);
      is_first = false;
    }
  }
  return text + "\n";
}

}  // namespace

std::vector<ListedWay> waysToFit(const Effect& effect) {
  std::vector<ListedWay> ways;
  if (effect.fits == nullptr) return ways;
  const std::vector<field::SensorSetting> settings = exampleSettings();
  FitDesign design;
  design.settings = settings;
  for (const field::SensorSetting& setting : settings) design.places_m.extend(setting.tracker_from_sensor.position_m);
  design.pitch_m = kPitch_m;
  design.has_times = true;
  design.end_s = settings.back().time_s;
  design.alignment_known = true;
  design.several_orientations = true;
  for (const auto& way : effect.fits(design)) ways.push_back({way->name(), way->searched(), way->linear()});
  return ways;
}

nlohmann::json effectListing() {
  nlohmann::json list = toJson(effects());
  for (std::size_t i = 0; i < effects().size(); ++i) {
    nlohmann::json fits = nlohmann::json::array();
    for (const ListedWay& way : waysToFit(effects()[i])) {
      fits.push_back({{"name", way.name}, {"searched", toJson(way.searched)}, {"linear", toJson(way.linear)}});
    }
    list[i]["found_in"] = effects()[i].fits == nullptr ? "samples" : "places";
    list[i]["fits"] = std::move(fits);
  }
  return list;
}

std::string effectListingText() {
  std::string text;
  for (const Effect& effect : effects()) {
    text += effect.id + "  " + effect.label + "  [" + effect.source + "]\n";
    for (const Setting& parameter : effect.parameters) text += parameterText(parameter);
    if (effect.fits == nullptr) text += "    not fitted: found in the readings themselves\n";
    for (const ListedWay& way : waysToFit(effect)) text += wayText(way);
  }
  return text;
}

}  // namespace fieldtrue::effects
