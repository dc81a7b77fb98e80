#include "calib/field/tracker_model.h"

#include <Eigen/QR>
#include <QTest>

#include "calib/field/dipole_field.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

/// The derivatives are held to differences of what they are derivatives of.
using namespace fieldtrue;
using namespace fieldtrue::field;
using namespace fieldtrue::testing;

namespace {

const std::vector<Eigen::Vector3d> kPlaces_m = {{0.3, -0.2, 0.6}, {-1.1, 0.4, 0.2}, {0.05, 0.9, -0.7}};
const Eigen::Quaterniond kTurned = rotationFromVector({0.4, -0.7, 1.1});

/// A change of the field that is no symmetry of it [1/m^3].
Eigen::Matrix3d someChange(double size) {
  return size * (Eigen::Matrix3d() << 0.3, -1.0, 0.2, 0.7, 0.1, -0.4, 0.9, 0.5, -0.6).finished();
}

}  // namespace

class TrackerModelTest : public QObject {
  Q_OBJECT

 private slots:
  /// On the x axis G = C/x^3 diag(2, -1, -1), so dG/dx = -3 C/x^4 diag(2, -1, -1).
  void theSlopeOnAnAxisIsKnown() {
    const Eigen::Matrix3d slope = dipoleFieldSlope({2.0, 0.0, 0.0}, 5.0, 0);
    QVERIFY(slope.isApprox(-3.0 * 5.0 / 16.0 * Eigen::Vector3d(2.0, -1.0, -1.0).asDiagonal().toDenseMatrix(), 1e-14));
  }

  void theSlopeIsThatOfTheField() {
    constexpr double kStep_m = 1e-5;
    for (const Eigen::Vector3d& p_m : kPlaces_m)
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d step_m = kStep_m * Eigen::Vector3d::Unit(axis);
        const Eigen::Matrix3d difference =
            (dipoleField(p_m + step_m, 2.0) - dipoleField(p_m - step_m, 2.0)) / (2.0 * kStep_m);
        QVERIFY(dipoleFieldSlope(p_m, 2.0, axis).isApprox(difference, 1e-7));
      }
  }

  void withoutEffectsTheTruePoseIsReported() {
    for (const Eigen::Vector3d& p_m : kPlaces_m) {
      SensorSetting setting;
      setting.tracker_from_sensor = {p_m, kTurned};
      const auto pose = reportedPose(setting, {}, p_m);
      QVERIFY(pose.has_value());
      FT_VERIFY_MATCH(near(pose->position_m, p_m, 1e-12));
      QVERIFY(pose->orientation.angularDistance(kTurned) < 1e-7);
      // The other hemisphere gives the same couplings.
      FT_VERIFY_MATCH(near(reportedPose(setting, {}, -p_m)->position_m, Eigen::Vector3d(-p_m), 1e-12));
    }
  }

  /// What shifts and turns the sensor is reported as it is.
  void aDisplacedSensorIsReportedWhereItIs() {
    SensorSetting setting;
    setting.tracker_from_sensor = {kPlaces_m[0], kTurned};
    EffectResponse response;
    response.shift_m = {0.01, -0.02, 0.03};
    response.turn_rad = {0.0, 0.1, 0.0};
    const auto pose = reportedPose(setting, response, kPlaces_m[0]);
    FT_VERIFY_MATCH(near(pose->position_m, Eigen::Vector3d(kPlaces_m[0] + response.shift_m), 1e-12));
    QVERIFY(pose->orientation.angularDistance(rotationFromVector({0.0, 0.1, 0.0}) * kTurned) < 1e-7);
  }

  void aFieldThatIsNoNumberIsNotSolved() {
    SensorSetting setting;
    setting.tracker_from_sensor.position_m = kPlaces_m[0];
    EffectResponse response;
    response.field_per_m3(0, 0) = std::nan("");
    QVERIFY(!reportedPose(setting, response, kPlaces_m[0]));
  }

  void poseByFieldIsTheReportsDerivative() {
    constexpr double kSize = 1e-5;
    for (const Eigen::Vector3d& p_m : kPlaces_m) {
      SensorSetting setting;
      setting.tracker_from_sensor = {p_m, kTurned};
      EffectResponse plus, minus;
      plus.field_per_m3 = someChange(kSize);
      minus.field_per_m3 = someChange(-kSize);
      const Pose high = *reportedPose(setting, plus, p_m), low = *reportedPose(setting, minus, p_m);
      const Eigen::Matrix3d change = someChange(kSize);
      const Eigen::Matrix<double, 6, 1> told =
          poseByField(p_m) * Eigen::Map<const Eigen::Matrix<double, 9, 1>>(change.data());
      FT_VERIFY_MATCH(near(Eigen::Vector3d(0.5 * (high.position_m - low.position_m)), Eigen::Vector3d(told.head<3>()),
                           1e-6 * told.head<3>().norm()));
      const Eigen::Vector3d turn_rad = 0.5 * rotationVector_rad(high.orientation * low.orientation.conjugate());
      FT_VERIFY_MATCH(near(turn_rad, Eigen::Vector3d(told.tail<3>()), 1e-4 * told.tail<3>().norm()));
    }
  }

  void poseByFieldIsTheLeastSquares() {
    for (const Eigen::Vector3d& p_m : kPlaces_m) {
      const Eigen::Matrix3d G = dipoleField(p_m, 1.0);
      Eigen::Matrix<double, 9, 6> B;
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Matrix3d moved = dipoleFieldSlope(p_m, 1.0, axis);
        Eigen::Matrix3d turned;
        for (int c = 0; c < 3; ++c) turned.col(c) = G.col(c).cross(Eigen::Vector3d::Unit(axis));
        B.col(axis) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(moved.data());
        B.col(3 + axis) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(turned.data());
      }
      QVERIFY(poseByField(p_m).isApprox(Eigen::MatrixXd(B).completeOrthogonalDecomposition().pseudoInverse(), 1e-12));
    }
  }

  void bothWaysToThePositionAgree() {
    for (const Eigen::Vector3d& p_m : kPlaces_m) {
      SensorSetting setting;
      setting.tracker_from_sensor = {p_m, kTurned};
      EffectResponse response;
      response.field_per_m3 = someChange(0.05 / std::pow(p_m.norm(), 3));
      const Eigen::Matrix3d field = dipoleField(p_m, 1.0) + response.field_per_m3;
      FT_VERIFY_MATCH(
          near(solvedPosition_m(field, p_m), reportedPose(setting, response, p_m)->position_m, 1e-9 * p_m.norm()));
      const Eigen::Matrix<double, 3, 9> by_field = solvedPositionDerivative(dipoleField(p_m, 1.0), p_m);
      QVERIFY(by_field.isApprox(poseByField(p_m).topRows<3>(), 1e-9));
    }
  }
};

FIELDTRUE_TEST(TrackerModelTest)
#include "tracker_model_test.moc"
