#include "calib/effects/parameters.h"

#include "calib/core/file_io.h"

namespace fieldtrue::effects {

Setting materialParameter() {
  return declare::choice("material", {"conductive", "ferromagnetic"}, "conductive",
                         "How the metal answers the field: `conductive` keeps it out (any solid metal at an AC "
                         "tracker's carrier), `ferromagnetic` draws it in (steel seen by a pulsed DC tracker).");
}

Setting permeabilityParameter() {
  return declare::number("relative_permeability", {1.0, 1e6}, 100.0,
                         "Permeability over that of air; used only where `material` is `ferromagnetic`.")
      .plausibly(20.0, 5000.0);
}

Setting centerParameter(std::string help) {
  return declare::vector3("center_m", {-100.0, 100.0, "m"}, {1.0, 0.0, -1.0}, std::move(help)).plausibly(-10.0, 10.0);
}

Setting conductivityParameter(std::string help) {
  return declare::number("conductivity_s_per_m", {1.0, 1e8, "S/m"}, nullptr, std::move(help)).plausibly(1e6, 6e7);
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
