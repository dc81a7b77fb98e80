#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "calib/effects/effect_fit.h"

namespace fieldtrue::effects {

/// Fills in what one reading answers per unit of each of an effect's linear parameters.
using UnitResponses =
    std::function<void(const field::SensorSetting& setting, std::span<field::EffectResponse> responses)>;

/// An effect that answers with the sum of its unit responses, each times its value.
std::unique_ptr<field::PhysicalEffect> linearEffect(UnitResponses respond, Eigen::VectorXd values);

/// A way of fitting in which nothing is searched.
struct LinearWay {
  std::string name;
  std::vector<FitParameter> linear;
  UnitResponses respond;
  std::function<nlohmann::json(const Eigen::VectorXd& linear)> scene_parameters;
};
std::unique_ptr<EffectFit> linearFit(LinearWay way);

/// Parameters of one vector, `prefix_x`, `prefix_y`, `prefix_z` with the unit's ending, plausible within +-`plausible`.
std::vector<FitParameter> vectorParameters(const std::string& prefix, const std::string& unit, double plausible);

/// A fitted effect whose report shows the fitted parameters themselves; implausible where one of them is out of bounds.
FittedEffect described(const std::vector<FitParameter>& parameters, const Eigen::VectorXd& values,
                       nlohmann::json scene_parameters);

}  // namespace fieldtrue::effects
