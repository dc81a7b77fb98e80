#include "calib/effects/parameters.h"

#include "calib/core/file_io.h"

namespace fieldtrue {

EffectParameter materialParameter() {
  return {"material",
          "",
          "text",
          "conductive",
          0.0,
          0.0,
          "How the metal answers the field: `conductive` keeps it out (any solid metal at an AC tracker's carrier), "
          "`ferromagnetic` draws it in (steel seen by a pulsed DC tracker).",
          {"conductive", "ferromagnetic"}};
}

EffectParameter permeabilityParameter() {
  return {"relative_permeability",
          "",
          "scalar",
          100.0,
          1.0,
          1e6,
          "Permeability over that of air; used only where `material` is `ferromagnetic`.",
          {},
          20.0,
          5000.0};
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

}  // namespace fieldtrue
