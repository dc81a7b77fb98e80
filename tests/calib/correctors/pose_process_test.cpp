#include "calib/correctors/gaussian_process/pose_process.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <QTest>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "calib/correctors/gaussian_process/pose_covariance.h"
#include "calib/correctors/registry.h"
#include "tests/calib/correctors/cell_fixtures.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

/// The Gaussian process whose input is the whole pose.
using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

/// What a row's error is made of [m].
struct ErrorLaw {
  double of_position_m = 0.003;
  double of_turn_m = 0.0;  ///< Fixed in the sensor, so that it turns with it.
};

/// Places of a shaken grid, each in several orientations, with 0.1 mm of noise.
FitData turnedData(int orientations, const ErrorLaw& law, unsigned seed = 3) {
  RandomGeometry random(seed);
  std::vector<Eigen::Quaterniond> turns;
  for (int i = 0; i < orientations; ++i) turns.push_back(random.rotation());
  FitData data;
  int node = 0;
  for (const Eigen::Vector3d& p_m : shakenGrid({4, 4, 3}, 0.2, 0.03)) {
    for (const Eigen::Quaterniond& q : turns) {
      const Eigen::Vector3d of_position_m(std::sin(5.0 * p_m.x()), std::cos(4.0 * p_m.y()), std::sin(3.0 * p_m.z()));
      const Eigen::Vector3d in_sensor(1.0, 0.5 * std::sin(3.0 * p_m.x()), 0.0);
      data.p_tracked_m.push_back(p_m);
      data.p_true_m.push_back(p_m + law.of_position_m * of_position_m + law.of_turn_m * (q * in_sensor) +
                              1e-4 * Eigen::Vector3d(random.normal(), random.normal(), random.normal()));
      data.q_tracked.push_back(q);
      data.q_true.push_back(q);
      data.node.push_back(node);
    }
    ++node;
  }
  return data;
}

std::unique_ptr<PositionModel> fittedWith(const FitData& data, const std::string& inputs) {
  return testing::fitted("gaussian_process", data, {{"inputs", inputs}, {"sensor_coils", "none"}});
}

/// The process written out from its definition, with rotations as matrices: nothing of the code under test but the
/// parameters that it stores.
struct WrittenOut {
  Eigen::Vector3d length_m;
  Eigen::Matrix3d axes;
  double signal_m2, turn_m2, stretch, turn_length;
  std::vector<Eigen::Vector3d> p_m;
  std::vector<Eigen::Matrix3d> turn;
  Eigen::MatrixXd covariance;
  Eigen::MatrixXd trend;

  explicit WrittenOut(const nlohmann::json& pose) {
    const auto number = [&pose](const char* key) { return pose.at(key).get<double>(); };
    for (int axis = 0; axis < 3; ++axis) length_m[axis] = pose.at("length_m").at(static_cast<std::size_t>(axis));
    signal_m2 = std::pow(number("signal_sd_m"), 2);
    turn_m2 = std::pow(number("turn_sd_m"), 2);
    stretch = number("turn_stretch");
    turn_length = number("turn_length_rad");
    for (const auto& at : pose.at("positions_m")) p_m.emplace_back(at.at(0), at.at(1), at.at(2));
    for (const auto& q : pose.at("orientations_wxyz"))
      turn.push_back(Eigen::Quaterniond(q.at(0), q.at(1), q.at(2), q.at(3)).toRotationMatrix());
    const auto n = static_cast<Eigen::Index>(p_m.size());
    covariance.resize(n, n);
    trend.resize(n, 4);
    for (std::size_t i = 0; i < p_m.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      trend.row(row) << 1.0, p_m[i].transpose();
      for (std::size_t j = 0; j < p_m.size(); ++j) {
        double k = signalAndTurn_m2(p_m[i], turn[i], j);
        if (pose.at("place").at(i) == pose.at("place").at(j))
          k += number("placing_m2") + std::pow(number("nugget_sd_m"), 2);
        if (i == j)
          k += pose.at("noise_m2").at(i).get<double>() + std::pow(number("row_sd_m"), 2) +
               1e-10 * (signal_m2 + turn_m2 + number("placing_m2") + std::pow(number("nugget_sd_m"), 2));
        covariance(row, static_cast<Eigen::Index>(j)) = k;
      }
    }
  }

