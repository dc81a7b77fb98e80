#include <algorithm>
#include <cmath>
#include <functional>

#include "calib/effects/course.h"
#include "calib/effects/linear_fit.h"
#include "calib/effects/parameters.h"
#include "calib/effects/rows.h"

namespace fieldtrue::effects {

namespace gain_drift {
namespace {

constexpr double kPlausibleGain = 0.1;
constexpr double kPlausibleDrift = 0.2;  ///< Cold amplifiers may warm up by a tenth and more.
constexpr double kShortest = 0.02;       ///< Time constant over the length of the session.
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
        curvature_per_s2_(scalarOf(parameters, "curvature_per_s2")),
        course_(numbersOf(parameters, "course_times_s")),
        course_gains_(numbersOf(parameters, "course_gains")) {}

  field::EffectResponse at(const field::SensorSetting& setting) const override {
    const double u_s = setting.time_s - start_s_;
    double gain = gain_ + (slope_per_s_ + curvature_per_s2_ * u_s) * u_s;
    if (amplitude_ != 0.0) gain += amplitude_ * std::exp(-u_s / time_constant_s_);
    course_.weigh(setting.time_s, [&](std::size_t k, double share) { gain += share * course_gains_[k]; });
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
  Course course_;
  std::vector<double> course_gains_;
};

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& /*excitation*/) {
  const std::vector<double> times_s = numbersOf(parameters, "course_times_s");
  const std::vector<double> gains = numbersOf(parameters, "course_gains");
  if (times_s.size() != gains.size()) {
    return fail(ErrorCode::kBadInput, "gain_drift: course_times_s has " + std::to_string(times_s.size()) +
                                          " numbers and course_gains " + std::to_string(gains.size()) +
                                          "; every moment needs one of each.");
  }
  if (std::adjacent_find(times_s.begin(), times_s.end(), std::greater_equal<>()) != times_s.end())
    return fail(ErrorCode::kBadInput,
                "gain_drift: course_times_s must rise; one of them is no later than the one before.");
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

/// A course that no formula gives, level at first: an amplifier whose warmth follows the room's.
std::unique_ptr<EffectFit> courseWay(const Session& session, std::size_t stretches) {
  const Course course(session.start_s, session.start_s + session.length_s, stretches);
  std::vector<FitParameter> linear;
  for (std::size_t k = 1; k <= stretches; ++k) {
    linear.push_back({"gain_after_" + std::to_string(k) + "_of_" + std::to_string(stretches), "", -kPlausibleDrift,
                      kPlausibleDrift});
  }
  const auto respond = [course](const field::SensorSetting& setting, std::span<field::EffectResponse> responses) {
    const Eigen::Matrix3d G = field::dipoleField(setting.tracker_from_sensor.position_m, 1.0);
    course.weigh(setting.time_s, [&](std::size_t k, double share) {
      if (k > 0) responses[k - 1].field_per_m3 = share * G;
    });
  };
  return linearFit(
      {"course_of_" + std::to_string(stretches), std::move(linear), respond, [course](const Eigen::VectorXd& gains) {
         std::vector<double> all{0.0};
         all.insert(all.end(), gains.data(), gains.data() + gains.size());
         return nlohmann::json{{"course_times_s", course.times_s()}, {"course_gains", all}};
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
  for (const std::size_t stretches : stretchesFor(design.settings.size()))
    ways.push_back(courseWay(session, stretches));
  return ways;
}

}  // namespace
}  // namespace gain_drift

/// A gain that changes while the recording goes on: a transmitter or an amplifier that warms up.
///
/// Convention: dG = g(t) G with, u = t - start,
///   g = gain + amplitude exp(-u/time_constant) + slope u + curvature u^2 + course(t),
/// the course on straight lines between its moments. A body that warms up under constant power follows the exponential
/// (Newton's law of cooling); the straight line and the parabola are its short-time forms; a warmth that comes and goes
/// with the room's follows none of them, and takes a number for every stretch of the session. Every way of fitting has
/// its own constant, for what is stable may lie at either end of the session.
/// @source Newton's law of cooling: Carslaw and Jaeger 1959, Conduction of Heat in Solids, section 1.9
Effect gainDriftEffect() {
  using namespace gain_drift;
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
      declare::number("start_s", {-1e12, 1e12, "s"}, 0.0, "When the fading starts, on the session's clock."),
      declare::numbers("course_times_s", {-1e12, 1e12, "s"}, {0.0, 1.0},
                       "Moments of a course that no formula gives, rising, on the session's clock."),
      declare::numbers("course_gains", {-1e3, 1e3}, {0.0, 0.0},
                       "Relative error at each of these moments, on straight lines between them.")
          .plausibly(-kPlausibleDrift, kPlausibleDrift)};
  effect.make = make;
  effect.fits = fits;
  effect.acts_in_time = true;
  return effect;
}

}  // namespace fieldtrue::effects
