#include <algorithm>
#include <cmath>

#include "calib/effects/linear_fit.h"
#include "calib/effects/parameters.h"
#include "calib/effects/rows.h"

namespace fieldtrue::effects {

namespace {

constexpr double kPlausibleGain = 0.1;
constexpr double kPlausibleDrift = 0.1;
constexpr double kShortest = 0.02;  ///< Time constant over the length of the session.
constexpr double kLongest = 2.0;
constexpr int kStarts = 10;

class GainDrift final : public field::PhysicalEffect {
 public:
  explicit GainDrift(const nlohmann::json& parameters)
      : start_s_(scalarOf(parameters, "start_s")),
        gain_(scalarOf(parameters, "gain")),
        amplitude_(scalarOf(parameters, "amplitude")),
        time_constant_s_(scalarOf(parameters, "time_constant_s")),
        slope_per_s_(scalarOf(parameters, "slope_per_s")),
        curvature_per_s2_(scalarOf(parameters, "curvature_per_s2")) {}

  field::EffectResponse at(const field::SensorSetting& setting) const override {
    const double u_s = setting.time_s - start_s_;
    double gain = gain_ + (slope_per_s_ + curvature_per_s2_ * u_s) * u_s;
    if (amplitude_ != 0.0) gain += amplitude_ * std::exp(-u_s / time_constant_s_);
    field::EffectResponse response;
    response.field_per_m3 = gain * field::dipoleField(setting.tracker_from_sensor.position_m, 1.0);
    return response;
  }

 private:
  double start_s_;
  double gain_;
  double amplitude_;
  double time_constant_s_;
  double slope_per_s_;
  double curvature_per_s2_;
};

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& /*excitation*/) {
  return std::make_unique<GainDrift>(parameters);
}

/// The session's length, over which a fitted drift is told.
struct Session {
  double start_s = 0.0;
  double length_s = 1.0;
  double share(double time_s) const { return (time_s - start_s) / length_s; }
};

/// A polynomial of the share of the session that has passed, without a constant: a gain that was wrong from the start
/// on is another effect.
std::unique_ptr<EffectFit> polynomialWay(const std::string& name, const Session& session, bool is_curved) {
  std::vector<FitParameter> linear{{"drift_over_session", "", -kPlausibleDrift, kPlausibleDrift}};
  if (is_curved) linear.push_back({"curvature_over_session", "", -2.0 * kPlausibleDrift, 2.0 * kPlausibleDrift});
  const auto respond = [session](const field::SensorSetting& setting, std::span<field::EffectResponse> responses) {
    double power = session.share(setting.time_s);
    for (field::EffectResponse& response : responses) {
      response.field_per_m3 = power * field::dipoleField(setting.tracker_from_sensor.position_m, 1.0);
      power *= session.share(setting.time_s);
    }
  };
  return linearFit(
      {name, std::move(linear), respond, [session, is_curved](const Eigen::VectorXd& g) {
         nlohmann::json parameters{
             {"gain", 0.0}, {"amplitude", 0.0}, {"start_s", session.start_s}, {"slope_per_s", g[0] / session.length_s}};
         if (is_curved) parameters["curvature_per_s2"] = g[1] / (session.length_s * session.length_s);
         return parameters;
       }});
}

/// Warming up from the start of the session on, with a searched time constant.
class ExponentialFit final : public EffectFit {
 public:
  explicit ExponentialFit(const Session& session) : session_(session) {}