  double signalAndTurn_m2(const Eigen::Vector3d& at_m, const Eigen::Matrix3d& R, std::size_t j) const {
    const double r = (at_m - p_m[j]).cwiseQuotient(length_m).norm();
    const double chord = (R - turn[j]).norm() / std::sqrt(2.0);
    return signal_m2 * matern52(r) + turn_m2 * matern52(r / stretch) * matern52(chord / turn_length);
  }

  /// Universal kriging of rows with their places, from those kept; and its variance per output.
  struct Prediction {
    Eigen::RowVector3d displacement_m;
    double variance_m2;
  };
  Prediction at(const Pose& pose, const Eigen::MatrixXd& y, const std::vector<Eigen::Index>& kept) const {
    const auto n = static_cast<Eigen::Index>(kept.size());
    Eigen::MatrixXd K(n, n), H(n, 4), Y(n, 3);
    Eigen::VectorXd k(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Index row = kept[static_cast<std::size_t>(i)];
      H.row(i) = trend.row(row);
      Y.row(i) = y.row(row);
      k[i] = signalAndTurn_m2(pose.position_m, pose.orientation.toRotationMatrix(), static_cast<std::size_t>(row));
      for (Eigen::Index j = 0; j < n; ++j) K(i, j) = covariance(row, kept[static_cast<std::size_t>(j)]);
    }
    Eigen::RowVector4d h;
    h << 1.0, pose.position_m.transpose();
    const Eigen::FullPivLU<Eigen::MatrixXd> lu(K);
    const Eigen::MatrixXd of_trend = lu.solve(H);
    const Eigen::Matrix4d information = H.transpose() * of_trend;
    const Eigen::MatrixXd beta = information.fullPivLu().solve(of_trend.transpose() * Y);
    const Eigen::RowVector4d gap = h - k.transpose() * of_trend;
    return {h * beta + k.transpose() * lu.solve(Y - H * beta),
            signal_m2 + turn_m2 - k.dot(lu.solve(k)) + (gap * information.fullPivLu().solve(gap.transpose()))(0)};
  }
};

Eigen::MatrixXd displacementsOf(const FitData& data) {
  Eigen::MatrixXd y(static_cast<Eigen::Index>(data.size()), 3);
  for (std::size_t i = 0; i < data.size(); ++i)
    y.row(static_cast<Eigen::Index>(i)) = (data.p_true_m[i] - data.p_tracked_m[i]).transpose();
  return y;
}

std::vector<Eigen::Index> allRowsBut(std::size_t n, std::span<const std::size_t> out) {
  std::vector<Eigen::Index> kept;
  for (std::size_t row = 0; row < n; ++row)
    if (std::find(out.begin(), out.end(), row) == out.end()) kept.push_back(static_cast<Eigen::Index>(row));
  return kept;
}

PoseLikelihood someLikelihood(RadialKernel kernel) {
  FitData data = turnedData(3, {.of_turn_m = 0.002});
  PoseRows rows;
  rows.p_m = data.p_tracked_m;
  rows.q = data.q_tracked;
  for (const int node : data.node) rows.place.push_back(static_cast<std::size_t>(node));
  rows.noise_m2.assign(data.size(), 1e-8);
  rows.placing_m2 = 4e-8;
  return *PoseLikelihood::of(kernel, FieldFrame::around(data.p_tracked_m, 3, 0.4), rows, displacementsOf(data));
}

}  // namespace

