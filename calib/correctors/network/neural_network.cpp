#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/core/declare.h"
#include "calib/core/json_reader.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/readers.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/base/soft_box.h"
#include "calib/correctors/network/feed_forward_network.h"
#include "calib/correctors/network/neural_network_training.h"
#include "calib/geometry/geometry.h"

namespace fieldtrue::correctors {
namespace {

const std::string kName = "Neural network";
constexpr int kSecondHidden = 4;

/// Share of the longest side of the places' box by which the network is asked beyond it at most.
constexpr double kReach = 0.15;
/// By which a correction may exceed the largest that it was fitted to.
constexpr double kExcess = 0.5;

/// Positions moved to the middle of their box and divided by half its longest side.
struct Scaling {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  double half_m = 1.0;

  static Scaling of(const SoftBox& box) {
    const double half_m = 0.5 * box.longest_m();
    return {0.5 * (box.low_m + box.high_m), half_m > 0.0 ? half_m : 1.0};
  }
  Eigen::Vector3d scaled(const Eigen::Vector3d& p_m) const { return (p_m - center_m) / half_m; }
};

/// Outputs up to the length of the largest target as they are, longer ones bent towards 1 + kExcess, with two
/// continuous derivatives.
double boundedLength(double length) {
  return length <= 1.0 ? length : 1.0 + kExcess * std::tanh((length - 1.0) / kExcess);
}

Eigen::Vector3d bounded(const Eigen::Vector3d& output) {
  const double length = output.norm();
  return length <= 1.0 ? output : Eigen::Vector3d(boundedLength(length) / length * output);
}

/// d bounded / d output.
Eigen::Matrix3d boundedSlope(const Eigen::Vector3d& output) {
  const double length = output.norm();
  if (length <= 1.0) return Eigen::Matrix3d::Identity();
  const double along = 1.0 - std::pow(std::tanh((length - 1.0) / kExcess), 2);
  const double across = boundedLength(length) / length;
  const Eigen::Vector3d way = output / length;
  return across * Eigen::Matrix3d::Identity() + (along - across) * way * way.transpose();
}

/// What the network adds to a rigid motion of the tracked positions.
struct NetworkParts {
  FeedForwardNetwork network;
  Pose true_from_tracked;
  SoftBox box;             ///< Of the tracked places.
  double largest_m = 1.0;  ///< The longest correction beyond the motion among the places: 1 of the network's output.
  std::string note;
};

class NeuralNetworkPosition : public PositionModel {
 public:
  explicit NeuralNetworkPosition(NetworkParts parts) : parts_(std::move(parts)), tracked_(Scaling::of(parts_.box)) {}

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    return parts_.true_from_tracked * p_tracked_m + parts_.largest_m * bounded(outputAt(p_tracked_m)) - p_tracked_m;
  }
  Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const override {
    const Eigen::Vector3d input = tracked_.scaled(parts_.box.held_m(p_tracked_m));
    const Eigen::Matrix3d by_held = parts_.largest_m / tracked_.half_m * boundedSlope(parts_.network.output(input)) *
                                    parts_.network.gradient(input);
    return parts_.true_from_tracked.orientation.toRotationMatrix() +
           by_held * parts_.box.slope(p_tracked_m).asDiagonal();
  }
  std::string note() const override { return parts_.note; }
  nlohmann::json parameters() const override {
    return {{"network", parts_.network.toJson()},
            {"true_from_tracked", jsonOf(parts_.true_from_tracked)},
            {"low_m", jsonOf(parts_.box.low_m)},
            {"high_m", jsonOf(parts_.box.high_m)},
            {"reach_m", parts_.box.reach_m},
            {"largest_m", parts_.largest_m},
            {"note", parts_.note}};
  }

 private:
  Eigen::Vector3d outputAt(const Eigen::Vector3d& p_tracked_m) const {
    return parts_.network.output(tracked_.scaled(parts_.box.held_m(p_tracked_m)));
  }

