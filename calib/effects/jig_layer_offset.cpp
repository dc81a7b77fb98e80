#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "calib/core/file_io.h"
#include "calib/effects/linear_fit.h"
#include "calib/effects/parameters.h"
#include "calib/effects/rows.h"

namespace fieldtrue::effects {

namespace jig_layer_offset {
namespace {

constexpr double kPlausible_m = 0.03;
constexpr std::size_t kFewestLayers = 3;
constexpr std::size_t kMostLayers = 12;
constexpr std::size_t kFewestPlacesOfALayer = 3;
constexpr std::array<const char*, 3> kAxes{"x", "y", "z"};

/// Where the rig put the sensor's holder, rig's frame: a sensor on an arm hangs above or below its layer.
Eigen::Vector3d holderOf_m(const field::SensorSetting& setting) {
  if (setting.holder_m) return *setting.holder_m;
  return inverse(setting.tracker_from_reference) * setting.tracker_from_sensor.position_m;
}

/// Layers across one axis of the rig.
class Layers {
 public:
  /// @param heights_m at least two, all different
  Layers(int axis, std::vector<double> heights_m) : axis_(axis), heights_m_(std::move(heights_m)) {
    std::vector<double> sorted_m = heights_m_;
    std::sort(sorted_m.begin(), sorted_m.end());
    for (std::size_t i = 1; i < sorted_m.size(); ++i)
      reach_m_ = std::min(reach_m_, 0.5 * (sorted_m[i] - sorted_m[i - 1]));
  }

  double reach_m() const { return reach_m_; }

  void respond(const field::SensorSetting& setting, std::span<field::EffectResponse> responses) const {
    if (const auto layer = layerOf(holderOf_m(setting)[axis_])) {
      responses[*layer].shift_m = setting.tracker_from_reference.orientation * Eigen::Vector3d::Unit(axis_);
    }
  }

 private:
  std::optional<std::size_t> layerOf(double height_m) const {
    const auto nearest = std::min_element(heights_m_.begin(), heights_m_.end(), [&](double a, double b) {
      return std::abs(a - height_m) < std::abs(b - height_m);
    });
    if (std::abs(*nearest - height_m) > reach_m_) return std::nullopt;
    return static_cast<std::size_t>(nearest - heights_m_.begin());
  }