class PoseProcessTest : public QObject {
  Q_OBJECT
 private slots:
  void theCovarianceIsPositiveDefiniteOnRotations() {
    RandomGeometry random(5);
    std::vector<Eigen::Quaterniond> q;
    for (int i = 0; i < 60; ++i) q.push_back(random.rotation());
    for (const double length_rad : {0.2, 1.0, 6.0}) {
      Eigen::MatrixXd correlation(60, 60);
      for (Eigen::Index i = 0; i < 60; ++i)
        correlation.col(i) = turnCorrelation(RadialKernel::kMatern52, length_rad, q[static_cast<std::size_t>(i)], q);
      QVERIFY(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(correlation).eigenvalues().minCoeff() > 0.0);
    }
  }

  void aQuaternionAndItsNegativeAreOneRotation() {
    const Eigen::Quaterniond q(0.5, 0.5, -0.5, 0.5);
    const std::vector<Eigen::Quaterniond> other = {q, Eigen::Quaterniond(-q.coeffs())};
    const Eigen::VectorXd correlation = turnCorrelation(RadialKernel::kMatern52, 1.0, q, other);
    FT_VERIFY_MATCH(near(correlation[0], 1.0, 1e-12));
    FT_VERIFY_MATCH(near(correlation[1], 1.0, 1e-12));
  }

  /// c = 2 sin(angle/2).
  void theChordOfATurn() {
    const Eigen::Quaterniond turned = rotationFromVector({0.0, 0.8, 0.0});
    const std::vector<Eigen::Quaterniond> other = {turned};
    const double expected = matern52(2.0 * std::sin(0.4) / 0.7);
    FT_VERIFY_MATCH(
        near(turnCorrelation(RadialKernel::kMatern52, 0.7, Eigen::Quaterniond::Identity(), other)[0], expected, 1e-12));
  }

  void theSlopeOfTheLikelihood_data() {
    QTest::addColumn<RadialKernel>("kernel");
    QTest::newRow("nu = 1.5") << RadialKernel::kMatern32;
    QTest::newRow("nu = 2.5") << RadialKernel::kMatern52;
  }
  void theSlopeOfTheLikelihood() {
    QFETCH(const RadialKernel, kernel);
    const PoseLikelihood likelihood = someLikelihood(kernel);
    const std::vector<double> at = {std::log(0.3),  std::log(0.4),  std::log(0.25),  std::log(0.003),
                                    std::log(2e-4), std::log(3e-4), std::log(0.002), 0.2,
                                    std::log(1.1)};
    std::vector<double> slope(at.size());
    QVERIFY(likelihood.evaluate(at, slope.data()).has_value());
    constexpr double kStep = 1e-5;
    for (std::size_t k = 0; k < at.size(); ++k) {
      std::vector<double> above = at, below = at;
      above[k] += kStep;
      below[k] -= kStep;
      const double expected =
          (*likelihood.evaluate(above, nullptr) - *likelihood.evaluate(below, nullptr)) / (2.0 * kStep);
      FT_VERIFY_MATCH(near(slope[k], expected, 1e-5 * (1.0 + std::abs(expected))));
    }
  }

  void predictsAsWrittenOut() {
    const FitData data = turnedData(3, {.of_turn_m = 0.002});
    const auto model = fittedWith(data, "pose");
    QVERIFY(model->takesOrientation());
    const WrittenOut written(model->parameters().at("pose"));
    RandomGeometry random(8);
    for (int i = 0; i < 5; ++i) {
      const Pose pose{Eigen::Vector3d(random.between(0, 0.5), random.between(0, 0.5), random.between(0, 0.4)),
                      random.rotation()};
      const auto expected = written.at(pose, displacementsOf(data), allRowsBut(data.size(), {}));
      FT_VERIFY_MATCH(near(model->displacementAt_m(pose), expected.displacement_m.transpose(), 1e-9));
      const double nugget_m = model->parameters().at("pose").at("nugget_sd_m");
      const double row_m = model->parameters().at("pose").at("row_sd_m");
      FT_VERIFY_MATCH(near(*model->uncertaintyAt_m(pose),
                           std::sqrt(3.0 * (expected.variance_m2 + nugget_m * nugget_m + row_m * row_m)), 1e-9));
    }
  }

