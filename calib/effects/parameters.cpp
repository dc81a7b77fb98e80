#include "calib/effects/parameters.h"

#include "calib/core/file_io.h"

namespace fieldtrue::effects {

EffectParameter materialParameter() {
  return {
      .name = "material",
      .shape = "text",
      .default_value = "conductive",
      .help =
          "How the metal answers the field: `conductive` keeps it out (any solid metal at an AC tracker's carrier), "
          "`ferromagnetic` draws it in (steel seen by a pulsed DC tracker).",
      .choices = {"conductive", "ferromagnetic"}};
}

EffectParameter permeabilityParameter() {
  return {.name = "relative_permeability",
          .shape = "scalar",
          .default_value = 100.0,
          .min = 1.0,
          .max = 1e6,
          .help = "Permeability over that of air; used only where `material` is `ferromagnetic`.",
          .plausible_min = 20.0,
          .plausible_max = 5000.0};
}

EffectParameter centerParameter(std::string help) {
  return {.name = "center_m",
          .unit = "m",
          .shape = "vector3",
          .default_value = {1.0, 0.0, -1.0},
          .min = -100.0,
          .max = 100.0,
          .help = std::move(help),
          .plausible_min = -10.0,
          .plausible_max = 10.0};
}

EffectParameter conductivityParameter(std::string help) {
  return {.name = "conductivity_s_per_m",
          .unit = "S/m",
          .shape = "scalar",
          .min = 1.0,
          .max = 1e8,
          .help = std::move(help),
          .plausible_min = 1e6,
          .plausible_max = 6e7};
}

double scalarOf(const nlohmann::json& parameters, const std::string& name) { return parameters.at(name).get<double>(); }

Eigen::Vector3d vectorOf(const nlohmann::json& parameters, const std::string& name) {
  const nlohmann::json& list = parameters.at(name);
  return {list.at(0).get<double>(), list.at(1).get<double>(), list.at(2).get<double>()};
}

std::vector<double> numbersOf(const nlohmann::json& parameters, const std::string& name) {
  return parameters.at(name).get<std::vector<double>>();
}

nlohmann::json listOf(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

bool isFerromagnetic(const nlohmann::json& parameters) { return parameters.at("material") == "ferromagnetic"; }

std::string textOf(const Eigen::Vector3d& v) {
  return "(" + formatNumber(v.x()) + ", " + formatNumber(v.y()) + ", " + formatNumber(v.z()) + ")";
}

}  // namespace fieldtrue::effects
