#include "calib/correctors/radial/rbf_system.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <QTest>
#include <cmath>

#include "calib/correctors/numerics/dense_solver.h"
#include "calib/correctors/radial/rbf_tuning.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

/// A small smoothing problem with everything that a system has: unequal noise, a linear trend, something wavy.
struct SmallProblem {
  std::vector<Eigen::Vector3d> p_m = shakenGrid({4, 3, 3}, 0.25, 0.03);
  FieldFrame frame = FieldFrame::around(p_m, 3, 0.4);
  Eigen::MatrixXd y = Eigen::MatrixXd(36, 3);
  Eigen::MatrixXd x = Eigen::MatrixXd(36, 3);
  Eigen::VectorXd weight = Eigen::VectorXd(36);

  SmallProblem() {
    RandomGeometry random(8);
    for (Eigen::Index i = 0; i < 36; ++i) {
      const Eigen::Vector3d& p = p_m[static_cast<std::size_t>(i)];
      y.row(i) << 0.01 * std::sin(4.0 * p.x()) + 0.02 * p.y(), 0.01 * p.x() * p.z(), 0.005 * std::cos(3.0 * p.y());
      y.row(i) += 0.001 * Eigen::RowVector3d(random.normal(), random.normal(), random.normal());
      x.row(i) = p.transpose();
      weight[i] = random.between(0.2, 3.0);
    }
  }
};

Eigen::MatrixXd systemMatrix(RadialKernel kernel, double shape, double smoothing, const FieldFrame& frame,
                             std::span<const Eigen::Vector3d> p_m, const Eigen::VectorXd& weight) {
  Eigen::MatrixXd matrix = kernelMatrix(kernel, shape * shape, frame, p_m);
  matrix.diagonal() += smoothing * weight;
  completeSymmetric(matrix);
  return matrix;
}

/// The augmented system [A H; H^T 0] [c; t] = [y; 0] by plain elimination: independent of any projection.
RadialSolution byElimination(const Eigen::MatrixXd& a, const Eigen::MatrixXd& h, const Eigen::MatrixXd& y) {
  const Eigen::Index n = a.rows(), k = h.cols();
  Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(n + k, n + k), right = Eigen::MatrixXd::Zero(n + k, y.cols());
  whole.topLeftCorner(n, n) = a;
  whole.topRightCorner(n, k) = h;
  whole.bottomLeftCorner(k, n) = h.transpose();
  right.topRows(n) = y;
  const Eigen::MatrixXd solved = whole.fullPivLu().solve(right);
  return {solved.topRows(n), solved.bottomRows(k)};
}

/// Values of a problem without some places.
struct Reduced {
  std::vector<Eigen::Vector3d> p_m;
  Eigen::MatrixXd y;
  Eigen::VectorXd weight;

  Reduced(const SmallProblem& problem, const std::vector<std::size_t>& out) : p_m(withoutPlaces(problem.p_m, out)) {
    std::vector<Eigen::Index> kept;
    for (std::size_t i = 0; i < problem.p_m.size(); ++i)
      if (std::count(out.begin(), out.end(), i) == 0) kept.push_back(static_cast<Eigen::Index>(i));
    y = problem.y(kept, Eigen::all);
    weight = problem.weight(kept);
  }
};

const std::vector<std::pair<const char*, RadialKernel>> kKernels = {{"multiquadric", RadialKernel::kMultiquadric},
                                                                    {"inverse", RadialKernel::kInverseMultiquadric},
                                                                    {"cubic", RadialKernel::kCubic},
                                                                    {"thin plate", RadialKernel::kThinPlate},
                                                                    {"matern 3/2", RadialKernel::kMatern32},
                                                                    {"matern 5/2", RadialKernel::kMatern52}};

}  // namespace

class RbfSystemTest : public QObject {
  Q_OBJECT
 private:
  void addKernels() {
    QTest::addColumn<int>("kernel");
    for (const auto& [name, kernel] : kKernels) QTest::newRow(name) << static_cast<int>(kernel);
  }

