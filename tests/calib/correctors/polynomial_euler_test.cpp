#include <QTest>
#include <cmath>
#include <numbers>

#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

constexpr double kDeg = std::numbers::pi / 180.0;

/// Azimuth, elevation and roll of the error, polynomials of degree 2 of the position [rad].
Eigen::Vector3d angles_rad(const Eigen::Vector3d& p) {
  return {0.1 + 0.05 * p.x() * p.y(), -0.08 * p.z() + 0.02 * p.x() * p.x(), 0.04 * p.y() - 0.03};
}

Eigen::Matrix3d about(int axis, double angle_rad) {
  return Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::Unit(axis)).toRotationMatrix();
}

/// Rz(azimuth) Ry(elevation) Rx(roll), written out.
Eigen::Matrix3d matrixOf(const Eigen::Vector3d& euler_rad) {
  return about(2, euler_rad[0]) * about(1, euler_rad[1]) * about(0, euler_rad[2]);
}

std::vector<Eigen::Vector3d> usualPlaces() { return shakenGrid({5, 5, 4}, 0.2, 0.02); }

/// Data whose error rotation in a frame is a matrix function of position, at one true orientation.
FitData dataOf(const std::function<Eigen::Matrix3d(const Eigen::Vector3d&)>& error, const Eigen::Quaterniond& q_true,
               bool in_tracker) {
  FitData data = fitDataOf(
      usualPlaces(), nothing_m, [](const Eigen::Vector3d&) { return Eigen::Quaterniond(1, 0, 0, 0); }, q_true);
  for (std::size_t i = 0; i < data.size(); ++i) {
    const Eigen::Quaterniond q_error(error(data.p_tracked_m[i]));
    data.q_tracked[i] = in_tracker ? q_error * q_true : q_true * q_error;
  }
  return data;
}

}  // namespace

class PolynomialEulerTest : public QObject {
  Q_OBJECT
 private slots:
  /// One constant error of azimuth 10 and elevation 20 degrees, sensor turned by 40 and rolled by 30: composed by
  /// matrices.
  void composesByMatrices_data() {
    QTest::addColumn<QString>("frame");
    for (const char* frame : {"tracker", "sensor"}) QTest::newRow(frame) << frame;
  }
  void composesByMatrices() {
    QFETCH(QString, frame);
    const bool in_tracker = frame == "tracker";
    const Eigen::Matrix3d error = about(2, 10 * kDeg) * about(1, 20 * kDeg);
    const Eigen::Quaterniond q_zero = Eigen::Quaterniond::Identity();
    const FitData data = dataOf([&](const Eigen::Vector3d&) { return error; }, q_zero, in_tracker);
    const auto model =
        fitOrientation("polynomial_euler", data, {{"degree", "1"}, {"error_frame", frame.toStdString()}});
    FT_VERIFY_OK(model);
    const Eigen::Matrix3d truth = about(2, 40 * kDeg) * about(0, 30 * kDeg);
    const Eigen::Matrix3d tracked = in_tracker ? Eigen::Matrix3d(error * truth) : Eigen::Matrix3d(truth * error);
    const Eigen::Quaterniond corrected = (*model)->correct({0.7, 0.0, 0.1}, Eigen::Quaterniond(tracked));
    FT_VERIFY_MATCH(near(corrected.toRotationMatrix(), truth, 1e-12));
    // Angles subtracted one by one would be wrong: azimuth, elevation and roll of the tracked matrix less 10, 20, 0.
    const Eigen::Vector3d subtracted =
        eulerFromRotation_rad(Eigen::Quaterniond(tracked)) - Eigen::Vector3d(10, 20, 0) * kDeg;
    QVERIFY((matrixOf(subtracted) - truth).norm() > 0.05);
  }

  /// The sensor itself may point anywhere, straight up and down included.
  void polesOfTheSensorsOwnOrientationDoNoHarm_data() {
    QTest::addColumn<double>("elevation_deg");
    QTest::addColumn<QString>("frame");
    for (const double elevation_deg : {-90.0, -89.999, 0.0, 89.99, 90.0})
      for (const char* frame : {"tracker", "sensor"})
        QTest::addRow("%g, %s", elevation_deg, frame) << elevation_deg << frame;
  }
  void polesOfTheSensorsOwnOrientationDoNoHarm() {
    QFETCH(double, elevation_deg);
    QFETCH(QString, frame);
    const bool in_tracker = frame == "tracker";
    const Eigen::Quaterniond q_pole(matrixOf({0.4, elevation_deg * kDeg, -1.2}));
    const auto error = [](const Eigen::Vector3d& p) { return matrixOf(angles_rad(p)); };
    const auto model = fitOrientation("polynomial_euler", dataOf(error, q_pole, in_tracker),
                                      {{"degree", "2"}, {"error_frame", frame.toStdString()}});
    FT_VERIFY_OK(model);
    for (const Eigen::Quaterniond& q_true : {q_pole, Eigen::Quaterniond(matrixOf({-2.0, 0.3, 3.0}))})
      for (const Eigen::Vector3d& p_m : randomPoints(50)) {
        const Eigen::Quaterniond q_error(error(p_m));
        const Eigen::Quaterniond q_tracked = in_tracker ? q_error * q_true : q_true * q_error;
        FT_VERIFY_MATCH(near((*model)->correct(p_m, q_tracked), q_true, 1e-9));
      }
  }

  /// Large mean errors, around the jump of azimuth at 180 degrees and the pole of elevation at 90.
  void largeMeanErrorsAreTakenOutFirst_data() {
    QTest::addColumn<double>("azimuth_deg");
    QTest::addColumn<double>("elevation_deg");
    QTest::newRow("azimuth about 180") << 180.0 << 0.0;
    QTest::newRow("elevation 90") << 0.0 << 90.0;
    QTest::newRow("both") << -179.0 << 88.0;
  }
  void largeMeanErrorsAreTakenOutFirst() {
    QFETCH(double, azimuth_deg);
    QFETCH(double, elevation_deg);
    const Eigen::Matrix3d mean = matrixOf({azimuth_deg * kDeg, elevation_deg * kDeg, 0.0});
    const auto error = [&](const Eigen::Vector3d& p) -> Eigen::Matrix3d { return mean * matrixOf(angles_rad(p)); };
    const Eigen::Quaterniond q_true(matrixOf({0.3, 0.2, 0.1}));
    const auto model = fitOrientation("polynomial_euler", dataOf(error, q_true, true), {{"degree", "3"}});
    FT_VERIFY_OK(model);
    // Small angles about another mean are no polynomial of degree 2 any more; what is left is of higher order.
    for (const Eigen::Vector3d& p_m : usualPlaces())
      FT_VERIFY_MATCH(near((*model)->correct(p_m, Eigen::Quaterniond(error(p_m)) * q_true), q_true, 2e-5));
  }

  void errorsThatSpreadOverThePoleAreRefused() {
    // Elevation errors from -100 to 100 degrees along x: no frame keeps them from the poles.
    const auto error = [](const Eigen::Vector3d& p) { return matrixOf({0.0, (p.x() - 0.8) * 250 * kDeg, 0.0}); };
    const auto model = fitOrientation("polynomial_euler", dataOf(error, Eigen::Quaterniond::Identity(), true));
    QVERIFY(!model);
    QCOMPARE(model.error().code, ErrorCode::kDegenerate);
    FT_VERIFY_MATCH(
        holdsAll(model.error().message, {"Euler polynomial", ", pipe ", "degrees in elevation", "quaternions"}));
  }
};

FIELDTRUE_TEST(PolynomialEulerTest)
#include "polynomial_euler_test.moc"
