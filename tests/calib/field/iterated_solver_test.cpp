#include <QTest>
#include <cmath>

#include "calib/field/dipole_field.h"
#include "calib/field/pose_solver.h"
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

namespace {}  // namespace

class IteratedSolverTest : public QObject {
  Q_OBJECT
 private slots:
  void findsTheUndisturbedPose_data();
  void findsTheUndisturbedPose();
  void leastSquaresEndsAtTheClosedForm();
  void dampingHoldsBackAsItSays();
  void dampingTamesStrongDistortion();
  void knowsItsNames();
  void refusesWhatTheClosedFormRefuses();
};

void IteratedSolverTest::findsTheUndisturbedPose_data() {
  QTest::addColumn<int>("solver");
  for (const PoseSolver solver : {PoseSolver::kClosedForm, PoseSolver::kLeastSquares, PoseSolver::kDamped}) {
    QTest::addRow("%s", std::string(nameOf(solver)).c_str()) << static_cast<int>(solver);
  }
}

void IteratedSolverTest::findsTheUndisturbedPose() {
  QFETCH(int, solver);
  RandomGeometry random(1);
  for (int i = 0; i < 500; ++i) {
    const Pose truth = random.poseInShell(0.3, 3.0);
    const auto solved = solvePose(static_cast<PoseSolver>(solver), couplingsAt(truth), kC, truth.position_m);
    QVERIFY(solved.has_value());
    FT_VERIFY_MATCH(near(solved->tracker_from_sensor, truth, 1e-9, 1e-9));
  }
}

// The minimum of the sum of squares is one, whichever way it is reached.
void IteratedSolverTest::leastSquaresEndsAtTheClosedForm() {
  RandomGeometry random(2);
  for (int i = 0; i < 300; ++i) {
    const Pose truth = random.poseInShell(0.5, 3.0);
    const Eigen::Matrix3d undisturbed = couplingsAt(truth);
    const Eigen::Matrix3d S = undisturbed + 0.1 * undisturbed.norm() / 3.0 * random.matrix();
    const auto direct = solvePose(S, kC, truth.position_m);
    const auto iterated = solvePose(PoseSolver::kLeastSquares, S, kC, truth.position_m);
    FT_VERIFY_MATCH(near(iterated->tracker_from_sensor, direct->tracker_from_sensor, 1e-6, 1e-6));
    FT_VERIFY_MATCH(near(iterated->residual_rms, direct->residual_rms, 1e-9));
  }
}

// One unit of information per transverse metre is 9/5 (C/r^4)^2 and per radial metre 54 (C/r^4)^2, the inverse squares
// of the published noise; in units of k = C/r^3 and r that leaves 1.8/(1.8 + w) and 54/(54 + w) of a small error.
void IteratedSolverTest::dampingHoldsBackAsItSays() {
  RandomGeometry random(3);
  for (int i = 0; i < 50; ++i) {
    const Pose truth = random.poseInShell(0.5, 3.0);
    const Eigen::Matrix3d S = couplingsAt(truth) + 1e-6 * couplingsAt(truth).norm() * random.matrix();
    const Eigen::Vector3d u = truth.position_m.normalized();
    const Eigen::Vector3d free = solvePose(S, kC, truth.position_m)->tracker_from_sensor.position_m - truth.position_m;
    const Eigen::Vector3d held =
        solvePose(PoseSolver::kDamped, S, kC, truth.position_m)->tracker_from_sensor.position_m - truth.position_m;
    const Eigen::Vector3d free_across = free - free.dot(u) * u;
    const Eigen::Vector3d held_across = held - held.dot(u) * u;
    FT_VERIFY_MATCH(near((held_across - 1.8 / (1.8 + kDamping) * free_across).norm() / free_across.norm(), 0.0, 1e-3));
    FT_VERIFY_MATCH(near(held.dot(u) / free.dot(u), 54.0 / (54.0 + kDamping), 1e-2));
  }
}

void IteratedSolverTest::dampingTamesStrongDistortion() {
  RandomGeometry random(4);
  double free_m = 0.0;
  double held_m = 0.0;
  for (int i = 0; i < 200; ++i) {
    const Pose truth = random.poseInShell(1.0, 2.0);
    const Eigen::Matrix3d S = couplingsAt(truth) + 0.15 * couplingsAt(truth).norm() * random.matrix();
    free_m += (solvePose(S, kC, truth.position_m)->tracker_from_sensor.position_m - truth.position_m).norm();
    held_m +=
        (solvePose(PoseSolver::kDamped, S, kC, truth.position_m)->tracker_from_sensor.position_m - truth.position_m)
            .norm();
  }
  QVERIFY(held_m < 0.95 * free_m);
}

void IteratedSolverTest::knowsItsNames() {
  for (const char* name : {"closed_form", "least_squares", "damped"}) {
    const auto solver = poseSolverNamed(name);
    QVERIFY(solver.has_value());
    QVERIFY(nameOf(*solver) == name);
  }
  QVERIFY(!poseSolverNamed("newton").has_value());
}

void IteratedSolverTest::refusesWhatTheClosedFormRefuses() {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  for (const PoseSolver solver : {PoseSolver::kLeastSquares, PoseSolver::kDamped}) {
    QCOMPARE(solvePose(solver, Eigen::Matrix3d::Zero(), kC, x).error(), SolveError::kTooWeak);
    const Pose near_by{0.1 * x, Eigen::Quaterniond::Identity()};
    QCOMPARE(solvePose(solver, couplingsAt(near_by), kC, x, {0.2, 3.0}).error(), SolveError::kSaturated);
  }
}

FIELDTRUE_TEST(IteratedSolverTest)
#include "iterated_solver_test.moc"