 private slots:
  void denseFactorisations() {
    RandomGeometry random(3);
    Eigen::MatrixXd root(7, 7);
    for (double& value : root.reshaped()) value = random.normal();
    const Eigen::MatrixXd matrix = root * root.transpose() + Eigen::MatrixXd::Identity(7, 7);
    Eigen::MatrixXd lower = matrix.triangularView<Eigen::Lower>();
    QVERIFY(choleskyInPlace(lower));
    FT_VERIFY_MATCH(near(choleskyLogDeterminant(lower), std::log(matrix.determinant()), 1e-10));
    Eigen::MatrixXd solved = root;
    choleskySolve(lower, solved);
    FT_VERIFY_MATCH(near(Eigen::MatrixXd(matrix * solved), root, 1e-10));
    Eigen::MatrixXd of_lower = lower.triangularView<Eigen::Lower>();
    lowerInverseInPlace(of_lower);
    Eigen::MatrixXd product = lower.triangularView<Eigen::Lower>();
    lowerTimesInPlace(of_lower, product);
    FT_VERIFY_MATCH(near(product, Eigen::MatrixXd(Eigen::MatrixXd::Identity(7, 7)), 1e-12));
    choleskyInverseInPlace(lower);
    completeSymmetric(lower);
    FT_VERIFY_MATCH(near(Eigen::MatrixXd(matrix * lower), Eigen::MatrixXd(Eigen::MatrixXd::Identity(7, 7)), 1e-10));
    Eigen::MatrixXd vectors = matrix.triangularView<Eigen::Lower>();
    Eigen::VectorXd values;
    QVERIFY(symmetricEigenInPlace(vectors, values));
    FT_VERIFY_MATCH(near(Eigen::MatrixXd(vectors * values.asDiagonal() * vectors.transpose()), matrix, 1e-10));
    Eigen::MatrixXd indefinite = matrix;
    indefinite(3, 3) = -1.0;
    QVERIFY(!choleskyInPlace(indefinite));
    Eigen::MatrixXd not_a_number = matrix;
    not_a_number(6, 6) = std::nan("");
    QVERIFY(!choleskyInPlace(not_a_number));
  }

  void completesLargeMatricesInTiles() {
    Eigen::MatrixXd matrix(101, 101);
    for (Eigen::Index j = 0; j < 101; ++j)
      for (Eigen::Index i = 0; i < 101; ++i) matrix(i, j) = i >= j ? static_cast<double>(1000 * i + j) : std::nan("");
    completeSymmetric(matrix);
    QVERIFY(matrix.allFinite());
    QVERIFY(matrix == matrix.transpose());
  }

  void projectionAgreesWithItsOrthogonalMatrix() {
    const SmallProblem problem;
    const auto projection = TailProjection::of(problem.frame.tail(problem.p_m));
    QVERIFY(projection);
    const Eigen::MatrixXd q2 = projection->fromComplement(Eigen::MatrixXd::Identity(32, 32));
    const Eigen::MatrixXd q1 = projection->tailBasis();
    FT_VERIFY_MATCH(
        near(Eigen::MatrixXd(q2.transpose() * q2), Eigen::MatrixXd(Eigen::MatrixXd::Identity(32, 32)), 1e-13));
    const Eigen::MatrixXd h = problem.frame.tail(problem.p_m);
    QVERIFY((q2.transpose() * h).cwiseAbs().maxCoeff() < 1e-13);
    FT_VERIFY_MATCH(near(projection->toComplement(problem.y), Eigen::MatrixXd(q2.transpose() * problem.y), 1e-14));
    FT_VERIFY_MATCH(near(projection->toTail(problem.y), Eigen::MatrixXd(q1.transpose() * problem.y), 1e-14));
    const Eigen::MatrixXd a = systemMatrix(RadialKernel::kCubic, 1.0, 0.1, problem.frame, problem.p_m, problem.weight);
    Eigen::MatrixXd projected = projection->projected(a);
    completeSymmetric(projected);
    FT_VERIFY_MATCH(near(projected, Eigen::MatrixXd(q2.transpose() * a * q2), 1e-11));
    Eigen::MatrixXd lifted = projection->lifted(projected);
    completeSymmetric(lifted);
    FT_VERIFY_MATCH(near(lifted, Eigen::MatrixXd(q2 * projected * q2.transpose()), 1e-11));
    const Eigen::Vector4d tail(1.0, 0.3, -0.2, 0.7);
    FT_VERIFY_MATCH(near(Eigen::MatrixXd(h.transpose() * projection->weightsOf(tail)), Eigen::MatrixXd(tail), 1e-12));
  }

  void solutionIsThatOfTheAugmentedSystem_data() { addKernels(); }
  void solutionIsThatOfTheAugmentedSystem() {
    QFETCH(int, kernel);
    const SmallProblem problem;
    const Eigen::MatrixXd h = problem.frame.tail(problem.p_m);
    for (const double smoothing : {0.0, 0.05}) {
      const Eigen::MatrixXd a =
          systemMatrix(static_cast<RadialKernel>(kernel), 0.6, smoothing, problem.frame, problem.p_m, problem.weight);
      const auto solution = solveRadial(*TailProjection::of(h), a, problem.y);
      QVERIFY(solution);
      const RadialSolution expected = byElimination(a, h, problem.y);
      const double size = 1.0 + expected.coefficients.cwiseAbs().maxCoeff();
      FT_VERIFY_MATCH(near(solution->coefficients, expected.coefficients, 1e-10 * size));
      FT_VERIFY_MATCH(near(solution->tail, expected.tail, 1e-10 * size));
    }
  }

