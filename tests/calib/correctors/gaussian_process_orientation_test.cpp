#include <QTest>
#include <cmath>
#include <map>

#include "calib/core/statistics.h"
#include "calib/correctors/registry.h"
#include "tests/calib/correctors/cell_fixtures.h"
#include "tests/calib/correctors/coil_readings.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

/// What bends the field at a place turns every reading there alike, by up to two degrees.
Eigen::Quaterniond bendAt(const Eigen::Vector3d& p_m) {
  return rotationFromVector(0.03 * Eigen::Vector3d(std::sin(2.0 * p_m.y()), std::cos(3.0 * p_m.x()), p_m.z()));
}

Pose readAt(const Eigen::Vector3d& p_m, const Eigen::Quaterniond& q, const CoilStrain& strain) {
  Pose read = readBy(p_m, q, strain);
  read.orientation = bendAt(p_m) * read.orientation;
  return read;
}

/// 60 places in some orientations each, or each in one of its own; a bent field, coils, 0.05 degrees of noise.
FitData dataOf(int orientations, const CoilStrain& strain) {
  RandomGeometry random(11);
  std::vector<Eigen::Quaterniond> turns;
  for (int i = 0; i < std::max(1, orientations); ++i) turns.push_back(random.rotation());
  FitData data;
  int node = 0;
  for (const Eigen::Vector3d& at_m : shakenGrid({5, 4, 3}, 0.2, 0.03)) {
    const Eigen::Vector3d p_m = at_m + Eigen::Vector3d(0.5, 0.0, 0.0);
    for (const Eigen::Quaterniond& turn : turns) {
      const Eigen::Quaterniond q = orientations > 0 ? turn : random.rotation();
      const Pose read = readAt(p_m, q, strain);
      data.p_true_m.push_back(p_m);
      data.p_tracked_m.push_back(read.position_m);
      data.q_true.push_back(q);
      data.q_tracked.push_back(
          rotationFromVector(1e-3 * Eigen::Vector3d(random.normal(), random.normal(), random.normal())) *
          read.orientation);
      data.node.push_back(node);
    }
    ++node;
  }
  return data;
}

Result<std::unique_ptr<OrientationModel>> fittedTo(const FitData& data,
                                                   const std::map<std::string, std::string>& given = {}) {
  const OrientationMethod& method = *findOrientationMethod("gaussian_process").value();
  return method.fit(data, *resolveSettings(method.id, method.settings, given), {});
}

/// RMS angle [rad] left in orientations and at places that were not fitted.
double leftAt(const OrientationModel& model, const CoilStrain& strain, unsigned seed) {
  RandomGeometry random(seed);
  double squares = 0.0;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d p_m =
        Eigen::Vector3d(0.9, 0.3, 0.2) + 0.1 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    const Eigen::Quaterniond q = random.rotation();
    const Pose read = readAt(p_m, q, strain);
    squares += std::pow(angleBetween_rad(model.correct(read.position_m, read.orientation), q), 2) / 100.0;
  }
  return std::sqrt(squares);
}

}  // namespace

class GaussianProcessOrientationTest : public QObject {
  Q_OBJECT
 private slots:
  /// Coils that turn readings by 2 degrees and a field that bends them: what a process over positions leaves is most of
  /// it, what one with the coils leaves is little, in orientations that were never fitted.
  void coilsAreTakenOut_data() {
    QTest::addColumn<int>("orientations");
    QTest::newRow("three") << 3;
    QTest::newRow("six") << 6;
    QTest::newRow("each place at random") << 0;
  }
  void coilsAreTakenOut() {
    QFETCH(int, orientations);
    const FitData data = dataOf(orientations, kUnequalCoils);
    const auto model = fittedTo(data);
    FT_VERIFY_OK(model);
    QVERIFY((*model)->takesOrientation());
    const auto of_position = fittedTo(data, {{"inputs", "position"}});
    FT_VERIFY_OK(of_position);
    QVERIFY(!(*of_position)->takesOrientation());
    const double left_rad = leftAt(**model, kUnequalCoils, 5);
    const double left_by_position_rad = leftAt(**of_position, kUnequalCoils, 5);
    const std::string both = std::to_string(left_rad) + " and " + std::to_string(left_by_position_rad);
    QVERIFY2(left_rad < 0.004 && left_by_position_rad > 0.02, both.c_str());
  }

  /// Without coils position alone is enough, and the field is foretold to a fraction of the noise.
  void positionIsEnoughWithoutCoils() {
    for (const int orientations : {1, 3, 0}) {
      const auto model = fittedTo(dataOf(orientations, CoilStrain::Zero()));
      FT_VERIFY_OK(model);
      QVERIFY(!(*model)->takesOrientation());
      QVERIFY(leftAt(**model, CoilStrain::Zero(), 6) < 0.004);
    }
  }

  /// An error that the sensor carries with it is one rotation there, whatever way it points.
  void anErrorOfTheSensorIsOneRotation() {
    FitData data = dataOf(3, CoilStrain::Zero());
    const Eigen::Quaterniond off = rotationFromVector({0.2, -0.1, 0.3});
    for (std::size_t i = 0; i < data.size(); ++i) data.q_tracked[i] = data.q_true[i] * off;
    const auto model = fittedTo(data, {{"error_frame", "sensor"}});
    FT_VERIFY_OK(model);
    const Eigen::Quaterniond q = RandomGeometry(9).rotation();
    FT_VERIFY_MATCH(near((*model)->correct({0.8, 0.1, 0.2}, q * off), q, 1e-6));
  }

  void isReadBackToTheBit() {
    const auto model = fittedTo(dataOf(0, kUnequalCoils));
    FT_VERIFY_OK(model);
    const auto read =
        findOrientationMethod("gaussian_process").value()->load(nlohmann::json::parse((*model)->parameters().dump()));
    FT_VERIFY_OK(read);
    QVERIFY((*read)->parameters() == (*model)->parameters());
    const Eigen::Quaterniond q = RandomGeometry(3).rotation();
    QVERIFY((*read)->correct({0.7, 0.1, 0.1}, q).coeffs() == (*model)->correct({0.7, 0.1, 0.1}, q).coeffs());
  }
};

FIELDTRUE_TEST(GaussianProcessOrientationTest)
#include "gaussian_process_orientation_test.moc"
