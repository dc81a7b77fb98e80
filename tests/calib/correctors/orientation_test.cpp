#include <QTest>
#include <cmath>

#include "calib/correctors/base/method.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

const std::vector<Eigen::Quaterniond> kTrueOrientations = {
    Eigen::Quaterniond::Identity(), rotationFromVector({1.0, 0.5, -2.0}), rotationFromVector({0.0, 3.1, 0.2}),
    rotationFromVector({-0.7, -0.7, 0.1})};

}  // namespace

class OrientationTest : public QObject {
  Q_OBJECT
 private slots:
  /// Fitted while the sensor pointed one way, tried with it pointing others; what each method may leave [rad].
  void correctsOtherOrientations_data() {
    QTest::addColumn<QString>("id");
    QTest::addColumn<QString>("frame");
    QTest::addColumn<double>("left_rad");
    for (const char* frame : {"tracker", "sensor"}) {
      QTest::addRow("polynomial, %s", frame) << "polynomial_quaternion" << frame << 2e-3;
      QTest::addRow("multiquadric, %s", frame) << "hmq_matrix" << frame << 2e-3;
    }
  }
  void correctsOtherOrientations() {
    QFETCH(QString, id);
    QFETCH(QString, frame);
    QFETCH(double, left_rad);
    const bool in_tracker = frame == "tracker";
    const auto track = [in_tracker](const Eigen::Vector3d& p_m, const Eigen::Quaterniond& q_true) {
      return in_tracker ? smoothError(p_m) * q_true : q_true * smoothError(p_m);
    };
    const Eigen::Quaterniond q_fitted = rotationFromVector({0.3, -1.4, 0.8});
    FitData data = fitDataOf(shakenGrid({6, 6, 6}, 0.2, 0.01), nothing_m, smoothError, q_fitted);
    for (std::size_t i = 0; i < data.size(); ++i) data.q_tracked[i] = track(data.p_tracked_m[i], q_fitted);
    const auto model = fitOrientation(id.toStdString(), data, {{"error_frame", frame.toStdString()}});
    FT_VERIFY_OK(model);
    for (const Eigen::Vector3d& p_m :
         {Eigen::Vector3d(0.9, 0.2, 0.3), Eigen::Vector3d(0.71, 0.43, 0.12), Eigen::Vector3d(1.2, -0.1, 0.6)})
      for (const Eigen::Quaterniond& q_true : kTrueOrientations)
        FT_VERIFY_MATCH(near((*model)->correct(p_m, track(p_m, q_true)), q_true, left_rad));
  }

  void theWrongFrameDoesNot() {
    // The setting matters: an error that lives in the sensor is not undone for other orientations in the tracker frame.
    FitData data = fitDataOf(shakenGrid({5, 5, 5}, 0.2, 0.01), nothing_m, smoothError);
    const auto model = fitOrientation("rigid", data, {{"error_frame", "tracker"}});
    FT_VERIFY_OK(model);
    const Eigen::Quaterniond q_true = rotationFromVector({0.0, 0.0, 3.0});
    const Eigen::Vector3d p_m(0.9, 0.2, 0.3);
    QVERIFY(angleBetween_rad((*model)->correct(p_m, q_true * smoothError(p_m)), q_true) > 0.05);
  }

  void signsOfQuaternionsDoNotMatter_data() {
    QTest::addColumn<QString>("id");
    for (const OrientationMethod& method : orientationMethods())
      QTest::newRow(method.id.c_str()) << QString::fromStdString(method.id);
  }
  void signsOfQuaternionsDoNotMatter() {
    QFETCH(QString, id);
    const FitData data = fitDataOf(shakenGrid({5, 5, 4}, 0.2, 0.01), nothing_m, smoothError);
    FitData flipped = data;
    for (std::size_t i = 0; i < data.size(); i += 3) flipped.q_tracked[i].coeffs() *= -1.0;
    for (std::size_t i = 0; i < data.size(); i += 4) flipped.q_true[i].coeffs() *= -1.0;
    const auto expected = fitOrientation(id.toStdString(), data);
    const auto seen = fitOrientation(id.toStdString(), flipped);
    FT_VERIFY_OK(expected);
    FT_VERIFY_OK(seen);
    for (const Eigen::Vector3d& p_m : randomPoints(50)) {
      const Eigen::Quaterniond q_tracked = rotationFromVector({0.2, 0.4, -1.0});
      FT_VERIFY_MATCH(near((*seen)->correct(p_m, q_tracked), (*expected)->correct(p_m, q_tracked), 1e-9));
    }
  }

  void errorsAroundAHalfTurnStayContinuous() {
    // A sensor mounted the other way round: error rotations from 170 to 190 degrees, where q and -q change places.
    const auto q_error = [](const Eigen::Vector3d& p) {
      return rotationFromVector(Eigen::Vector3d(0, 0, 1) * (M_PI + 0.17 * std::sin(2.0 * (p.x() - 0.8))));
    };
    const FitData data = fitDataOf(shakenGrid({6, 5, 4}, 0.2, 0.01), nothing_m, q_error);
    for (const std::string id : {"polynomial_quaternion", "hmq_matrix"}) {
      const auto model = fitOrientation(id, data);
      FT_VERIFY_OK(model);
      for (const Eigen::Vector3d& p_m :
           {Eigen::Vector3d(0.7, 0.1, 0.1), Eigen::Vector3d(0.8, 0.1, 0.1), Eigen::Vector3d(1.0, 0.2, 0.3)})
        FT_VERIFY_MATCH(near((*model)->correct(p_m, q_error(p_m)), Eigen::Quaterniond::Identity(), 3e-3));
    }
  }

  void visitsOfOnePlaceInSeveralOrientationsAreAveraged() {
    // The same places seen in three orientations, interpolated exactly: the error is one function of position.
    const std::vector<Eigen::Vector3d> points_m = shakenGrid({4, 4, 3}, 0.2, 0.01);
    FitData data;
    for (const Eigen::Quaterniond& q_true : kTrueOrientations) {
      const FitData visit = fitDataOf(points_m, nothing_m, smoothError, q_true);
      data.p_tracked_m.insert(data.p_tracked_m.end(), visit.p_tracked_m.begin(), visit.p_tracked_m.end());
      data.p_true_m.insert(data.p_true_m.end(), visit.p_true_m.begin(), visit.p_true_m.end());
      data.q_tracked.insert(data.q_tracked.end(), visit.q_tracked.begin(), visit.q_tracked.end());
      data.q_true.insert(data.q_true.end(), visit.q_true.begin(), visit.q_true.end());
      data.node.insert(data.node.end(), visit.node.begin(), visit.node.end());
    }
    const auto model = fitOrientation("hmq_matrix", data);
    FT_VERIFY_OK(model);
    for (const Eigen::Vector3d& p_m : points_m)
      FT_VERIFY_MATCH(near((*model)->correct(p_m, smoothError(p_m)), Eigen::Quaterniond::Identity(), 1e-7));
  }
};

FIELDTRUE_TEST(OrientationTest)
#include "orientation_test.moc"