  int axis_;
  std::vector<double> heights_m_;
  double reach_m_ = std::numeric_limits<double>::infinity();
};

UnitResponses responsesOf(const Layers& layers) {
  return [layers](const field::SensorSetting& setting, std::span<field::EffectResponse> responses) {
    layers.respond(setting, responses);
  };
}

int axisOf(const nlohmann::json& parameters) {
  const auto axis = parameters.at("axis").get<std::string>();
  return axis == "x" ? 0 : axis == "y" ? 1 : 2;
}

Result<std::unique_ptr<field::PhysicalEffect>> make(const nlohmann::json& parameters,
                                                    const field::Excitation& /*excitation*/) {
  const std::vector<double> heights_m = numbersOf(parameters, "heights_m");
  const std::vector<double> offsets_m = numbersOf(parameters, "offsets_m");
  if (heights_m.size() != offsets_m.size()) {
    return fail(ErrorCode::kBadInput, "jig_layer_offset: heights_m has " + std::to_string(heights_m.size()) +
                                          " numbers and offsets_m " + std::to_string(offsets_m.size()) +
                                          "; every layer needs one of each.");
  }
  if (heights_m.size() < 2) {
    return fail(
        ErrorCode::kBadInput,
        "jig_layer_offset: heights_m has one layer; it needs at least two, for half their spacing decides which "
        "places belong to a layer.");
  }
  const Layers layers(axisOf(parameters), heights_m);
  if (layers.reach_m() < 1e-6) {
    return fail(ErrorCode::kBadInput,
                "jig_layer_offset: heights_m holds the same height twice; every layer may stand "
                "there once.");
  }
  return linearEffect(responsesOf(layers),
                      Eigen::Map<const Eigen::VectorXd>(offsets_m.data(), static_cast<Eigen::Index>(offsets_m.size())));
}

/// Places of a design, seen along one axis.
struct Layer {
  double height_m = 0.0;
  std::vector<Eigen::Vector3d> places_m;  ///< Each once.
};

void addPlace(Layer& layer, const Eigen::Vector3d& q_m, double same_m) {
  const bool is_known = std::any_of(layer.places_m.begin(), layer.places_m.end(),
                                    [&](const Eigen::Vector3d& known_m) { return (known_m - q_m).norm() < same_m; });
  if (!is_known) layer.places_m.push_back(q_m);
}

/// Groups of equal heights; a new one begins where the next height is more than a fifth of the pitch above.
std::vector<Layer> layersAlong(int axis, std::vector<Eigen::Vector3d> places_m, double pitch_m) {
  std::sort(places_m.begin(), places_m.end(),
            [axis](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return a[axis] < b[axis]; });
  std::vector<Layer> layers;
  double last_m = -std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& q_m : places_m) {
    if (q_m[axis] - last_m > 0.2 * pitch_m) layers.emplace_back();
    addPlace(layers.back(), q_m, 0.05 * pitch_m);
    last_m = q_m[axis];
  }
  for (Layer& layer : layers) {
    for (const Eigen::Vector3d& q_m : layer.places_m) {
      layer.height_m += q_m[axis] / static_cast<double>(layer.places_m.size());
    }
  }
  return layers;
}

/// Whether every place of a layer is within a fifth of the pitch of its middle: scattered places make no layers.
bool isFlat(const Layer& layer, int axis, double pitch_m) {
  return std::all_of(layer.places_m.begin(), layer.places_m.end(),
                     [&](const Eigen::Vector3d& q_m) { return std::abs(q_m[axis] - layer.height_m) < 0.2 * pitch_m; });
}

std::unique_ptr<EffectFit> wayAlong(int axis, const std::vector<Layer>& layers) {
  std::vector<double> heights_m;
  std::vector<FitParameter> linear;
  for (const Layer& layer : layers) {
    heights_m.push_back(layer.height_m);
    linear.push_back({"layer_" + std::to_string(heights_m.size()) + "_m", "m", -kPlausible_m, kPlausible_m});
  }
  const std::string name = kAxes[static_cast<std::size_t>(axis)];
  return linearFit({name, std::move(linear), responsesOf(Layers(axis, heights_m)),
                    [name, heights_m](const Eigen::VectorXd& offsets_m) {
                      return nlohmann::json{
                          {"axis", name},
                          {"heights_m", heights_m},
                          {"offsets_m", std::vector<double>(offsets_m.data(), offsets_m.data() + offsets_m.size())}};
                    }});
}

std::vector<std::unique_ptr<EffectFit>> fits(const FitDesign& design) {
  std::vector<Eigen::Vector3d> places_m;
  for (const field::SensorSetting& setting : design.settings) places_m.push_back(holderOf_m(setting));
  std::vector<std::unique_ptr<EffectFit>> ways;
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<Layer> layers = layersAlong(axis, places_m, design.pitch_m);
    if (layers.size() < kFewestLayers || layers.size() > kMostLayers) continue;
    const bool are_layers = std::all_of(layers.begin(), layers.end(), [&](const Layer& layer) {
      return layer.places_m.size() >= kFewestPlacesOfALayer && isFlat(layer, axis, design.pitch_m);
    });
    if (are_layers) ways.push_back(wayAlong(axis, layers));
  }
  return ways;
}

}  // namespace
}  // namespace jig_layer_offset

/// Layers of a rig that are too high or too low: pipes cut to the wrong length, a shelf on another peg.
///
/// Convention: a holder in the layer at the height h along one of the rig's axes is really at h + offset. It belongs to
/// the nearest layer of the list, and to none where that is farther than half the smallest spacing of the list.
/// @source geometry, by hand
Effect jigLayerOffsetEffect() {
  using namespace jig_layer_offset;
  Effect effect;
  effect.id = "jig_layer_offset";
  effect.label = "Layers of the rig at a wrong height";
  effect.source = "Geometry";
  effect.parameters = {
      declare::choice("axis", {"x", "y", "z"}, "z",
                      "Axis of the rig across which the layers lie and along which they are displaced."),
      declare::numbers("heights_m", {-100.0, 100.0, "m"}, {-0.4572, -0.1524, 0.1524, 0.4572},
                       "Where the rig says the layers are along that axis, rig's frame."),
      declare::numbers("offsets_m", {-100.0, 100.0, "m"}, {0.0, 0.0, 0.0, 0.0},
                       "How far each layer really is beyond that.")
          .plausibly(-kPlausible_m, kPlausible_m)};
  effect.make = make;
  effect.fits = fits;
  effect.needs_dipoles = false;
  return effect;
}

}  // namespace fieldtrue::effects
