#include "calib/effects/linear_fit.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "calib/core/error.h"

namespace fieldtrue::effects {

namespace {

field::EffectResponse weightedSum(std::span<const field::EffectResponse> responses, const Eigen::VectorXd& weights) {
  field::EffectResponse sum;
  for (std::size_t i = 0; i < responses.size(); ++i) {
    const double weight = weights[static_cast<Eigen::Index>(i)];
    sum.shift_m += weight * responses[i].shift_m;
    sum.turn_rad += weight * responses[i].turn_rad;
    sum.field_per_m3 += weight * responses[i].field_per_m3;
  }
  return sum;
}

class LinearEffect final : public field::PhysicalEffect {
 public:
  LinearEffect(UnitResponses respond, Eigen::VectorXd values)
      : respond_(std::move(respond)), values_(std::move(values)) {}

  field::EffectResponse at(const field::SensorSetting& setting) const override {
    std::vector<field::EffectResponse> responses(static_cast<std::size_t>(values_.size()));
    respond_(setting, responses);
    return weightedSum(responses, values_);
  }

 private:
  UnitResponses respond_;
  Eigen::VectorXd values_;
};

class LinearFit final : public EffectFit {
 public:
  explicit LinearFit(LinearWay way) : way_(std::move(way)) {}
  std::string name() const override { return way_.name; }
  std::vector<FitParameter> linear() const override { return way_.linear; }
  void respond(std::span<const field::SensorSetting> at, const Eigen::VectorXd& /*searched*/,
               std::span<field::EffectResponse> responses) const override {
    const std::size_t count = way_.linear.size();
    FT_CHECK(responses.size() == at.size() * count);
    for (std::size_t i = 0; i < at.size(); ++i) {
      const std::span<field::EffectResponse> own = responses.subspan(i * count, count);
      std::fill(own.begin(), own.end(), field::EffectResponse{});
      way_.respond(at[i], own);
    }
  }
  FittedEffect describe(const Eigen::VectorXd& /*searched*/, const Eigen::VectorXd& linear) const override {
    return described(way_.linear, linear, way_.scene_parameters(linear));
  }

 private:
  LinearWay way_;
};

/// "0.0123 rad" is "0.7 deg" to a reader.
std::string readable(double value, const std::string& unit) {
  double shown = value;
  std::string shown_unit = unit.empty() ? "" : " " + unit;
  if (unit.empty()) {
    shown = 100.0 * value;
    shown_unit = " %";
  } else if (unit == "m") {
    shown = 1000.0 * value;
    shown_unit = " mm";
  } else if (unit == "rad") {
    shown = value * 180.0 / std::numbers::pi;
    shown_unit = " deg";
  }
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", shown);
  return text + shown_unit;
}

/// "shift_x_m" in m is "shift x".
std::string spoken(const FitParameter& parameter) {
  std::string name = parameter.name;
  const std::string ending = "_" + parameter.unit;
  if (!parameter.unit.empty() && name.ends_with(ending)) name.resize(name.size() - ending.size());
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

}  // namespace

std::unique_ptr<field::PhysicalEffect> linearEffect(UnitResponses respond, Eigen::VectorXd values) {
  return std::make_unique<LinearEffect>(std::move(respond), std::move(values));
}

std::unique_ptr<EffectFit> linearFit(LinearWay way) { return std::make_unique<LinearFit>(std::move(way)); }

std::vector<FitParameter> vectorParameters(const std::string& prefix, const std::string& unit, double plausible) {
  const std::string ending = unit.empty() ? "" : "_" + unit;
  std::vector<FitParameter> parameters;
  for (const char* axis : {"_x", "_y", "_z"})
    parameters.push_back({std::string(prefix).append(axis).append(ending), unit, -plausible, plausible});
  return parameters;
}

FittedEffect described(const std::vector<FitParameter>& parameters, const Eigen::VectorXd& values,
                       nlohmann::json scene_parameters) {
  FT_CHECK(values.size() == static_cast<Eigen::Index>(parameters.size()));
  FittedEffect fitted;
  fitted.parameters = std::move(scene_parameters);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const FitParameter& parameter = parameters[i];
    const double value = values[static_cast<Eigen::Index>(i)];
    fitted.values.push_back({parameter.name, parameter.unit, value});
    if (fitted.is_plausible && !(value >= parameter.low && value <= parameter.high)) {
      fitted.is_plausible = false;
      fitted.doubt = spoken(parameter) + " of " + readable(value, parameter.unit) + ", where " +
                     readable(parameter.low, parameter.unit) + " to " + readable(parameter.high, parameter.unit) +
                     " is plausible";
    }
  }
  return fitted;
}

}  // namespace fieldtrue::effects