  std::string name() const override { return "exponential"; }
  std::vector<FitParameter> searched() const override {
    return {{"time_constant_s", "s", kShortest * session_.length_s, kLongest * session_.length_s}};
  }
  std::vector<FitParameter> linear() const override { return {{"amplitude", "", -kPlausibleDrift, kPlausibleDrift}}; }
  std::vector<Eigen::VectorXd> starts() const override {
    std::vector<Eigen::VectorXd> starts;
    for (int i = 0; i < kStarts; ++i) {
      const double share = (i + 0.5) / kStarts;
      const double time_constant_s = kShortest * session_.length_s * std::pow(kLongest / kShortest, share);
      starts.push_back(Eigen::VectorXd::Constant(1, time_constant_s));
    }
    return starts;
  }
  bool allows(const Eigen::VectorXd& searched) const override {
    return searched[0] >= kShortest * session_.length_s && searched[0] <= kLongest * session_.length_s;
  }
  void respond(std::span<const field::SensorSetting> at, const Eigen::VectorXd& searched,
               std::span<field::EffectResponse> responses) const override {
    FT_CHECK(responses.size() == at.size());
    for (std::size_t i = 0; i < at.size(); ++i) {
      const double warmed = std::expm1(-(at[i].time_s - session_.start_s) / searched[0]);
      responses[i] = field::EffectResponse{};
      responses[i].field_per_m3 = warmed * field::dipoleField(at[i].tracker_from_sensor.position_m, 1.0);
    }
  }
  FittedEffect describe(const Eigen::VectorXd& searched, const Eigen::VectorXd& linear) const override {
    FittedEffect fitted = described(this->linear(), linear,
                                    {{"gain", -linear[0]},
                                     {"amplitude", linear[0]},
                                     {"start_s", session_.start_s},
                                     {"time_constant_s", searched[0]}});
    fitted.values.push_back({"time_constant_s", "s", searched[0]});
    return fitted;
  }

 private:
  Session session_;
};

std::vector<std::unique_ptr<EffectFit>> fits(const FitDesign& design) {
  std::vector<std::unique_ptr<EffectFit>> ways;
  if (!design.has_times || !(design.end_s > design.start_s)) return ways;
  const Session session{design.start_s, design.end_s - design.start_s};
  ways.push_back(polynomialWay("linear", session, false));
  ways.push_back(std::make_unique<ExponentialFit>(session));
  ways.push_back(polynomialWay("quadratic", session, true));
  return ways;
}

}  // namespace

/// A gain that changes while the recording goes on: a transmitter or an amplifier that warms up.
///
/// Convention: dG = g(t) G with, u = t - start,
///   g = gain + amplitude exp(-u/time_constant) + slope u + curvature u^2.
/// A body that warms up under constant power follows the exponential (Newton's law of cooling); the straight line and
/// the parabola are its short-time forms. Every way of fitting has its own constant, for what is stable may lie at
/// either end of the session.
/// @source Newton's law of cooling: Carslaw and Jaeger 1959, Conduction of Heat in Solids, section 1.9
Effect gainDriftEffect() {
  Effect effect;
  effect.id = "gain_drift";
  effect.label = "Gain that drifts with time";
  effect.source = "Newton's law of cooling: Carslaw and Jaeger 1959, Conduction of Heat in Solids, section 1.9";
  effect.parameters = {
      declare::number("gain", {-1e3, 1e3}, 0.0, "Relative error of every coupling that stays.")
          .plausibly(-kPlausibleGain, kPlausibleGain),
      declare::number("amplitude", {-1e3, 1e3}, 0.0, "Relative error at the start that fades exponentially.")
          .plausibly(-kPlausibleDrift, kPlausibleDrift),
      declare::number("time_constant_s", {1e-6, 1e9, "s"}, 1200.0, "Of the fading.").plausibly(60.0, 7200.0),
      declare::number("slope_per_s", {-1e6, 1e6, "1/s"}, 0.0, "Change of the relative error with time.")
          .plausibly(-1e-4, 1e-4),
      declare::number("curvature_per_s2", {-1e6, 1e6, "1/s^2"}, 0.0, "Of the relative error, times the squared time.")
          .plausibly(-1e-7, 1e-7),
      declare::number("start_s", {-1e12, 1e12, "s"}, 0.0, "When the fading starts, on the session's clock.")};
  effect.make = make;
  effect.fits = fits;
  effect.acts_in_time = true;
  return effect;
}

}  // namespace fieldtrue::effects
