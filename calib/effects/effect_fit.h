#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/field/effect.h"

namespace fieldtrue::effects {

/// The readings that an effect is to be fitted to, as far as they are known before fitting.
struct FitDesign {
  std::span<const field::SensorSetting> settings;
  Eigen::AlignedBox3d places_m;  ///< Of the sensor, tracker frame.
  double pitch_m = 0.1;          ///< Median distance to the nearest other place.
  bool has_times = false;        ///< Whether the settings' times are stated.
  double start_s = 0.0;
  double end_s = 0.0;
  bool alignment_known = false;
  bool has_orientation = true;  ///< Whether the tracker reported orientations.
  bool several_orientations = false;
  field::Excitation excitation;
};

/// One number that is fitted.
struct FitParameter {
  std::string name;  ///< With its unit.
  std::string unit;
  double low = 0.0;  ///< Where it may be searched; of a linear parameter: what is plausible.
  double high = 0.0;
};

/// One number of a fitted effect as it is reported.
struct FittedParameter {
  std::string name;
  std::string unit;
  double value = 0.0;
};

/// A fitted effect in the terms of its scene parameters.
struct FittedEffect {
  nlohmann::json parameters;                  ///< As a scene holds them; the effect made from them answers as the fit.
  std::vector<FittedParameter> values;        ///< What a report shows; smooth functions of what was fitted.
  std::optional<Eigen::Vector3d> location_m;  ///< Tracker frame.
  std::optional<std::string> material;        ///< `conductive`, `ferromagnetic` or `undetermined`.
  bool is_plausible = true;
  std::string doubt;  ///< Why it is not: "a gain error of 40 %".
};

/// One way to fit an effect: linear in some parameters once a few others, which are searched, are given.
class EffectFit {
 public:
  virtual ~EffectFit() = default;
  /// Tells the ways of one effect apart: "sphere", "tensor", "receiver".
  virtual std::string name() const = 0;
  /// Empty where nothing is searched.
  virtual std::vector<FitParameter> searched() const { return {}; }
  /// Whether the first three searched parameters are a place in the room [m], tracker frame.
  virtual bool searchesPlace() const { return false; }
  virtual std::vector<FitParameter> linear() const = 0;
  /// Coarse grid over the searched parameters that leaves no believable value out; one empty vector where nothing is
  /// searched. At most a few hundred, coarser where fewer do.
  virtual std::vector<Eigen::VectorXd> starts() const { return {Eigen::VectorXd()}; }
  /// Whether the searched parameters may be so: within bounds, not on a place or on the transmitter.
  virtual bool allows([[maybe_unused]] const Eigen::VectorXd& searched) const { return true; }
  /// Responses per unit of each linear parameter.
  /// @param responses at.size() * linear().size(), the linear parameter running fastest; filled
  virtual void respond(std::span<const field::SensorSetting> at, const Eigen::VectorXd& searched,
                       std::span<field::EffectResponse> responses) const = 0;
  virtual FittedEffect describe(const Eigen::VectorXd& searched, const Eigen::VectorXd& linear) const = 0;
};

}  // namespace fieldtrue::effects