  NetworkParts parts_;
  Scaling tracked_;
};

Result<void> checkPlaces(const FitData& data, const Places& places, int n_weights) {
  const int dimension = std::min(data.dimension, pointSpread(places.p_tracked_m).dimension);
  FT_TRY_VOID(checkSpread(kName, places.size(), dimension));
  const auto needed = static_cast<std::size_t>((n_weights + 2) / 3);
  if (places.size() < needed)
    return fail(ErrorCode::kTooFewNodes, kName + " has " + std::to_string(n_weights) + " weights and needs at least " +
                                             std::to_string(needed) + " places, got " + std::to_string(places.size()));
  return {};
}

std::string unfinishedNote(const BackPropagationResult& result, double mean_error_m, double stop_error_m) {
  if (mean_error_m < stop_error_m) return {};
  char text[160];
  std::snprintf(text, sizeof text,
                "Back-propagation ended after %d epochs at an average error of %.1f mm, above the %.1f mm asked for.",
                result.n_epochs, 1000.0 * mean_error_m, 1000.0 * stop_error_m);
  return text;
}

constexpr const char* kNothingForetold =
    "The network foretells places left out no better than no correction does: only the alignment is corrected";

/// A trained network and what is to be told of its training.
struct Trained {
  FeedForwardNetwork network;
  std::string note;
};

/// From one too light to smooth to one that does, or the one asked for. The other way round the strong ones lead
/// astray: they end where the network says next to nothing.
std::vector<double> penaltiesOf(const Settings& settings) {
  if (std::holds_alternative<std::string>(settings.at("weight_penalty"))) return {1e-6, 1e-5, 1e-4, 1e-3, 1e-2};
  return {numberSetting(settings, "weight_penalty")};
}

Result<Trained> train(const TrainingSet& set, const Settings& settings, double unit_m, const RunControl& control) {
  const FeedForwardNetwork layers(static_cast<int>(integerSetting(settings, "hidden")), kSecondHidden);
  const auto seed = static_cast<std::uint64_t>(integerSetting(settings, "seed"));
  if (choiceSetting(settings, "training") == "levenberg_marquardt") {
    LevenbergMarquardtOptions options;
    options.n_starts = static_cast<int>(integerSetting(settings, "starts"));
    options.max_iterations = static_cast<int>(integerSetting(settings, "max_iterations"));
    options.weight_penalties = penaltiesOf(settings);
    options.seed = seed;
    return trainByLevenbergMarquardt(layers, set, options, control).map([](FeedForwardNetwork network) {
      const bool is_silent = network.weights().isZero();
      return Trained{std::move(network), is_silent ? kNothingForetold : ""};
    });
  }
  const double stop_error_m = numberSetting(settings, "stop_error_m");
  BackPropagationOptions options;
  options.learning_rate = numberSetting(settings, "learning_rate");
  options.momentum = numberSetting(settings, "momentum");
  options.max_epochs = static_cast<int>(integerSetting(settings, "max_epochs"));
  options.stop_error = stop_error_m / unit_m;
  options.seed = seed;
  return trainByBackPropagation(layers, set, options, control).map([&](const BackPropagationResult& result) {
    return Trained{result.network, unfinishedNote(result, unit_m * result.mean_error, stop_error_m)};
  });
}

/// All but the network and the note.
Result<NetworkParts> untrained(const Places& places) {
  NetworkParts parts;
  FT_TRY(parts.true_from_tracked, fitRigid(places.p_tracked_m, places.p_true_m));
  parts.box = SoftBox::around(places.p_tracked_m, kReach);
  double largest_m = 0.0;
  for (std::size_t i = 0; i < places.size(); ++i)
    largest_m = std::max(largest_m, (places.p_true_m[i] - parts.true_from_tracked * places.p_tracked_m[i]).norm());
  if (largest_m > 0.0) parts.largest_m = largest_m;
  return parts;
}

Result<std::unique_ptr<PositionModel>> fitNeuralNetwork(const FitData& data, const Settings& settings,
                                                        const RunControl& control) {
  FT_TRY_VOID(checkPositions(data, kName));
  const Places places = mergePlaces(data);
  const int n_weights =
      FeedForwardNetwork::weightCount(static_cast<int>(integerSetting(settings, "hidden")), kSecondHidden);
  FT_TRY_VOID(checkPlaces(data, places, n_weights));
  FT_TRY(NetworkParts parts, untrained(places));
  TrainingSet set;
  const Scaling tracked = Scaling::of(parts.box);
  for (std::size_t i = 0; i < places.size(); ++i) {
    set.input.push_back(tracked.scaled(places.p_tracked_m[i]));
    set.target.push_back((places.p_true_m[i] - parts.true_from_tracked * places.p_tracked_m[i]) / parts.largest_m);
  }
  FT_TRY(auto trained, train(set, settings, parts.largest_m, control));
  parts.network = std::move(trained.network);
  const std::string plane = planeNote(data, "nothing is claimed off it");
  parts.note = plane + (plane.empty() || trained.note.empty() ? "" : " ") + trained.note;
  return std::make_unique<NeuralNetworkPosition>(std::move(parts));
}

/// Back-propagation has no weight penalty.
bool usesSetting(const Settings& settings, const std::string& key) {
  return key != "weight_penalty" || choiceSetting(settings, "training") == "levenberg_marquardt";
}

std::vector<Setting> neuralNetworkSettings() {
  return {
      declare::integer("hidden", "First hidden layer", {2, 16}, 8,
                       "Nodes of the first hidden layer; 7 or 8 are published."),
      declare::choice("training", "Training", {"levenberg_marquardt", "back_propagation"}, "levenberg_marquardt",
                      "Least squares from several starts, or the published back-propagation of one pair at a time."),
      declare::integer("starts", "Starts", {1, 20}, 4,
                       "Random starts of levenberg_marquardt; the one that foretells left-out places best is kept."),
      declare::integer(
          "max_iterations", "Most iterations", {1, 2000}, 200,
          "levenberg_marquardt ends after so many at the latest, and after a quarter with each further penalty."),
      declare::autoNumber(
          "weight_penalty", "Weight penalty", {0.0, 1.0}, "auto",
          "Factor of the squared weights beside the squared scaled errors in levenberg_marquardt. Not published: it "
          "keeps weights from running away; 0 = none, auto = of 1e-6 to 1e-2 the one that foretells left-out parts "
          "best, or no network where none does."),
      declare::number("learning_rate", "Learning rate", {0.001, 1.0}, 0.05,
                      "Of back_propagation; 0.01 to 0.1 are published."),
      declare::number("momentum", "Momentum", {0.0, 0.99}, 0.5,
                      "Of back_propagation: share of the last change in the next."),
      declare::number(
          "stop_error_m", "Stop at", {1e-5, 1.0, "m"}, 0.01,
          "back_propagation ends when the average output error falls below it; 0.01 is published without a unit, "
          "read as metres."),
      declare::integer("max_epochs", "Most epochs", {1, 1000000}, 3000,
                       "back_propagation ends after so many passes at the latest."),
      declare::integer("seed", "Seed", {0, 1000000}, 1, "Of the random starts; the same seed gives the same network.")};
}

}  // namespace

