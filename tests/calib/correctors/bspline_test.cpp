#include <QTest>
#include <cmath>

#include "calib/correctors/radial/rbf_system.h"
#include "calib/correctors/splines/bspline_fit.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

SplineProblem problemOf(const std::vector<Eigen::Vector3d>& p_m, const Displacement& displacement_m, double noise_m,
                        unsigned seed) {
  RandomGeometry random(seed);
  const auto n = static_cast<Eigen::Index>(p_m.size());
  SplineProblem problem{SplineLattice::around(p_m, FieldFrame::around(p_m, 3, 1.0), 0.3), p_m, Eigen::MatrixXd(n, 3),
                        Eigen::MatrixXd(n, 3), Eigen::VectorXd(n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector3d& place_m = p_m[static_cast<std::size_t>(i)];
    const Eigen::Vector3d noise(random.normal(), random.normal(), random.normal());
    problem.y.row(i) = (displacement_m(place_m) + noise_m * noise).transpose();
    problem.x.row(i) = place_m.transpose();
    problem.weight[i] = random.between(0.3, 2.0);
  }
  return problem;
}

SplineProblem usualProblem() {
  return problemOf(
      shakenGrid({5, 5, 4}, 0.2, 0.02),
      [](const Eigen::Vector3d& p) {
        return Eigen::Vector3d(0.02 * std::sin(3.0 * p.x()), 0.01 * p.y() * p.z(), linear_m(p).z());
      },
      0.001, 6);
}

}  // namespace

class BsplineTest : public QObject {
  Q_OBJECT
 private slots:
  void basisFunctionsAddUpToOneAndTheirSlopesToZero() {
    const SplineProblem problem = usualProblem();
    RandomGeometry random(2);
    for (int trial = 0; trial < 50; ++trial) {
      const Eigen::Vector3d u_m = problem.lattice.clamped(random.pointInCube_m(0.6));
      const SplineWeights values = problem.lattice.weights(u_m, {});
      const SplineWeights slopes = problem.lattice.weights(u_m, {0, 1, 0});
      QCOMPARE(values.count, 64);
      double sum = 0.0, slope_sum = 0.0;
      for (std::size_t k = 0; k < 64; ++k) {
        QVERIFY(values.value[k] >= 0.0 && values.index[k] < problem.lattice.size());
        sum += values.value[k];
        slope_sum += slopes.value[k];
      }
      FT_VERIFY_MATCH(near(sum, 1.0, 1e-13));
      FT_VERIFY_MATCH(near(slope_sum, 0.0, 1e-12));
    }
  }

  void bendingVanishesForLinearCoefficientsOnly() {
    const SplineProblem problem = usualProblem();
    const Eigen::MatrixXd penalty = problem.lattice.bendingPenalty();
    const auto& spans = problem.lattice.spans();
    Eigen::VectorXd linear(problem.lattice.size()), product(linear.size());
    Eigen::Index next = 0;
    for (int i = 0; i < spans[0] + 3; ++i)
      for (int j = 0; j < spans[1] + 3; ++j)
        for (int k = 0; k < spans[2] + 3; ++k, ++next) {
          linear[next] = 2.0 + 0.5 * i - 0.3 * j + 0.7 * k;
          product[next] = i * j;
        }
    const double size = penalty.diagonal().maxCoeff();
    FT_VERIFY_MATCH(near(linear.dot(penalty * linear), 0.0, 1e-9 * size));
    QVERIFY(product.dot(penalty * product) > 0.01 * size);
  }

  void followsLinearFieldsInsideAndBeyond() {
    const auto model = fitPosition("bspline", fitDataOf(shakenGrid({5, 5, 4}, 0.2, 0.02), linear_m));
    FT_VERIFY_OK(model);
    for (const Eigen::Vector3d& p_m : randomPoints(200))
      FT_VERIFY_MATCH(near((*model)->displacement_m(3.0 * p_m), linear_m(3.0 * p_m), 1e-9));
  }

  void leavesTheLatticeWithoutAStepOrAKink() {
    SmoothingSpline spline = *SmoothingSpline::of(usualProblem());
    QVERIFY(spline.solve(1e-3));
    const auto field = spline.without({}, Pose{});
    QVERIFY(field);
    // Along a line that leaves the box sideways, the third derivative is 0 outside and nothing jumps at the border.
    const Eigen::Vector3d inside_m(0.8, 0.1, 0.1);
    for (const Eigen::Vector3d& step_m : {Eigen::Vector3d(0.01, 0, 0), {0, -0.01, 0}, {0.004, 0.003, -0.005}}) {
      for (int k = 0; k < 300; ++k) {
        const Eigen::Vector3d p_m = inside_m + k * step_m;
        const Eigen::Vector3d rise_m = field->value(p_m + 1e-4 * step_m) - field->value(p_m);
        FT_VERIFY_MATCH(near(rise_m, Eigen::Vector3d(field->gradient(p_m) * 1e-4 * step_m), 1e-11));
      }
    }
    const Eigen::Vector3d far_m(7.0, 0.1, 0.1), farther_m(9.0, 0.1, 0.1);
    const Eigen::Vector3d between_m = field->value(0.5 * (far_m + farther_m));
    FT_VERIFY_MATCH(near(between_m, Eigen::Vector3d(0.5 * (field->value(far_m) + field->value(farther_m))), 1e-12));
  }

