#include "calib/field/pose_solver.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <QTest>
#include <limits>

#include "calib/field/dipole_field.h"
#include "tests/calib/field/couplings_at.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::field;
using fieldtrue::testing::couplingsAt;
using fieldtrue::testing::kC;
using fieldtrue::testing::near;
using fieldtrue::testing::RandomGeometry;

namespace {

double misfit(const Eigen::Matrix3d& S, const Pose& pose) { return (S - couplingsAt(pose)).norm(); }

/// A pose moved by a step of position [m] and a rotation vector [rad] in the tracker frame.
Pose moved(const Pose& pose, const Eigen::Matrix<double, 6, 1>& step) {
  return {pose.position_m + step.head<3>(),
          (rotationFromVector(Eigen::Vector3d(step.tail<3>())) * pose.orientation).normalized()};
}

/// Damped Gauss-Newton on the nine equations with numerical derivatives: another way to the least-squares pose.
Pose iterated(const Eigen::Matrix3d& S, Pose pose) {
  using Vector9 = Eigen::Matrix<double, 9, 1>;
  const auto residual = [&](const Pose& at) { return Vector9((couplingsAt(at) - S).reshaped()); };
  double damping = 1e-3;
  for (int iteration = 0; iteration < 500; ++iteration) {
    Eigen::Matrix<double, 9, 6> J;
    for (int k = 0; k < 6; ++k) {
      const Eigen::Matrix<double, 6, 1> step = 1e-6 * Eigen::Matrix<double, 6, 1>::Unit(k);
      J.col(k) = (residual(moved(pose, step)) - residual(moved(pose, -step))) / 2e-6;
    }
    const Vector9 r = residual(pose);
    Eigen::Matrix<double, 6, 6> normal = J.transpose() * J;
    normal.diagonal() *= 1.0 + damping;
    const Pose next = moved(pose, -normal.ldlt().solve(J.transpose() * r));
    const bool is_better = next.position_m.norm() > 0.05 && residual(next).norm() < r.norm();
    if (is_better) pose = next;
    damping = is_better ? damping * 0.3 : damping * 4.0;
    if (damping > 1e12) break;
  }
  return pose;
}

/// Derivative of the solved pose by each coupling: rows position [m] and rotation [rad] in the tracker frame.
Eigen::Matrix<double, 6, 9> sensitivity(const Pose& pose) {
  const Eigen::Matrix3d S = couplingsAt(pose);
  Eigen::Matrix<double, 6, 9> J;
  const double h = 1e-6 * S.norm();
  for (int k = 0; k < 9; ++k) {
    Eigen::Matrix3d step = Eigen::Matrix3d::Zero();
    step(k / 3, k % 3) = h;
    const Pose plus = solvePose(S + step, kC, pose.position_m)->tracker_from_sensor;
    const Pose minus = solvePose(S - step, kC, pose.position_m)->tracker_from_sensor;
    J.col(k).head<3>() = (plus.position_m - minus.position_m) / (2 * h);
    J.col(k).tail<3>() = rotationVector_rad(plus.orientation * minus.orientation.conjugate()) / (2 * h);
  }
  return J;
}

}  // namespace

class PoseSolverTest : public QObject {
  Q_OBJECT
 private slots:
  void returnsTheTruePoseWhenUndisturbed();
  void takesTheSideOfTheHemisphere();
  void endsWhereAnIteratedLeastSquaresEnds();
  void isTheLeastMisfitOfAll_data();
  void isTheLeastMisfitOfAll();
  void reportsTheMisfit();
  void spreadsNoiseAsTheTheorySays_data();
  void spreadsNoiseAsTheTheorySays();
  void scattersAsPredicted();
  void readsGainAsRange();
  void refusesWhatHasNoPose();
};

void PoseSolverTest::returnsTheTruePoseWhenUndisturbed() {
  RandomGeometry random(1);
  for (int i = 0; i < 5000; ++i) {
    const Pose truth = random.poseInShell(0.2, 5.0);
    const auto solved = solvePose(couplingsAt(truth), kC, truth.position_m);
    QVERIFY(solved.has_value());
    FT_VERIFY_MATCH(near(solved->tracker_from_sensor, truth, 1e-9, 1e-9));
    FT_VERIFY_MATCH(near(solved->residual_rms / couplingsAt(truth).norm(), 0.0, 1e-13));
  }
}