  void holdsOutAsARefitWould_data() {
    QTest::addColumn<int>("kernel");
    QTest::addColumn<QList<int>>("out");
    for (const auto& [name, kernel] : kKernels) {
      QTest::addRow("%s, a corner", name) << static_cast<int>(kernel) << QList<int>{0};
      QTest::addRow("%s, seven places", name) << static_cast<int>(kernel) << QList<int>{1, 4, 9, 17, 18, 30, 35};
    }
  }
  void holdsOutAsARefitWould() {
    QFETCH(int, kernel);
    QFETCH(QList<int>, out);
    const std::vector<std::size_t> places(out.begin(), out.end());
    const SmallProblem problem;
    const auto all =
        systemMatrix(static_cast<RadialKernel>(kernel), 0.6, 0.02, problem.frame, problem.p_m, problem.weight);
    const auto hold_out =
        RadialHoldOut::of(*TailProjection::of(problem.frame.tail(problem.p_m)), all, problem.y, problem.x);
    QVERIFY(hold_out);
    const auto seen = hold_out->without(places, Pose{});
    QVERIFY(seen);
    const Reduced rest(problem, places);
    const RadialSolution expected =
        byElimination(systemMatrix(static_cast<RadialKernel>(kernel), 0.6, 0.02, problem.frame, rest.p_m, rest.weight),
                      problem.frame.tail(rest.p_m), rest.y);
    const double size = 1.0 + expected.coefficients.cwiseAbs().maxCoeff();
    FT_VERIFY_MATCH(near(seen->coefficients, expected.coefficients, 1e-9 * size));
    FT_VERIFY_MATCH(near(seen->tail, expected.tail, 1e-9 * size));
  }

  void followsTruthThatAFoldMoves() {
    const SmallProblem problem;
    const Pose moved{{0.01, -0.004, 0.02}, rotationFromVector({0.02, 0.03, -0.01})};
    Eigen::MatrixXd moved_y = problem.y;
    for (Eigen::Index i = 0; i < moved_y.rows(); ++i) {
      const Eigen::Vector3d p_m = problem.x.row(i).transpose();
      const Eigen::Vector3d truth_m = p_m + problem.y.row(i).transpose();
      moved_y.row(i) = (moved * truth_m - p_m).transpose();
    }
    const Eigen::MatrixXd a =
        systemMatrix(RadialKernel::kMultiquadric, 0.6, 0.02, problem.frame, problem.p_m, problem.weight);
    const auto projection = TailProjection::of(problem.frame.tail(problem.p_m));
    const auto by_motion = RadialHoldOut::of(*projection, a, problem.y, problem.x);
    const auto by_truth = RadialHoldOut::of(*projection, a, moved_y, problem.x);
    const std::vector<std::size_t> out = {3, 20};
    const auto seen = by_motion->without(out, moved);
    const auto expected = by_truth->without(out, Pose{});
    QVERIFY(seen && expected);
    FT_VERIFY_MATCH(near(seen->coefficients, expected->coefficients, 1e-10));
    FT_VERIFY_MATCH(near(seen->tail, expected->tail, 1e-10));
  }

  void refusesWhatTheRestDoesNotDetermine() {
    // All places but those of one plane held out: nothing tells the slope across it.
    std::vector<Eigen::Vector3d> p_m;
    for (int i = 0; i < 18; ++i) p_m.emplace_back(0.2 * (i % 3), 0.2 * (i / 3 % 3), i < 9 ? 0.0 : 0.3);
    const FieldFrame frame = FieldFrame::around(p_m, 3, 0.3);
    const Eigen::MatrixXd y = Eigen::MatrixXd::Random(18, 3);
    const auto hold_out = RadialHoldOut::of(
        *TailProjection::of(frame.tail(p_m)),
        systemMatrix(RadialKernel::kMultiquadric, 0.5, 0.1, frame, p_m, Eigen::VectorXd::Ones(18)), y, y);
    QVERIFY(hold_out);
    QVERIFY(hold_out->without(std::vector<std::size_t>{0, 1, 2}, Pose{}));
    QVERIFY(!hold_out->without(std::vector<std::size_t>{9, 10, 11, 12, 13, 14, 15, 16, 17}, Pose{}));
  }

