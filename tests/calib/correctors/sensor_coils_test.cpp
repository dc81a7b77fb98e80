#include "calib/correctors/base/sensor_coils.h"

#include <Eigen/Eigenvalues>
#include <QTest>
#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/correctors/registry.h"
#include "tests/calib/correctors/cell_fixtures.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

/// What unequal coils of a sensor do, and the Gaussian process that takes it out.
using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

Eigen::Matrix3d matrixOf(const CoilStrain& e) {
  Eigen::Matrix3d strain;
  strain << e[0], e[3], e[4], e[3], e[1], e[5], e[4], e[5], e[2];
  return strain;
}

/// What a tracker reports of a sensor with such coils, written out: the nine signals (1 + E) R^T K, K the dipole's
/// matrix (3 n n^T - 1) / r^3; of M^T M the trace tells the range, and the axis of the largest eigenvalue the
/// direction.
Eigen::Vector3d read_m(const Eigen::Vector3d& p_m, const Eigen::Quaterniond& q, const CoilStrain& strain) {
  const double r = p_m.norm();
  const Eigen::Vector3d n = p_m / r;
  const Eigen::Matrix3d dipole = (3.0 * n * n.transpose() - Eigen::Matrix3d::Identity()) / (r * r * r);
  const Eigen::Matrix3d measured =
      (Eigen::Matrix3d::Identity() + matrixOf(strain)) * q.toRotationMatrix().transpose() * dipole;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> power(measured.transpose() * measured);
  const Eigen::Vector3d axis = power.eigenvectors().col(2);
  return std::pow(6.0 / power.eigenvalues().sum(), 1.0 / 6.0) * (axis.dot(n) < 0.0 ? -1.0 : 1.0) * axis;
}

const CoilStrain kCoils = (CoilStrain() << 0.012, -0.008, 0.004, 0.003, -0.006, 0.005).finished();

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
      data.p_tracked_m.push_back(read_m(p_m, q, strain) + field_m * field +
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
    FT_VERIFY_MATCH(near((coils.shift_m(tracked) - 0.01 * tracked.position_m).norm(), 0.0, 1e-12));
  }

  void isTheFirstOrderOfWhatATrackerReads() {
    RandomGeometry random(3);
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector3d p_m = 0.3 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
      const Eigen::Quaterniond q = random.rotation();
      SensorCoils coils;
      coils.strain = 1e-4 * kCoils / 0.012;
      const Eigen::Vector3d true_less_tracked_m = p_m - read_m(p_m, q, coils.strain);
      FT_VERIFY_MATCH(near((coils.shift_m({p_m, q}) - true_less_tracked_m).norm(), 0.0, 1e-6 * p_m.norm()));
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
    const FitData data = turnedData(orientations, 0.004, kCoils);
    const auto model = testing::fitted("gaussian_process", data, {});
    const nlohmann::json stored = model->parameters();
    QVERIFY2(stored.contains("coils"), model->note().c_str());
    QVERIFY(model->takesOrientation());
    // All gains alike are a scale, which the field's trend holds: what differs is what is found.
    const auto strain = stored.at("coils").at("strain").get<std::vector<double>>();
    const double mean = (strain[0] + strain[1] + strain[2]) / 3.0, true_mean = kCoils.head<3>().mean();
    for (int k = 0; k < 6; ++k) {
      const bool is_gain = k < 3;
      FT_VERIFY_MATCH(near(strain[static_cast<std::size_t>(k)] - (is_gain ? mean : 0.0),
                           kCoils[k] - (is_gain ? true_mean : 0.0), 6e-4));
    }
    // In an orientation that was never fitted.
    const Eigen::Quaterniond q = RandomGeometry(99).rotation();
    double squares_m2 = 0.0;
    for (const Eigen::Vector3d& at_m : shakenGrid({4, 3, 2}, 0.2, 0.0)) {
      const Eigen::Vector3d p_m = at_m + Eigen::Vector3d(0.6, 0.1, 0.1);
      const Eigen::Vector3d field(std::sin(5.0 * p_m.x()), std::cos(4.0 * p_m.y()), std::sin(3.0 * p_m.z()));
      const Pose tracked{read_m(p_m, q, kCoils) + 0.004 * field, q};
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
    const auto model = testing::fitted("gaussian_process", turnedData(orientations, 0.004, kCoils), {});
    RandomGeometry random(8);
    double ratio = 0.0;
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector3d p_m =
          Eigen::Vector3d(0.6, 0.1, 0.1) + 0.1 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
      const Eigen::Quaterniond q = random.rotation();
      const Eigen::Vector3d field(std::sin(5.0 * p_m.x()), std::cos(4.0 * p_m.y()), std::sin(3.0 * p_m.z()));
      const Pose tracked{read_m(p_m, q, kCoils) + 0.004 * field, q};
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
    const auto model = testing::fitted("gaussian_process", turnedData(3, 0.004, kCoils), {{"sensor_coils", "none"}});
    QVERIFY(!model->parameters().contains("coils"));
  }

  void areReadBackToTheBit() {
    const FitData data = turnedData(0, 0.004, kCoils);
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
  }

  void holdOutIsNearToAFitWithoutThePlace() {
    const FitData data = turnedData(0, 0.004, kCoils);
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