  void withoutAPlaceAsWrittenOut() {
    FitData data = turnedData(3, {.of_turn_m = 0.002});
    data.jig_sd_m = 3e-4;
    const PositionMethod* method = *findPositionMethod("gaussian_process");
    const Settings settings =
        *resolveSettings(method->id, method->settings, {{"inputs", "pose"}, {"sensor_coils", "none"}});
    const auto all = method->fit(data, settings, {});
    const auto fits = method->hold_out(data, settings, {});
    FT_VERIFY_OK(fits);
    const WrittenOut written((*all)->parameters().at("pose"));
    for (const int place : {0, 21, 47}) {
      std::vector<std::size_t> out;
      for (std::size_t row = 0; row < data.size(); ++row)
        if (data.node[row] == place) out.push_back(row);
      const auto model = (*fits)->without(out, Pose{});
      FT_VERIFY_OK(model);
      for (const std::size_t row : out) {
        const Pose pose{data.p_tracked_m[row], data.q_tracked[row]};
        const auto expected = written.at(pose, displacementsOf(data), allRowsBut(data.size(), out));
        FT_VERIFY_MATCH(near((*model)->displacementAt_m(pose), expected.displacement_m.transpose(), 1e-9));
      }
    }
  }

  void withoutAnOrientationItIsTheMeanOverThoseFitted() {
    const FitData data = turnedData(3, {.of_turn_m = 0.002});
    const auto model = fittedWith(data, "auto");
    const Eigen::Vector3d p_m(0.25, 0.2, 0.3);
    Eigen::Vector3d mean_m = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < 3; ++i) mean_m += model->displacementAt_m({p_m, data.q_tracked[i]}) / 3.0;
    FT_VERIFY_MATCH(near(model->displacement_m(p_m), mean_m, 1e-12));
    constexpr double kStep_m = 1e-5;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step_m = kStep_m * Eigen::Vector3d::Unit(axis);
      const Eigen::Vector3d slope =
          Eigen::Vector3d::Unit(axis) +
          (model->displacement_m(p_m + step_m) - model->displacement_m(p_m - step_m)) / (2.0 * kStep_m);
      FT_VERIFY_MATCH(near(Eigen::Vector3d(model->jacobian(p_m).col(axis)), slope, 1e-7));
    }
  }

  void isMoreUncertainTheFartherItIsTurned() {
    const FitData two = turnedData(2, {.of_turn_m = 0.004});
    const auto model = fittedWith(two, "pose");
    const Eigen::Vector3d p_m = two.p_tracked_m[two.size() / 2];
    const Eigen::Quaterniond seen = two.q_tracked[0];
    double last_m = *model->uncertaintyAt_m({p_m, seen});
    for (const double angle_rad : {0.4, 0.8, 1.2}) {
      const Eigen::Vector3d away = rotationVector_rad(seen * two.q_tracked[1].conjugate()).normalized();
      const double now_m = *model->uncertaintyAt_m({p_m, rotationFromVector(angle_rad * away) * seen});
      QVERIFY2(now_m > last_m, qPrintable(QString("%1 after %2").arg(now_m).arg(last_m)));
      last_m = now_m;
    }
    const nlohmann::json pose = model->parameters().at("pose");
    const double prior_m2 =
        std::pow(pose.at("signal_sd_m").get<double>(), 2) + std::pow(pose.at("turn_sd_m").get<double>(), 2) +
        std::pow(pose.at("nugget_sd_m").get<double>(), 2) + std::pow(pose.at("row_sd_m").get<double>(), 2);
    QVERIFY(last_m < std::sqrt(3.0 * prior_m2) * 1.5);
  }

  void takesThePoseOnlyWhereItHelps_data() {
    QTest::addColumn<int>("orientations");
    QTest::addColumn<double>("of_turn_mm");
    QTest::addColumn<bool>("permuted");
    QTest::addColumn<bool>("takes");
    QTest::newRow("one orientation") << 1 << 2.0 << false << false;
    QTest::newRow("of position only, three") << 3 << 0.0 << false << false;
    QTest::newRow("of position only, six") << 6 << 0.0 << false << false;
    QTest::newRow("turns with the sensor, three") << 3 << 2.0 << false << true;
    QTest::newRow("turns with the sensor, six") << 6 << 2.0 << false << true;
    QTest::newRow("orientations permuted") << 6 << 2.0 << true << false;
  }
  void takesThePoseOnlyWhereItHelps() {
    QFETCH(const int, orientations);
    QFETCH(const double, of_turn_mm);
    QFETCH(const bool, permuted);
    QFETCH(const bool, takes);
    FitData data = turnedData(orientations, {.of_turn_m = 1e-3 * of_turn_mm});
    if (permuted) std::shuffle(data.q_tracked.begin(), data.q_tracked.end(), std::mt19937_64(4));
    const auto model = fittedWith(data, "auto");
    QCOMPARE(model->takesOrientation(), takes);
    // To the bit what it is when orientation was never asked about.
    const auto alone = fittedWith(data, "position");
    for (const Eigen::Vector3d& p_m : {data.p_tracked_m.front(), Eigen::Vector3d(0.2, 0.3, 0.1)})
      if (!takes) QVERIFY(model->displacement_m(p_m) == alone->displacement_m(p_m));
  }

  /// Metal turns the readings of a sensor that the rig never turned, by up to 25 degrees and smoothly with the place:
  /// the error of position follows them, and says nothing of what a turned sensor would read.
  void aSensorThatNeverTurnedTellsNothingOfTurns() {
    FitData data = turnedData(1, {});
    for (std::size_t row = 0; row < data.size(); ++row) {
      const Eigen::Vector3d& p_m = data.p_tracked_m[row];
      const Eigen::Vector3d turn = 0.4 * Eigen::Vector3d(std::sin(9.0 * p_m.x()), std::cos(7.0 * p_m.y()), 0.0);
      data.q_tracked[row] = rotationFromVector(turn);
      data.q_true[row] = Eigen::Quaterniond::Identity();
      data.p_true_m[row] = p_m + 0.02 * turn;
    }
    QVERIFY(!fittedWith(data, "auto")->takesOrientation());
    // The same readings of a sensor that was turned so are asked about.
    data.q_true = data.q_tracked;
    QVERIFY(hasSeveralOrientations(data));
  }

  void whatIsAskedForAndIsNotThereIsRefused() {
    const PositionMethod* method = *findPositionMethod("gaussian_process");
    const Settings settings =
        *resolveSettings(method->id, method->settings, {{"inputs", "pose"}, {"sensor_coils", "none"}});
    const auto refused = method->fit(turnedData(1, {}), settings, {});
    QVERIFY(!refused);
    FT_VERIFY_MATCH(
        holdsAll(refused.error().message, {"inputs=pose needs rows in several orientations", "these 48 rows"}));
  }

  void storesAndReadsTheSameBits() {
    const FitData data = turnedData(3, {.of_turn_m = 0.002});
    const auto model = fittedWith(data, "auto");
    const PositionMethod* method = *findPositionMethod("gaussian_process");
    const auto read = method->load(nlohmann::json::parse(model->parameters().dump()));
    FT_VERIFY_OK(read);
    const Pose pose{{0.21, 0.33, 0.12}, rotationFromVector({0.3, -0.2, 0.5})};
    QVERIFY((*read)->displacementAt_m(pose) == model->displacementAt_m(pose));
    QCOMPARE(*(*read)->uncertaintyAt_m(pose), *model->uncertaintyAt_m(pose));
    QVERIFY((*read)->parameters() == model->parameters());
  }
};

FIELDTRUE_TEST(PoseProcessTest)
#include "pose_process_test.moc"