  void holdsOutAsTheLeaveOutLemmaSays_data() {
    QTest::addColumn<QList<int>>("out");
    QTest::newRow("a corner") << QList<int>{0};
    QTest::newRow("one inside") << QList<int>{47};
    QTest::newRow("a fold") << QList<int>{3, 11, 24, 25, 26, 58, 77, 99};
  }
  void holdsOutAsTheLeaveOutLemmaSays() {
    QFETCH(QList<int>, out);
    const std::vector<std::size_t> places(out.begin(), out.end());
    const SplineProblem problem = usualProblem();
    SmoothingSpline spline = *SmoothingSpline::of(problem);
    QVERIFY(spline.solve(0.01));
    const auto held_out = spline.without(places, Pose{});
    QVERIFY(held_out);
    // A fit to all places, where those left out read what the fit without them predicts, is the fit without them.
    SplineProblem agreeing = problem;
    for (const std::size_t i : places)
      agreeing.y.row(static_cast<Eigen::Index>(i)) = held_out->value(problem.p_m[i]).transpose();
    SmoothingSpline refitted = *SmoothingSpline::of(agreeing);
    QVERIFY(refitted.solve(0.01));
    const auto expected = refitted.without({}, Pose{});
    for (const Eigen::Vector3d& p_m : randomPoints(50))
      FT_VERIFY_MATCH(near(held_out->value(p_m), expected->value(p_m), 1e-10));
    const auto of_all = spline.without({}, Pose{});
    QVERIFY((of_all->value(problem.p_m[places[0]]) - held_out->value(problem.p_m[places[0]])).norm() > 1e-5);
  }

  void followsTruthThatAFoldMoves() {
    const SplineProblem problem = usualProblem();
    const Pose moved{{0.01, -0.004, 0.02}, rotationFromVector({0.02, 0.03, -0.01})};
    SplineProblem of_moved = problem;
    for (Eigen::Index i = 0; i < problem.y.rows(); ++i) {
      const Eigen::Vector3d p_m = problem.x.row(i).transpose();
      const Eigen::Vector3d truth_m = p_m + problem.y.row(i).transpose();
      of_moved.y.row(i) = (moved * truth_m - p_m).transpose();
    }
    SmoothingSpline by_motion = *SmoothingSpline::of(problem), by_truth = *SmoothingSpline::of(of_moved);
    QVERIFY(by_motion.solve(0.01) && by_truth.solve(0.01));
    const std::vector<std::size_t> out = {5, 50};
    const auto seen = by_motion.without(out, moved), expected = by_truth.without(out, Pose{});
    for (const Eigen::Vector3d& p_m : randomPoints(50))
      FT_VERIFY_MATCH(near(seen->value(p_m), expected->value(p_m), 1e-10));
  }

  void degreesOfFreedomRunFromALinearFieldToEveryPlace() {
    const SmoothingSpline spline = *SmoothingSpline::of(usualProblem());
    // 1, x, y and z are never smoothed away.
    FT_VERIFY_MATCH(near(spline.score(1e8)->degrees_of_freedom, 4.0, 0.01));
    double last = 1e9;
    for (const double smoothing : {1e-6, 1e-4, 1e-2, 1.0, 100.0}) {
      const double now = spline.score(smoothing)->degrees_of_freedom;
      QVERIFY(now < last && now > 4.0 && now < 100.0);
      last = now;
    }
  }

  void choosesALinearFieldForPureNoise() {
    std::vector<double> worth;
    for (unsigned seed = 1; seed <= 9; ++seed) {
      SmoothingSpline spline =
          *SmoothingSpline::of(problemOf(shakenGrid({6, 6, 5}, 0.2, 0.02), nothing_m, 0.002, seed));
      QVERIFY(spline.solve(spline.choose({}).value()));
      worth.push_back(spline.degreesOfFreedom());
    }
    std::sort(worth.begin(), worth.end());
    QVERIFY2(worth[4] < 6.0, qPrintable(QString::number(worth[4])));
    QVERIFY2(worth[8] < 40.0, qPrintable(QString::number(worth[8])));
  }

  void choosesToFollowACleanWave() {
    const Displacement wave_m = [](const Eigen::Vector3d& p) {
      return Eigen::Vector3d(0.02 * std::sin(4.0 * p.x()), 0.02 * std::cos(4.0 * p.y()), 0.0);
    };
    const auto model = fitPosition("bspline", fitDataOf(shakenGrid({7, 7, 6}, 0.2, 0.02), wave_m));
    FT_VERIFY_OK(model);
    RandomGeometry random(3);
    for (int i = 0; i < 100; ++i) {
      const Eigen::Vector3d p_m(random.between(0.5, 1.5), random.between(-0.2, 0.8), random.between(-0.1, 0.7));
      FT_VERIFY_MATCH(near((*model)->displacement_m(p_m), wave_m(p_m), 0.0005));
    }
  }

  void takesTheSpansThatAreAsked() {
    const FitData data = fitDataOf(shakenGrid({5, 5, 3}, 0.2, 0.0), linear_m);
    const auto model = fitPosition("bspline", data, {{"spans", "4"}});
    FT_VERIFY_OK(model);
    FT_VERIFY_MATCH(holdsAll((*model)->note(), {"4x4x2"}));
    const auto too_many = fitPosition("bspline", data, {{"spans", "40"}});
    QVERIFY(!too_many);
    QCOMPARE(too_many.error().code, ErrorCode::kUnsupported);
    FT_VERIFY_MATCH(holdsAll(too_many.error().message, {"fewer spans"}));
  }
};

FIELDTRUE_TEST(BsplineTest)
#include "bspline_test.moc"
