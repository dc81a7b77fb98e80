#include <QTest>
#include <atomic>
#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/correctors/base/method.h"
#include "calib/correctors/network/neural_network_training.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

double logistic(double s) { return 1.0 / (1.0 + std::exp(-s)); }

/// One node in each hidden layer, weights made by hand: 3 + 1, 1 + 1, 3 + 3 of them.
FeedForwardNetwork smallNetwork() {
  FeedForwardNetwork network(1, 1);
  Eigen::VectorXd weights(12);
  weights << 0.5, -1.0, 2.0, 0.25, 3.0, -1.5, 1.0, -2.0, 0.5, 0.1, 0.2, 0.3;
  network.setWeights(weights);
  return network;
}

TrainingSet singlePair() { return {{{0.3, -0.2, 0.4}}, {{0.5, -0.1, 0.2}}}; }

/// Pairs that a network of these layers can represent exactly.
TrainingSet taughtBy(const FeedForwardNetwork& teacher, std::size_t count) {
  TrainingSet set;
  for (const Eigen::Vector3d& p : randomPoints(count)) {
    set.input.push_back((p - Eigen::Vector3d(1.0, 0.3, 0.4)) / 0.8);
    set.target.push_back(teacher.output(set.input.back()));
  }
  return set;
}

double rmsError(const FeedForwardNetwork& network, const TrainingSet& set) {
  double squares = 0.0;
  for (std::size_t i = 0; i < set.input.size(); ++i)
    squares += (network.output(set.input[i]) - set.target[i]).squaredNorm();
  return std::sqrt(squares / static_cast<double>(set.input.size()));
}

Eigen::Vector3d curved_m(const Eigen::Vector3d& p) {
  return {0.05 * std::sin(2.0 * p.x() + p.y()), 0.04 * p.x() * p.z(), 0.03 * std::cos(3.0 * p.y())};
}

RunControl stoppedControl() {
  std::stop_source stop;
  stop.request_stop();
  RunControl control;
  control.stop = stop.get_token();
  return control;
}

const std::vector<std::string> kTrainings = {"levenberg_marquardt", "back_propagation"};

}  // namespace

class NeuralNetworkTest : public QObject {
  Q_OBJECT
 private slots:
  void outputByHand() {
    // s1 = 0.5 * 0.3 + 0.2 + 2 * 0.4 + 0.25, s2 = 3 f(s1) - 1.5, outputs f(s2) times 1, -2, 0.5 plus 0.1, 0.2, 0.3.
    const double second = logistic(3.0 * logistic(1.4) - 1.5);
    const Eigen::Vector3d expected(second + 0.1, -2.0 * second + 0.2, 0.5 * second + 0.3);
    FT_VERIFY_MATCH(near(smallNetwork().output({0.3, -0.2, 0.4}), expected, 1e-14));
  }

  void hasTheWeightsOfItsLayers() {
    // 8 and 4 nodes with biases: 3*8 + 8 + 8*4 + 4 + 4*3 + 3.
    QCOMPARE(FeedForwardNetwork::weightCount(8, 4), 83);
    QCOMPARE(FeedForwardNetwork::weightCount(7, 4), 75);
  }