  void rippasErrorsAreThoseOfRefits_data() { addKernels(); }
  void rippasErrorsAreThoseOfRefits() {
    QFETCH(int, kernel);
    const SmallProblem problem;
    const double smoothing = 0.03, shape = 0.6;
    double squares = 0.0;
    for (std::size_t i = 0; i < problem.p_m.size(); ++i) {
      const Reduced rest(problem, {i});
      const RadialSolution without = byElimination(
          systemMatrix(static_cast<RadialKernel>(kernel), shape, smoothing, problem.frame, rest.p_m, rest.weight),
          problem.frame.tail(rest.p_m), rest.y);
      const RadialField field(static_cast<RadialKernel>(kernel), shape * shape, problem.frame, rest.p_m, without);
      const auto row = static_cast<Eigen::Index>(i);
      squares += (problem.y.row(row).transpose() - field.value(problem.p_m[i])).squaredNorm() / problem.weight[row];
    }
    const auto loo = RbfLeaveOneOut::of(
        {static_cast<RadialKernel>(kernel), problem.frame, problem.p_m, problem.y, problem.weight}, shape);
    QVERIFY(loo);
    const double expected = std::sqrt(squares / 36.0);
    FT_VERIFY_MATCH(near(loo->rms_m(smoothing), expected, 1e-9 * expected));
  }

  void theChoiceBeatsEveryOtherOneTried() {
    const SmallProblem problem;
    const RbfProblem rbf{RadialKernel::kMultiquadric, problem.frame, problem.p_m, problem.y, problem.weight};
    const auto choice = chooseRbf(rbf, std::nullopt, std::nullopt, {});
    QVERIFY(choice);
    for (const double shape : {0.05, 0.3, 1.0, 3.0, 6.0})
      for (const double smoothing : {1e-6, 1e-3, 0.03, 1.0, 100.0})
        QVERIFY(RbfLeaveOneOut::of(rbf, shape)->rms_m(smoothing) >= 0.98 * choice->loo_rms_m);
    const auto fixed = chooseRbf(rbf, 0.7, 0.01, {});
    QVERIFY(fixed && fixed->shape == 0.7 && fixed->smoothing == 0.01);
  }

  void gradientIsThatOfTheValue_data() { addKernels(); }
  void gradientIsThatOfTheValue() {
    QFETCH(int, kernel);
    const SmallProblem problem;
    FieldFrame stretched = problem.frame;
    stretched.per_m = Eigen::Vector3d(2.0, 1.5, 4.0);
    stretched.axes = rotationFromVector({0.3, -0.2, 0.5}).toRotationMatrix();
    const RadialField field(static_cast<RadialKernel>(kernel), 0.36, stretched, problem.p_m,
                            {problem.y, Eigen::MatrixXd::Random(4, 3)});
    for (const Eigen::Vector3d& p_m : randomPoints(20)) {
      Eigen::Matrix3d expected;
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d step_m = 1e-5 * Eigen::Vector3d::Unit(axis);
        expected.col(axis) = (field.value(p_m + step_m) - field.value(p_m - step_m)) / 2e-5;
      }
      const double largest = (field.gradient(p_m) - expected).cwiseAbs().maxCoeff();
      FT_VERIFY_MATCH(near(largest, 0.0, 1e-7 * (1.0 + expected.cwiseAbs().maxCoeff())));
    }
  }

  void noiseOfAPlaceIsThatOfItsMeanAndOfPlacing() {
    FitData data = fitDataOf({{0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
                             [](const Eigen::Vector3d&) { return Eigen::Vector3d::Zero(); });
    data.node = {5, 5, 6, 7};
    data.jig_sd_m = 0.003;
    const auto diagonal = [](double x, double y, double z) {
      return Eigen::Matrix3d(Eigen::Vector3d(x, y, z).asDiagonal());
    };
    data.noise_m2 = {diagonal(3e-6, 6e-6, 9e-6), diagonal(2e-6, 2e-6, 2e-6), diagonal(5e-6, 5e-6, 5e-6),
                     Eigen::Matrix3d::Zero()};
    const Eigen::VectorXd noise_m2 = placeNoise_m2(data, mergePlaces(data));
    FT_VERIFY_MATCH(near(noise_m2[0], 9e-6 + (6e-6 + 2e-6) / 4.0, 1e-18));
    FT_VERIFY_MATCH(near(noise_m2[1], 9e-6 + 5e-6, 1e-18));
    // The upper median of {2e-6, 5e-6} for the place that states none.
    FT_VERIFY_MATCH(near(noise_m2[2], 9e-6 + 5e-6, 1e-18));
    data.noise_m2.clear();
    QVERIFY((placeNoise_m2(data, mergePlaces(data)).array() == 9e-6).all());
  }
};

FIELDTRUE_TEST(RbfSystemTest)
#include "rbf_system_test.moc"
