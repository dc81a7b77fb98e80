#include <algorithm>

#include "calib/core/units.h"
#include "calib/effects/metal_body.h"
#include "calib/effects/parameters.h"
#include "calib/effects/rows.h"

namespace fieldtrue::effects {

namespace metal_moved {
namespace {

/// A change that fewer readings than this on one side of it speak for is not looked for.
constexpr double kLeastShare = 0.05;

enum class Presence { kAfter, kBefore };

bool isPresent(Presence presence, double change_s, double time_s) {
  return presence == Presence::kAfter ? time_s >= change_s : time_s < change_s;
}

class MetalMoved final : public field::CouplingDistortion {
 public:
  MetalMoved(const MetalBody& body, double change_s, Presence presence)
      : body_(body), change_s_(change_s), presence_(presence) {}

  Eigen::Matrix3d fieldChange(const Eigen::Vector3d& p_sensor_m, double dipole_constant_m3,
                              double time_s) const override {
    if (!isPresent(presence_, change_s_, time_s)) return Eigen::Matrix3d::Zero();
    return dipole_constant_m3 * body_.fieldChange_per_m3(p_sensor_m);
  }

  bool admits(const Eigen::Vector3d& p_sensor_m) const override {
    return (p_sensor_m - body_.center_m).norm() > body_.radius_m;
  }

 private:
  MetalBody body_;
  double change_s_;
  Presence presence_;
};

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& excitation) {
  FT_TRY(const MetalBody body, bodyOf(parameters, excitation, "metal_moved"));
  const Presence presence = parameters.at("present") == "after" ? Presence::kAfter : Presence::kBefore;
  return std::make_unique<MetalMoved>(body, scalarOf(parameters, "change_s"), presence);
}

class MetalMovedFit final : public EffectFit {
 public:
  MetalMovedFit(const FitDesign& design, BodyShape shape, Presence presence)
      : search_(design), shape_(shape), presence_(presence), start_s_(design.start_s), end_s_(design.end_s) {
    for (const field::SensorSetting& setting : design.settings) times_s_.push_back(setting.time_s);
    std::sort(times_s_.begin(), times_s_.end());
  }

  std::string name() const override {
    const std::string shape = shape_ == BodyShape::kSphere ? "sphere" : "tensor";
    return presence_ == Presence::kAfter ? shape : shape + " before";
  }

  bool searchesPlace() const override { return true; }
  std::vector<FitParameter> searched() const override {
    std::vector<FitParameter> parameters = search_.centerParameters();
    parameters.push_back({"change_s", "s", start_s_, end_s_});
    return parameters;
  }

  std::vector<FitParameter> linear() const override { return polarizabilityParameters(shape_); }

  std::vector<Eigen::VectorXd> starts() const override {
    std::vector<Eigen::VectorXd> starts;
    if (times_s_.empty()) return starts;
    for (const Eigen::Vector3d& p_m : search_.around_m(0.75, {0.3, 0.7})) {
      for (const double share : {0.15, 0.325, 0.5, 0.675, 0.85}) {
        const Eigen::VectorXd start = joined(p_m, Eigen::VectorXd::Constant(1, timeAt_s(share)));
        if (allows(start)) starts.push_back(start);
      }
    }
    return starts;
  }

  bool allows(const Eigen::VectorXd& searched) const override {
    if (!search_.allowsCenter(searched.head<3>())) return false;
    const auto before = std::lower_bound(times_s_.begin(), times_s_.end(), searched[3]) - times_s_.begin();
    const double count = static_cast<double>(times_s_.size());
    const double share = static_cast<double>(before) / count;
    return searched[3] > start_s_ && searched[3] < end_s_ && share >= kLeastShare && share <= 1.0 - kLeastShare;
  }

  void respond(std::span<const field::SensorSetting> at, const Eigen::VectorXd& searched,
               std::span<field::EffectResponse> responses) const override {
    const Eigen::Vector3d center_m = searched.head<3>();
    const Eigen::Matrix3d field_of_transmitter = field::dipoleField(center_m, 1.0 / (4.0 * kPi));
    const std::size_t count = shape_ == BodyShape::kSphere ? 1 : 6;
    for (std::size_t i = 0; i < at.size(); ++i) {
      const auto own = responses.subspan(i * count, count);
      if (isPresent(presence_, searched[3], at[i].time_s)) {
        respondAsBody(shape_, center_m, field_of_transmitter, at[i].tracker_from_sensor.position_m, own);
      } else {
        std::fill(own.begin(), own.end(), field::EffectResponse{});
      }
    }
  }

  FittedEffect describe(const Eigen::VectorXd& searched, const Eigen::VectorXd& linear) const override {
    FittedEffect fitted = describeBody(shape_, searched.head<3>(), linear, search_);
    fitted.parameters["change_s"] = searched[3];
    fitted.parameters["present"] = presence_ == Presence::kAfter ? "after" : "before";
    fitted.values.push_back({"change_s", "s", searched[3]});
    return fitted;
  }

 private:
  /// The middle between two readings' times, so that rounding puts no reading on the other side.
  double timeAt_s(double share) const {
    const double last = static_cast<double>(times_s_.size() - 1);
    const std::size_t i = static_cast<std::size_t>(share * last);
    return 0.5 * (times_s_[i] + times_s_[std::min(i + 1, times_s_.size() - 1)]);
  }

  RoomSearch search_;
  BodyShape shape_;
  Presence presence_;
  double start_s_;
  double end_s_;
  std::vector<double> times_s_;  ///< Ascending.
};

std::vector<std::unique_ptr<EffectFit>> fits(const FitDesign& design) {
  std::vector<std::unique_ptr<EffectFit>> ways;
  if (!design.has_times) return ways;
  for (const BodyShape shape : {BodyShape::kSphere, BodyShape::kTensor}) {
    for (const Presence presence : {Presence::kAfter, Presence::kBefore}) {
      ways.push_back(std::make_unique<MetalMovedFit>(design, shape, presence));
    }
  }
  return ways;
}

}  // namespace
}  // namespace metal_moved

/// A compact metal body that is in the room only from a time on, or only until then: a chair, a tool, a trolley.
///
/// While it is there it answers as `compact_metal` does; at other times it does nothing. Only a recording in which the
/// places were not all visited on one side of the change, and whose times are stated, can show it.
/// @source Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709 (the body)
Effect metalMovedEffect() {
  using namespace metal_moved;
  Effect effect;
  effect.id = "metal_moved";
  effect.label = "Metal that came or went";
  effect.source = "Raab, Blood, Steiner, Jones 1979, IEEE Trans. AES-15 709; sphere: Wait 1951, Geophysics 16 666";
  effect.parameters = bodyParameters();
  effect.parameters.push_back(
      declare::number("change_s", {0.0, 1e6, "s"}, 0.0, "When it came or went, from the start of the session.")
          .plausibly(0.0, 36000.0));
  effect.parameters.push_back(
      declare::choice("present", {"after", "before"}, "after",
                      "Whether it stands there `after` the change, having come, or `before` it, having gone."));
  effect.make = make;
  effect.fits = fits;
  effect.body = ballOf;
  effect.acts_in_time = true;
  effect.is_freer = true;  // It is there for a part of the time that is free.
  return effect;
}

}  // namespace fieldtrue::effects