// G(p) = G(-p): the two poses have the same couplings and the same orientation.
void PoseSolverTest::takesTheSideOfTheHemisphere() {
  RandomGeometry random(2);
  for (int i = 0; i < 200; ++i) {
    const Pose truth = random.poseInShell(0.2, 3.0);
    const Eigen::Vector3d hemisphere = random.direction();
    const Pose solved = solvePose(couplingsAt(truth), kC, hemisphere)->tracker_from_sensor;
    const double side = truth.position_m.dot(hemisphere) < 0.0 ? -1.0 : 1.0;
    FT_VERIFY_MATCH(near(solved, Pose{side * truth.position_m, truth.orientation}, 1e-9, 1e-9));
  }
}

void PoseSolverTest::endsWhereAnIteratedLeastSquaresEnds() {
  RandomGeometry random(3);
  for (int i = 0; i < 40; ++i) {
    const Pose truth = random.poseInShell(0.5, 3.0);
    const Eigen::Matrix3d undisturbed = couplingsAt(truth);
    const Eigen::Matrix3d S = undisturbed + 0.1 * undisturbed.norm() / 3.0 * random.matrix();
    const Pose expected = iterated(S, truth);
    const Pose solved = solvePose(S, kC, truth.position_m)->tracker_from_sensor;
    FT_VERIFY_MATCH(near(solved, expected, 1e-6 * truth.position_m.norm(), 1e-6));
  }
}

void PoseSolverTest::isTheLeastMisfitOfAll_data() {
  QTest::addColumn<double>("determinant_sign");
  QTest::newRow("right-handed couplings") << 1.0;
  QTest::newRow("left-handed couplings, which no dipole gives") << -1.0;
}

// Matrices far from any dipole's: neither random poses nor descents from them find a smaller misfit.
void PoseSolverTest::isTheLeastMisfitOfAll() {
  QFETCH(double, determinant_sign);
  RandomGeometry random(4);
  for (int i = 0; i < 12; ++i) {
    Eigen::Matrix3d S = random.matrix();
    if (S.determinant() * determinant_sign < 0.0) S.row(0) *= -1.0;
    const Pose solved = solvePose(S, kC, Eigen::Vector3d::UnitX())->tracker_from_sensor;
    const double least = misfit(S, solved);
    for (int start = 0; start < 12; ++start) {
      const Pose other = random.poseInShell(0.5, 3.0);
      QVERIFY(misfit(S, other) >= least);
      const double descended = misfit(S, iterated(S, other));
      QVERIFY2(descended >= least * (1.0 - 1e-9),
               qPrintable(QString("descended to %1 below %2").arg(descended).arg(least)));
    }
  }
}

void PoseSolverTest::reportsTheMisfit() {
  RandomGeometry random(5);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Matrix3d S = random.matrix();
    const auto solved = solvePose(S, kC, Eigen::Vector3d::UnitX());
    FT_VERIFY_MATCH(near(solved->residual_rms, misfit(S, solved->tracker_from_sensor) / 3.0, 1e-12));
  }
}

void PoseSolverTest::spreadsNoiseAsTheTheorySays_data() {
  QTest::addColumn<double>("range_m");
  for (const double range_m : {0.5, 1.0, 2.0, 3.0}) QTest::addRow("%g m", range_m) << range_m;
}

