#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "calib/effects/effect_row.h"

namespace fieldtrue::effects {

/// What metal does to a quasi-static field: as a conductor it keeps the field out, as a ferromagnet it draws it in.
Setting materialParameter();
/// Used only where the material is ferromagnetic.
Setting permeabilityParameter();

/// Where a body in the room stands. @param help a sentence
Setting centerParameter(std::string help);
/// Null is an ideal metal. @param help a sentence
Setting conductivityParameter(std::string help);

/// Typed access to resolved parameters.
double scalarOf(const nlohmann::json& parameters, const std::string& name);
Eigen::Vector3d vectorOf(const nlohmann::json& parameters, const std::string& name);
std::vector<double> numbersOf(const nlohmann::json& parameters, const std::string& name);
bool isFerromagnetic(const nlohmann::json& parameters);

/// A vector as a scene holds it.
nlohmann::json listOf(const Eigen::Vector3d& v);

/// "(1, 0, -0.5)"
std::string textOf(const Eigen::Vector3d& v);

}  // namespace fieldtrue::effects
