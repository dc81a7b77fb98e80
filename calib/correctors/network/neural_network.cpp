#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/core/declare.h"
#include "calib/core/json_reader.h"
#include "calib/correctors/base/fit_checks.h"
#include "calib/correctors/base/method.h"
#include "calib/correctors/base/rows.h"
#include "calib/correctors/network/feed_forward_network.h"
#include "calib/correctors/network/neural_network_training.h"

namespace fieldtrue::correctors {
namespace {

const std::string kName = "Neural network";
constexpr int kSecondHidden = 4;

/// Positions moved to the middle of their box and divided by half its longest side.
struct Scaling {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  double half_m = 1.0;

  static Scaling of(const std::vector<Eigen::Vector3d>& p_m) {
    Eigen::Vector3d low_m = p_m.front();
    Eigen::Vector3d high_m = p_m.front();
    for (const Eigen::Vector3d& p : p_m) {
      low_m = low_m.cwiseMin(p);
      high_m = high_m.cwiseMax(p);
    }
    const double half_m = 0.5 * (high_m - low_m).maxCoeff();
    return {0.5 * (low_m + high_m), half_m > 0.0 ? half_m : 1.0};
  }
  Eigen::Vector3d scaled(const Eigen::Vector3d& p_m) const { return (p_m - center_m) / half_m; }

  nlohmann::json toJson() const { return {{"center_m", jsonOf(center_m)}, {"half_m", half_m}}; }
  static Scaling fromJson(const JsonReader& json) {
    const Scaling scaling{json["center_m"].vector3(), json["half_m"].number()};
    if (!(scaling.half_m > 0.0)) json["half_m"].refuse("above 0");
    return scaling;
  }
};

/// The network maps tracked positions to true ones.
class NeuralNetworkPosition : public PositionModel {
 public:
  NeuralNetworkPosition(FeedForwardNetwork network, const Scaling& tracked, const Scaling& truth, std::string note)
      : network_(std::move(network)), tracked_(tracked), truth_(truth), note_(std::move(note)) {}

  Eigen::Vector3d displacement_m(const Eigen::Vector3d& p_tracked_m) const override {
    return truth_.center_m + truth_.half_m * network_.output(tracked_.scaled(p_tracked_m)) - p_tracked_m;
  }
  Eigen::Matrix3d jacobian(const Eigen::Vector3d& p_tracked_m) const override {
    return truth_.half_m / tracked_.half_m * network_.gradient(tracked_.scaled(p_tracked_m));
  }
  std::string note() const override { return note_; }
  nlohmann::json parameters() const override {
    return {{"network", network_.toJson()}, {"tracked", tracked_.toJson()}, {"true", truth_.toJson()}, {"note", note_}};
  }

 private:
  FeedForwardNetwork network_;
  Scaling tracked_;
  Scaling truth_;
  std::string note_;
};

Result<void> checkPlaces(const FitData& data, const Places& places, int n_weights) {
  if (data.dimension < 2 || pointSpread(places.p_tracked_m).dimension < 2)
    return fail(ErrorCode::kDegenerate, kName + " needs places that span a plane or a volume, and these " +
                                            std::to_string(places.size()) + " do not");
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

/// A trained network and what is to be told of its training.
struct Trained {
  FeedForwardNetwork network;
  std::string note;
};

/// From one too light to smooth to one that does, or the one asked for. The other way round the strong ones lead
/// astray: they end where the network says next to nothing.
std::vector<double> penaltiesOf(const Settings& settings) {
  if (std::holds_alternative<std::string>(settings.at("weight_penalty"))) return {1e-7, 1e-6, 1e-5, 1e-4, 1e-3};
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
      return Trained{std::move(network), {}};
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

Result<std::unique_ptr<PositionModel>> fitNeuralNetwork(const FitData& data, const Settings& settings,
                                                        const RunControl& control) {
  FT_TRY_VOID(checkPositions(data, kName));
  const Places places = mergePlaces(data);
  const int n_weights =
      FeedForwardNetwork::weightCount(static_cast<int>(integerSetting(settings, "hidden")), kSecondHidden);
  FT_TRY_VOID(checkPlaces(data, places, n_weights));
  const Scaling tracked = Scaling::of(places.p_tracked_m);
  const Scaling truth = Scaling::of(places.p_true_m);
  TrainingSet set;
  for (std::size_t i = 0; i < places.size(); ++i) {
    set.input.push_back(tracked.scaled(places.p_tracked_m[i]));
    set.target.push_back(truth.scaled(places.p_true_m[i]));
  }
  FT_TRY(auto trained, train(set, settings, truth.half_m, control));
  const std::string plane = planeNote(data, "nothing is claimed off it");
  const std::string note = plane + (plane.empty() || trained.note.empty() ? "" : " ") + trained.note;
  return std::make_unique<NeuralNetworkPosition>(std::move(trained.network), tracked, truth, note);
}

std::unique_ptr<PositionModel> loadNeuralNetwork(const JsonReader& parameters) {
  return std::make_unique<NeuralNetworkPosition>(FeedForwardNetwork::fromJson(parameters["network"]),
                                                 Scaling::fromJson(parameters["tracked"]),
                                                 Scaling::fromJson(parameters["true"]), parameters["note"].text());
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
          "keeps weights from running away; 0 = none, auto = of 1e-7 to 1e-3 the one that foretells left-out places "
          "best."),
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

PositionMethod neuralNetworkPosition() {
  return {
      .id = "neural_network",
      .label = "Neural network",
      .source =
          "Saleh, Kindratenko, Sherman, On Using Neural Networks to Calibrate Electromagnetic Tracking Systems; survey "
          "by Kindratenko, section 3.6",
      .settings = neuralNetworkSettings(),
      .fit = fitNeuralNetwork,
      .read = loadNeuralNetwork,
      .cost = FitCost::kCostly,
      .origin = MethodOrigin::kSurvey};
}

}  // namespace fieldtrue::correctors