// Linearised by hand (dG/dr = -3G/r along the line of sight, 3C/r^4 off-diagonal across it), for independent equal
// noise of SD sigma on nine couplings: radial SD = sigma r^4/(3 sqrt(6) C), transverse SD = sqrt(5)/3 sigma r^4/C,
// orientation SD per axis (rms) = sqrt(3/2) sigma r^3/C.
void PoseSolverTest::spreadsNoiseAsTheTheorySays() {
  QFETCH(double, range_m);
  RandomGeometry random(6);
  for (int i = 0; i < 20; ++i) {
    const Pose pose{range_m * random.direction(), random.rotation()};
    const Eigen::Matrix<double, 6, 9> J = sensitivity(pose);
    const Eigen::Matrix<double, 6, 6> covariance = J * J.transpose();
    const Eigen::Vector3d u = pose.position_m.normalized();
    const Eigen::Vector3d v = u.unitOrthogonal();
    const double r4 = std::pow(range_m, 4) / kC;
    const Eigen::Matrix3d position = covariance.topLeftCorner<3, 3>();
    const double radial = std::sqrt(u.dot(position * u));
    const double transverse = std::sqrt(v.dot(position * v));
    const double rotation = std::sqrt(covariance.bottomRightCorner<3, 3>().trace() / 3.0);
    FT_VERIFY_MATCH(near(radial / r4, 0.136083, 2e-6));
    FT_VERIFY_MATCH(near(transverse / r4, 0.745356, 2e-6));
    FT_VERIFY_MATCH(near(transverse / radial, std::sqrt(30.0), 1e-4));
    FT_VERIFY_MATCH(near(rotation / (r4 / range_m), std::sqrt(1.5), 1e-5));
  }
}

// 20,000 draws give an SD to 0.5 % (1/sqrt(2n)); the tolerance is four times that.
void PoseSolverTest::scattersAsPredicted() {
  RandomGeometry random(7);
  const double range_m = 1.7;
  const double sigma = 1e-4;
  const Pose pose{range_m * random.direction(), random.rotation()};
  const Eigen::Vector3d u = pose.position_m.normalized();
  double radial_m2 = 0.0;
  double transverse_m2 = 0.0;
  constexpr int kDraws = 20000;
  for (int i = 0; i < kDraws; ++i) {
    const Eigen::Matrix3d S = couplingsAt(pose) + sigma * random.matrix();
    const Eigen::Vector3d error_m = solvePose(S, kC, u)->tracker_from_sensor.position_m - pose.position_m;
    const double along_m = error_m.dot(u);
    radial_m2 += along_m * along_m / kDraws;
    transverse_m2 += (error_m.squaredNorm() - along_m * along_m) / (2.0 * kDraws);
  }
  const double unit_m = sigma * std::pow(range_m, 4) / kC;
  FT_VERIFY_MATCH(near(std::sqrt(radial_m2) / (0.136083 * unit_m), 1.0, 0.02));
  FT_VERIFY_MATCH(near(std::sqrt(transverse_m2) / (0.745356 * unit_m), 1.0, 0.02));
}

// S grows as 1/r^3: all couplings eight times as strong halve the range and turn nothing.
void PoseSolverTest::readsGainAsRange() {
  const Pose truth = RandomGeometry(8).poseInShell(1.0, 2.0);
  const auto solved = solvePose(8.0 * couplingsAt(truth), kC, truth.position_m);
  FT_VERIFY_MATCH(near(solved->tracker_from_sensor, Pose{truth.position_m / 2.0, truth.orientation}, 1e-12, 1e-12));
}

void PoseSolverTest::refusesWhatHasNoPose() {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const SolverLimits limits{0.2, 3.0};
  const auto errorAt = [&](double range_m) {
    return solvePose(couplingsAt({range_m * x, Eigen::Quaterniond::Identity()}), kC, x, limits);
  };
  QVERIFY(errorAt(0.201).has_value());
  QVERIFY(errorAt(2.99).has_value());
  QCOMPARE(errorAt(0.199).error(), SolveError::kSaturated);
  QCOMPARE(errorAt(3.01).error(), SolveError::kTooWeak);
  QCOMPARE(solvePose(Eigen::Matrix3d::Zero(), kC, x).error(), SolveError::kTooWeak);
  QCOMPARE(solvePose(Eigen::Matrix3d::Identity(), kC, x).error(), SolveError::kAmbiguous);
  Eigen::Matrix3d broken = Eigen::Matrix3d::Identity();
  broken(1, 2) = std::numeric_limits<double>::quiet_NaN();
  QCOMPARE(solvePose(broken, kC, x).error(), SolveError::kNotFinite);
  broken(1, 2) = std::numeric_limits<double>::infinity();
  QCOMPARE(solvePose(broken, kC, x, limits).error(), SolveError::kNotFinite);
  QVERIFY_THROWS_EXCEPTION(std::logic_error, (void)solvePose(Eigen::Matrix3d::Identity(), 0.0, x));
}

FIELDTRUE_TEST(PoseSolverTest)
#include "pose_solver_test.moc"
