#include "calib/correctors/base/sensor_coils.h"

#include <QTest>
#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/correctors/registry.h"
#include "tests/calib/correctors/cell_fixtures.h"
#include "tests/calib/correctors/coil_readings.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

/// What unequal coils of a sensor do, and the Gaussian process that takes it out.
using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

/// Places of a shaken grid in front of the transmitter, turned one after the other through some orientations, or each
/// at random; a smooth field, coils, and 0.1 mm of noise.
FitData turnedData(int orientations, double field_m, const CoilStrain& strain) {
  RandomGeometry random(7);
  std::vector<Eigen::Quaterniond> turns;
  for (int i = 0; i < std::max(orientations, 1); ++i) turns.push_back(random.rotation());
  FitData data;
  int node = 0;
  for (const Eigen::Vector3d& at_m : shakenGrid({5, 4, 3}, 0.2, 0.03)) {
    const Eigen::Vector3d p_m = at_m + Eigen::Vector3d(0.5, 0.0, 0.0);
    for (const Eigen::Quaterniond& turn : turns) {
      const Eigen::Quaterniond q = orientations > 0 ? turn : random.rotation();
      const Eigen::Vector3d field(std::sin(5.0 * p_m.x()), std::cos(4.0 * p_m.y()), std::sin(3.0 * p_m.z()));
      data.p_true_m.push_back(p_m);
      data.p_tracked_m.push_back(readBy(p_m, q, strain).position_m + field_m * field +
                                 1e-4 * Eigen::Vector3d(random.normal(), random.normal(), random.normal()));
      data.q_tracked.push_back(q);
      data.q_true.push_back(q);
      data.node.push_back(node);
    }
    ++node;
  }
  return data;
}

}  // namespace