  void derivativesAreThoseOfFiniteDifferences() {
    FeedForwardNetwork network(8, 4);
    network.setRandomWeights(5);
    const Eigen::Vector3d x(0.3, -0.7, 0.5);
    FeedForwardNetwork::WeightJacobian jacobian;
    FT_VERIFY_MATCH(near(network.outputWithWeightJacobian(x, jacobian), network.output(x), 1e-15));
    constexpr double kStep = 1e-5;
    for (Eigen::Index i = 0; i < 83; ++i) {
      FeedForwardNetwork above = network;
      FeedForwardNetwork below = network;
      Eigen::VectorXd weights = network.weights();
      weights[i] += kStep;
      above.setWeights(weights);
      weights[i] -= 2.0 * kStep;
      below.setWeights(weights);
      const Eigen::Vector3d slope = (above.output(x) - below.output(x)) / (2.0 * kStep);
      FT_VERIFY_MATCH(near(Eigen::Vector3d(jacobian.col(i)), slope, 1e-8));
    }
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
      const Eigen::Vector3d slope = (network.output(x + step) - network.output(x - step)) / (2.0 * kStep);
      FT_VERIFY_MATCH(near(Eigen::Vector3d(network.gradient(x).col(axis)), slope, 1e-8));
    }
  }

  void levenbergMarquardtFindsWhatTheLayersCanRepresent() {
    FeedForwardNetwork teacher(3, 2);
    teacher.setRandomWeights(77);
    LevenbergMarquardtOptions options;
    options.n_starts = 4;
    options.max_iterations = 500;
    const TrainingSet set = taughtBy(teacher, 200);
    const auto pupil = trainByLevenbergMarquardt(FeedForwardNetwork(8, 4), set, options, {});
    FT_VERIFY_OK(pupil);
    FT_VERIFY_MATCH(near(rmsError(*pupil, set), 0.0, 1e-3));
    // And between the places it was taught at.
    TrainingSet unseen;
    for (const Eigen::Vector3d& p : randomPoints(300, 99)) {
      unseen.input.push_back((p - Eigen::Vector3d(1.0, 0.3, 0.4)) / 0.8);
      unseen.target.push_back(teacher.output(unseen.input.back()));
    }
    FT_VERIFY_MATCH(near(rmsError(*pupil, unseen), 0.0, 5e-3));
  }

  void penaltyHoldsWeightsDown() {
    FeedForwardNetwork teacher(3, 2);
    teacher.setRandomWeights(77);
    LevenbergMarquardtOptions options;
    options.n_starts = 1;
    const TrainingSet set = taughtBy(teacher, 100);
    const auto free_weights = trainByLevenbergMarquardt(FeedForwardNetwork(8, 4), set, options, {});
    options.weight_penalties = {1e-2};
    const auto held = trainByLevenbergMarquardt(FeedForwardNetwork(8, 4), set, options, {});
    FT_VERIFY_OK(free_weights);
    FT_VERIFY_OK(held);
    QVERIFY(held->weights().norm() < 0.5 * free_weights->weights().norm());
  }

  void backPropagationStepsDownTheGradientWithMomentum() {
    // One pair: w1 = w0 - rate J^T e, and the second step adds the momentum's share of the first.
    FeedForwardNetwork network(2, 2);
    BackPropagationOptions options;
    options.learning_rate = 0.1;
    options.momentum = 0.6;
    options.stop_error = 0.0;
    options.max_epochs = 2;
    const TrainingSet set = singlePair();
    const auto trained = trainByBackPropagation(network, set, options, {});
    FT_VERIFY_OK(trained);
    QCOMPARE(trained->n_epochs, 2);
    network.setRandomWeights(1000003 * options.seed);
    FeedForwardNetwork::WeightJacobian jacobian;
    Eigen::VectorXd change = Eigen::VectorXd::Zero(network.weights().size());
    double error = 0.0;
    for (int epoch = 0; epoch < 2; ++epoch) {
      const Eigen::Vector3d e = network.outputWithWeightJacobian(set.input[0], jacobian) - set.target[0];
      change = 0.6 * change - 0.1 * jacobian.transpose() * e;
      network.setWeights(network.weights() + change);
      error = e.norm();
    }
    FT_VERIFY_MATCH(near((trained->network.weights() - network.weights()).norm(), 0.0, 1e-14));
    FT_VERIFY_MATCH(near(trained->mean_error, error, 1e-14));
  }

  void backPropagationStopsAtTheErrorAskedFor() {
    const FitData data = fitDataOf(shakenGrid({5, 5, 4}, 0.2, 0.02), curved_m);
    const auto coarse =
        fitPosition("neural_network", data, {{"training", "back_propagation"}, {"stop_error_m", "0.1"}});
    FT_VERIFY_OK(coarse);
    QCOMPARE((*coarse)->note(), std::string());
    double sum_m = 0.0;
    for (const Eigen::Vector3d& p_m : data.p_tracked_m)
      sum_m += ((*coarse)->displacement_m(p_m) - curved_m(p_m)).norm();
    QVERIFY(sum_m / static_cast<double>(data.size()) < 0.11);  // The last epoch went on below 0.1 m.
    const auto never = fitPosition("neural_network", data,
                                   {{"training", "back_propagation"}, {"stop_error_m", "1e-5"}, {"max_epochs", "20"}});
    FT_VERIFY_OK(never);
    FT_VERIFY_MATCH(holdsAll((*never)->note(), {"after 20 epochs", "above the 0.0 mm"}));
  }

  void trainingMakesTheErrorSmall_data() {
    QTest::addColumn<QString>("training");
    QTest::addColumn<double>("left_m");
    QTest::newRow("levenberg_marquardt") << "levenberg_marquardt" << 0.002;
    QTest::newRow("back_propagation") << "back_propagation" << 0.025;
  }
  void trainingMakesTheErrorSmall() {
    // The field moves places by 57 mm RMS.
    QFETCH(QString, training);
    QFETCH(double, left_m);
    const FitData data = fitDataOf(shakenGrid({5, 5, 4}, 0.2, 0.02), curved_m);
    const auto model = fitPosition("neural_network", data, {{"training", training.toStdString()}});
    FT_VERIFY_OK(model);
    double squares_m2 = 0.0;
    for (const Eigen::Vector3d& p_m : data.p_tracked_m)
      squares_m2 += ((*model)->displacement_m(p_m) - curved_m(p_m)).squaredNorm();
    QVERIFY(std::sqrt(squares_m2 / static_cast<double>(data.size())) < left_m);
  }

  void aSeedGivesOneNetworkWhateverTheThreads() {
    const FitData data = fitDataOf(shakenGrid({4, 4, 4}, 0.2, 0.02), curved_m);
    const PositionMethod& method = *findPositionMethod("neural_network").value();
    RunControl backwards;
    backwards.parallel_for = [](std::size_t count, const std::function<void(std::size_t)>& body) {
      for (std::size_t i = count; i > 0; --i) body(i - 1);
    };
    for (const std::string& training : kTrainings) {
      const Settings settings =
          settingsOf(method, {{"training", training}, {"max_epochs", "50"}, {"max_iterations", "30"}});
      const auto first = method.fit(data, settings, {});
      const auto second = method.fit(data, settings, backwards);
      FT_VERIFY_OK(first);
      FT_VERIFY_OK(second);
      QVERIFY((*first)->parameters() == (*second)->parameters());
      const auto other = method.fit(
          data,
          settingsOf(method, {{"training", training}, {"max_epochs", "50"}, {"max_iterations", "30"}, {"seed", "2"}}),
          {});
      FT_VERIFY_OK(other);
      QVERIFY((*first)->parameters() != (*other)->parameters());
    }
  }

  void reportsProgressAndStopsOnRequest() {
    const FitData data = fitDataOf(shakenGrid({4, 4, 4}, 0.2, 0.02), curved_m);
    const PositionMethod& method = *findPositionMethod("neural_network").value();
    for (const std::string& training : kTrainings) {
      const Settings settings = settingsOf(method, {{"training", training}, {"stop_error_m", "1e-5"}});
      const auto at_once = method.fit(data, settings, stoppedControl());
      QVERIFY(!at_once && at_once.error().code == ErrorCode::kCancelled);
      // Stopped by the third report of progress: no more than a few follow.
      std::stop_source stop;
      std::atomic<int> n_reports = 0;
      RunControl control;
      control.stop = stop.get_token();
      control.progress = [&](double fraction) {
        QVERIFY(fraction > 0.0 && fraction <= 1.0);
        if (++n_reports == 3) stop.request_stop();
      };
      const auto midway = method.fit(data, settings, control);
      QVERIFY(!midway && midway.error().code == ErrorCode::kCancelled);
      QVERIFY(n_reports < 10);
    }
  }

  // Beside noise of the places there is nothing to learn, so a network that foretells less than nothing is not kept.
  void correctsNothingWhereThereIsNoiseOnly() {
    for (const unsigned seed : {1U, 2U, 3U}) {
      RandomGeometry random(seed);
      const auto noise_m = [&](const Eigen::Vector3d&) {
        return Eigen::Vector3d(0.01 * Eigen::Vector3d(random.normal(), random.normal(), random.normal()));
      };
      const FitData data = fitDataOf(shakenGrid({4, 3, 3}, 0.3, 0.02), noise_m);
      const auto model = fitPosition("neural_network", data);
      const auto rigid = fitPosition("rigid", data);
      FT_VERIFY_OK(model);
      FT_VERIFY_OK(rigid);
      FT_VERIFY_MATCH(holdsAll((*model)->note(), {"no better than no correction"}));
      for (const Eigen::Vector3d& p_m : randomPoints(50))
        FT_VERIFY_MATCH(near((*model)->displacement_m(p_m), (*rigid)->displacement_m(p_m), 1e-12));
    }
  }

  // Whatever the weights: beyond the motion no correction is longer than one and a half of the longest at the places,
  // and far out it is level.
  void staysBoundedEverywhere() {
    const FitData data = fitDataOf(shakenGrid({4, 4, 4}, 0.2, 0.02), curved_m);
    const auto rigid = fitPosition("rigid", data);
    FT_VERIFY_OK(rigid);
    double longest_m = 0.0;
    for (const Eigen::Vector3d& p_m : data.p_tracked_m)
      longest_m = std::max(longest_m, (curved_m(p_m) - (*rigid)->displacement_m(p_m)).norm());
    for (const char* penalty : {"auto", "0"}) {
      const auto model = fitPosition("neural_network", data, {{"weight_penalty", penalty}, {"starts", "1"}});
      FT_VERIFY_OK(model);
      const auto beyond_m = [&](const Eigen::Vector3d& p_m) -> Eigen::Vector3d {
        return (*model)->displacement_m(p_m) - (*rigid)->displacement_m(p_m);
      };
      for (const Eigen::Vector3d& p_m : randomPoints(300)) {
        QVERIFY(beyond_m(p_m).norm() <= 1.5 * longest_m + 1e-12);
        QVERIFY(beyond_m(1000.0 * p_m).norm() <= 1.5 * longest_m + 1e-9);
        FT_VERIFY_MATCH(near(beyond_m(1000.0 * p_m), beyond_m(2000.0 * p_m), 1e-9));
      }
    }
  }

  // Inside, across the faces of the places' box and where an output is held down. Nearer to a bend than the step there
  // is no slope: where a half step tells another one.
  void jacobianIsThatOfFiniteDifferences() {
    const FitData data = fitDataOf(shakenGrid({4, 4, 4}, 0.2, 0.02), curved_m);
    const auto model = fitPosition("neural_network", data, {{"weight_penalty", "0"}, {"starts", "1"}});
    FT_VERIFY_OK(model);
    const auto slope = [&](const Eigen::Vector3d& p_m, int axis, double size_m) -> Eigen::Vector3d {
      const Eigen::Vector3d step_m = size_m * Eigen::Vector3d::Unit(axis);
      return ((*model)->displacement_m(p_m + step_m) - (*model)->displacement_m(p_m - step_m)) / (2.0 * size_m) +
             Eigen::Vector3d::Unit(axis);
    };
    constexpr double kStep_m = 1e-5;
    int compared = 0;
    for (const Eigen::Vector3d& p_m : randomPoints(100)) {
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d by_half = slope(p_m, axis, 0.5 * kStep_m);
        if ((slope(p_m, axis, kStep_m) - by_half).norm() > 5e-6) continue;
        ++compared;
        FT_VERIFY_MATCH(near(Eigen::Vector3d((*model)->jacobian(p_m).col(axis)), by_half, 1e-5));
      }
    }
    QVERIFY(compared > 290);
  }

  void refusesWhatCannotBeTrained() {
    std::vector<Eigen::Vector3d> places_m = shakenGrid({3, 3, 3}, 0.2, 0.02);
    const auto few = fitPosition("neural_network", fitDataOf(places_m, curved_m));
    QVERIFY(!few && few.error().code == ErrorCode::kTooFewNodes);
    FT_VERIFY_MATCH(holdsAll(few.error().message, {"83 weights", "at least 28 places, got 27"}));
    FT_VERIFY_OK(fitPosition("neural_network", fitDataOf(places_m, curved_m), {{"hidden", "7"}, {"starts", "1"}}));
    // Targets that are not finite leave no finite weights.
    TrainingSet broken = singlePair();
    broken.target[0].x() = HUGE_VAL;
    const auto diverged = trainByBackPropagation(FeedForwardNetwork(2, 2), broken, {}, {});
    QVERIFY(!diverged && diverged.error().code == ErrorCode::kDegenerate);
    FT_VERIFY_MATCH(holdsAll(diverged.error().message, {"diverged in epoch 1", "learning_rate"}));
    const auto failed = trainByLevenbergMarquardt(FeedForwardNetwork(2, 2), broken, {}, {});
    QVERIFY(!failed && failed.error().code == ErrorCode::kDegenerate);
    FT_VERIFY_MATCH(holdsAll(failed.error().message, {"failed from each of its 4 starts"}));
  }
};

FIELDTRUE_TEST(NeuralNetworkTest)
#include "neural_network_test.moc"