std::unique_ptr<PositionModel> readNeuralNetworkPosition(const JsonReader& parameters) {
  NetworkParts parts;
  parts.network = FeedForwardNetwork::fromJson(parameters["network"]);
  parts.true_from_tracked = parameters["true_from_tracked"].pose();
  parts.box = {parameters["low_m"].vector3(), parameters["high_m"].vector3(), parameters["reach_m"].number()};
  if (!(parts.box.longest_m() > 0.0)) parameters["high_m"].refuse("above low_m");
  if (!(parts.box.reach_m >= 0.0)) parameters["reach_m"].refuse("0 or above");
  parts.largest_m = parameters["largest_m"].number();
  parts.note = parameters["note"].text();
  return std::make_unique<NeuralNetworkPosition>(std::move(parts));
}

PositionMethod neuralNetworkPosition() {
  return {
      .id = "neural_network",
      .label = "Neural network",
      .source =
          "Saleh, Kindratenko, Sherman, On Using Neural Networks to Calibrate Electromagnetic Tracking Systems; survey "
          "by Kindratenko, section 3.6",
      .settings = neuralNetworkSettings(),
      .fit = fitNeuralNetwork,
      .read = readNeuralNetworkPosition,
      .cost = FitCost::kCostly,
      .origin = MethodOrigin::kSurvey,
      .reading =
          "What the outputs are is not said: published runs give positions; here they give what a rigid motion leaves, "
          "since a position given outright runs away from the sensor beyond the places.",
      .uses = usesSetting};
}

}  // namespace fieldtrue::correctors