class SensorCoilsTest : public QObject {
  Q_OBJECT
 private slots:
  void allCoilsAlikeChangeTheRange() {
    // The signal falls with the cube of the range: 3 % more of it is 1 % nearer.
    SensorCoils coils;
    coils.strain << 0.03, 0.03, 0.03, 0.0, 0.0, 0.0;
    const Pose tracked{{0.6, -0.2, 0.3}, Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5)};
    FT_VERIFY_MATCH(near((coils.at(tracked) - 0.01 * tracked.position_m).norm(), 0.0, 1e-12));
  }

  void isTheFirstOrderOfWhatATrackerReads() {
    RandomGeometry random(3);
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector3d p_m = 0.3 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
      const Eigen::Quaterniond q = random.rotation();
      SensorCoils coils;
      coils.strain = 1e-4 * kUnequalCoils / 0.012;
      const Eigen::Vector3d true_less_tracked_m = p_m - readBy(p_m, q, coils.strain).position_m;
      FT_VERIFY_MATCH(near((coils.at({p_m, q}) - true_less_tracked_m).norm(), 0.0, 1e-6 * p_m.norm()));
    }
  }

  void isTheFirstOrderOfHowATrackerReadsATurn() {
    RandomGeometry random(4);
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector3d p_m = 0.3 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
      const Eigen::Quaterniond q = random.rotation();
      SensorCoils coils{CoilEffect::kTurn};
      coils.strain = 1e-4 * kUnequalCoils / 0.012;
      const Eigen::Vector3d turn_rad = rotationVector_rad(readBy(p_m, q, coils.strain).orientation * q.conjugate());
      FT_VERIFY_MATCH(near((-3.0 * coils.at({p_m, q}) - turn_rad).norm(), 0.0, 2e-7));
      QVERIFY(turn_rad.norm() > 1e-6);
    }
  }

  void areFoundWithTheField_data() {
    QTest::addColumn<int>("orientations");
    QTest::newRow("three") << 3;
    QTest::newRow("six") << 6;
    QTest::newRow("each place at random") << 0;
  }
  void areFoundWithTheField() {
    QFETCH(int, orientations);
    const FitData data = turnedData(orientations, 0.004, kUnequalCoils);
    const auto model = testing::fitted("gaussian_process", data, {});
    const nlohmann::json stored = model->parameters();
    QVERIFY2(stored.contains("coils"), model->note().c_str());
    QVERIFY(model->takesOrientation());
    // All gains alike are a scale, which the field's trend holds: what differs is what is found.
    const auto strain = stored.at("coils").at("strain").get<std::vector<double>>();
    const double mean = (strain[0] + strain[1] + strain[2]) / 3.0, true_mean = kUnequalCoils.head<3>().mean();
    const auto covariance = stored.at("coils").at("covariance").get<std::vector<std::vector<double>>>();
    for (int k = 0; k < 6; ++k) {
      const bool is_gain = k < 3;
      Eigen::Matrix<double, 6, 1> of_this = Eigen::Matrix<double, 6, 1>::Unit(k);
      if (is_gain) of_this.head<3>().array() -= 1.0 / 3.0;
      double variance = 0.0;
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j)
          variance += of_this[i] * of_this[j] * covariance[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
      const double sd = std::sqrt(variance);
      QVERIFY2(sd < 6e-4, std::to_string(sd).c_str());
      // The form is of first order: of 1.2 % up to 7 % are of second and of the field.
      FT_VERIFY_MATCH(near(strain[static_cast<std::size_t>(k)] - (is_gain ? mean : 0.0),
                           kUnequalCoils[k] - (is_gain ? true_mean : 0.0), 3.0 * sd + 8e-4));
    }
    // In an orientation that was never fitted.
    const Eigen::Quaterniond q = RandomGeometry(99).rotation();
    double squares_m2 = 0.0;
    for (const Eigen::Vector3d& at_m : shakenGrid({4, 3, 2}, 0.2, 0.0)) {
      const Eigen::Vector3d p_m = at_m + Eigen::Vector3d(0.6, 0.1, 0.1);
      const Eigen::Vector3d field(std::sin(5.0 * p_m.x()), std::cos(4.0 * p_m.y()), std::sin(3.0 * p_m.z()));
      const Pose tracked{readBy(p_m, q, kUnequalCoils).position_m + 0.004 * field, q};
      squares_m2 += (tracked.position_m + model->displacementAt_m(tracked) - p_m).squaredNorm() / 24.0;
      QVERIFY(model->uncertaintyAt_m(tracked).value_or(0.0) > 0.0);
    }
    // Of about 10 mm that these coils make.
    QVERIFY2(std::sqrt(squares_m2) < 0.002, std::to_string(1000.0 * std::sqrt(squares_m2)).c_str());
  }

  /// In 200 poses that were never fitted: what is uncertain of the coils is not what the field takes for its own.
  void errorsAreAsLargeAsStated_data() { areFoundWithTheField_data(); }
  void errorsAreAsLargeAsStated() {
    QFETCH(int, orientations);
    const auto model = testing::fitted("gaussian_process", turnedData(orientations, 0.004, kUnequalCoils), {});
    RandomGeometry random(8);
    double ratio = 0.0;
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector3d p_m =
          Eigen::Vector3d(0.6, 0.1, 0.1) + 0.1 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
      const Eigen::Quaterniond q = random.rotation();
      const Eigen::Vector3d field(std::sin(5.0 * p_m.x()), std::cos(4.0 * p_m.y()), std::sin(3.0 * p_m.z()));
      const Pose tracked{readBy(p_m, q, kUnequalCoils).position_m + 0.004 * field, q};
      const double error_m = (tracked.position_m + model->displacementAt_m(tracked) - p_m).norm();
      ratio += std::pow(error_m / model->uncertaintyAt_m(tracked).value(), 2) / 200.0;
    }
    QVERIFY2(ratio > 0.15 && ratio < 2.0, std::to_string(ratio).c_str());
  }

  /// What the process corrects is its weights times what was read; a linear field is foretold as it is.
  void weightsMakeTheCorrection() {
    const FitData data = turnedData(3, 0.004, CoilStrain::Zero());
    for (const std::string inputs : {"position", "pose"}) {
      const auto model = testing::fitted("gaussian_process", data, {{"inputs", inputs}, {"sensor_coils", "none"}});
      const bool by_row = inputs == "pose";
      const std::size_t each = by_row ? 1 : 3;
      const Pose tracked{{0.7, 0.15, 0.1}, RandomGeometry(5).rotation()};
      const auto weights = model->weightsAt(tracked);
      QVERIFY(weights.has_value());
      QCOMPARE(static_cast<std::size_t>(weights->size()), data.size() / each);
      Eigen::Vector3d made_m = Eigen::Vector3d::Zero();
      Eigen::Vector3d place_m = Eigen::Vector3d::Zero();
      for (std::size_t row = 0; row < data.size(); ++row) {
        const double weight = (*weights)[static_cast<Eigen::Index>(row / each)] / static_cast<double>(each);
        made_m += weight * (data.p_true_m[row] - data.p_tracked_m[row]);
        place_m += weight * data.p_tracked_m[row];
      }
      FT_VERIFY_MATCH(near((made_m - model->displacementAt_m(tracked)).norm(), 0.0, 1e-9));
      FT_VERIFY_MATCH(near((place_m - tracked.position_m).norm(), 0.0, 1e-9));
    }
  }

  void areNotFoundWhereTheyAreNot_data() { areFoundWithTheField_data(); }
  void areNotFoundWhereTheyAreNot() {
    QFETCH(int, orientations);
    const auto model = testing::fitted("gaussian_process", turnedData(orientations, 0.004, CoilStrain::Zero()), {});
    QVERIFY2(!model->parameters().contains("coils"), model->note().c_str());
    QVERIFY(!model->takesOrientation());
  }

  void mayBeLeftOut() {
    const auto model =
        testing::fitted("gaussian_process", turnedData(3, 0.004, kUnequalCoils), {{"sensor_coils", "none"}});
    QVERIFY(!model->parameters().contains("coils"));
  }

  void areReadBackToTheBit() {
    const FitData data = turnedData(0, 0.004, kUnequalCoils);
    const auto model = testing::fitted("gaussian_process", data, {});
    const auto* method = findPositionMethod("gaussian_process").value();
    const auto read = method->load(nlohmann::json::parse(model->parameters().dump()));
    FT_VERIFY_OK(read);
    QVERIFY((*read)->parameters() == model->parameters());
    for (std::size_t i = 0; i < data.size(); ++i) {
      const Pose tracked{data.p_tracked_m[i], data.q_tracked[i]};
      QVERIFY((*read)->displacementAt_m(tracked) == model->displacementAt_m(tracked));
      QVERIFY((*read)->displacement_m(tracked.position_m) == model->displacement_m(tracked.position_m));
    }
    nlohmann::json broken = model->parameters();
    broken["coils"]["strain"] = {0.1, 0.2};
    QVERIFY(!method->load(broken));
    // A design of other readings than the model's tells nothing, and is not read beyond its end.
    nlohmann::json shorter = model->parameters();
    shorter["coils"]["design"].erase(0);
    const auto without = method->load(shorter);
    FT_VERIFY_OK(without);
    const Pose tracked{data.p_tracked_m[3], data.q_tracked[3]};
    QVERIFY((*without)->uncertaintyAt_m(tracked).value() < model->uncertaintyAt_m(tracked).value());
  }

  void holdOutIsNearToAFitWithoutThePlace() {
    const FitData data = turnedData(0, 0.004, kUnequalCoils);
    const auto* method = findPositionMethod("gaussian_process").value();
    const Settings settings = *resolveSettings(method->id, method->settings, {});
    const auto fits = method->hold_out(data, settings, {});
    FT_VERIFY_OK(fits);
    const std::vector<std::size_t> out{17};
    const auto model = (*fits)->without(out, Pose());
    FT_VERIFY_OK(model);
    const Pose tracked{data.p_tracked_m[17], data.q_tracked[17]};
    const Eigen::Vector3d off_m = tracked.position_m + (*model)->displacementAt_m(tracked) - data.p_true_m[17];
    QVERIFY2(off_m.norm() < 0.002, std::to_string(off_m.norm()).c_str());
  }
};

FIELDTRUE_TEST(SensorCoilsTest)
#include "sensor_coils_test.moc"
