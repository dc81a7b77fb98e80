#include <Eigen/LU>
#include <QTest>
#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/correctors/gaussian_process/gaussian_process_likelihood.h"
#include "calib/correctors/gaussian_process/gaussian_process_posterior.h"
#include "calib/correctors/numerics/dense_solver.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/random_geometry.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

/// Four places at the corners of a square, fitted in its plane. What a linear trend leaves of four corners is one
/// pattern, +1 -1 +1 -1 around the square, so that everything can be worked by hand.
struct Square {
  static constexpr double kHalf_m = 0.5, kLength_m = 0.8, kSignal_m = 0.02, kNugget_m = 0.005, kRipple_m = 0.01;
  std::vector<Eigen::Vector3d> p_m = {
      {kHalf_m, kHalf_m, 0}, {-kHalf_m, kHalf_m, 0}, {-kHalf_m, -kHalf_m, 0}, {kHalf_m, -kHalf_m, 0}};
  GaussianProcessScales scales{Eigen::Vector3d::Constant(kLength_m), kSignal_m, kNugget_m};
  FieldFrame frame;
  Eigen::VectorXd no_noise_m2 = Eigen::VectorXd::Zero(4);
  Eigen::MatrixXd y = Eigen::MatrixXd(4, 3);

  Square() {
    frame.dimension = 2;
    frame = scaledFrame(frame, scales);
    for (int i = 0; i < 4; ++i) y.row(i).setConstant(i % 2 == 0 ? kRipple_m : -kRipple_m);
  }

  RadialField field() const {
    auto solution = solveRadial(*TailProjection::of(frame.tail(p_m)),
                                covarianceMatrix(RadialKernel::kMatern52, frame, scales, p_m, no_noise_m2), y);
    solution->coefficients *= kSignal_m * kSignal_m;
    return RadialField(RadialKernel::kMatern52, 0.0, frame, p_m, *solution);
  }

  /// Variance of the signal along the pattern: s^2 (1 - 2 k(side) + k(diagonal)).
  double ofPattern_m2() const {
    const double side = 2.0 * kHalf_m / kLength_m;
    return kSignal_m * kSignal_m * (1.0 - 2.0 * matern52(side) + matern52(std::sqrt(2.0) * side));
  }
  double nugget_m2() const { return kNugget_m * kNugget_m; }
};

std::optional<GaussianProcessPosterior> posteriorOf(const RadialField& field, const GaussianProcessScales& scales,
                                                    const Eigen::VectorXd& noise_m2) {
  return GaussianProcessPosterior::of(
      field.frame().tail(field.centers_m()),
      covarianceMatrix(field.kernel(), field.frame(), scales, field.centers_m(), noise_m2));
}

double varianceOf_m2(const GaussianProcessPosterior& posterior, const RadialField& field,
                     const GaussianProcessScales& scales, const Eigen::Vector3d& p_m) {
  const double signal_m2 = scales.signal_sd_m * scales.signal_sd_m;
  return posterior.variance_m2(signal_m2, signal_m2 * field.kernelValues(p_m),
                               field.frame().tail(std::span(&p_m, 1)).row(0).transpose());
}

RestrictedLikelihood someLikelihood(RadialKernel kernel, int dimension) {
  std::vector<Eigen::Vector3d> p_m = shakenGrid({4, 3, 3}, 0.3, 0.08);
  if (dimension == 2)
    for (Eigen::Vector3d& place_m : p_m) place_m.z() = 0.1;
  RandomGeometry random(4);
  Eigen::MatrixXd y(36, 3);
  Eigen::VectorXd noise_m2(36);
  for (Eigen::Index i = 0; i < 36; ++i) {
    const Eigen::Vector3d& p = p_m[static_cast<std::size_t>(i)];
    y.row(i) << 0.01 * std::sin(3.0 * p.x()), 0.01 * p.y() * p.z(), 0.004 * std::cos(4.0 * p.y());
    y.row(i) += 0.001 * Eigen::RowVector3d(random.normal(), random.normal(), random.normal());
    noise_m2[i] = random.between(1e-7, 2e-6);
  }
  const FieldFrame frame = FieldFrame::around(p_m, dimension, 0.5);
  return *RestrictedLikelihood::of(kernel, frame, p_m, y, noise_m2);
}

}  // namespace

class GaussianProcessTest : public QObject {
  Q_OBJECT
 private slots:
  void krigesASquareAsByHand() {
    const Square square;
    const RadialField field = square.field();
    // The pattern is an eigenvector of the covariance, so the trend is 0 and each corner is drawn towards it by
    // signal / (signal + nugget).
    const double share = square.ofPattern_m2() / (square.ofPattern_m2() + square.nugget_m2());
    for (std::size_t i = 0; i < 4; ++i) {
      const double expected_m = (i % 2 == 0 ? 1.0 : -1.0) * Square::kRipple_m * share;
      FT_VERIFY_MATCH(near(field.value(square.p_m[i]), Eigen::Vector3d::Constant(expected_m), 1e-9));
    }
    FT_VERIFY_MATCH(near(field.value({0, 0, 0}), Eigen::Vector3d::Zero(), 1e-12));
    FT_VERIFY_MATCH(near(field.value({0, Square::kHalf_m, 0}), Eigen::Vector3d::Zero(), 1e-12));
    // Anywhere else: s^2 A / M times the pattern's kernels.
    const Eigen::Vector3d p_m(0.3, 0.1, 0);
    double kernels = 0.0;
    for (std::size_t i = 0; i < 4; ++i)
      kernels += (i % 2 == 0 ? 1.0 : -1.0) * matern52((p_m - square.p_m[i]).norm() / Square::kLength_m);
    const double expected_m = Square::kSignal_m * Square::kSignal_m * Square::kRipple_m * kernels /
                              (square.ofPattern_m2() + square.nugget_m2());
    FT_VERIFY_MATCH(near(field.value(p_m), Eigen::Vector3d::Constant(expected_m), 1e-9));
  }

  void knowsASquareAsWellAsByHand() {
    const Square square;
    const RadialField field = square.field();
    const auto posterior = posteriorOf(field, square.scales, square.no_noise_m2);
    QVERIFY(posterior);
    // At a measured place the field's variance is tau^2 - tau^4 P_ii, P = q q^T / M with q = (1 -1 1 -1) / 2.
    const double tau2 = square.nugget_m2();
    const double expected_m2 = tau2 - tau2 * tau2 * 0.25 / (square.ofPattern_m2() + tau2);
    for (const Eigen::Vector3d& corner_m : square.p_m)
      FT_VERIFY_MATCH(near(varianceOf_m2(*posterior, field, square.scales, corner_m), expected_m2, 1e-6 * expected_m2));
    const double inside_m2 = varianceOf_m2(*posterior, field, square.scales, {0, 0, 0});
    const double outside_m2 = varianceOf_m2(*posterior, field, square.scales, {3, 0, 0});
    QVERIFY(inside_m2 > 0.0 && outside_m2 > 10.0 * inside_m2);
    // Far away only the trend is known, whose variance is that of the corners' mean and slope plus the signal's.
    QVERIFY(outside_m2 > Square::kSignal_m * Square::kSignal_m);
  }

  void varianceIsThatOfUniversalKriging() {
    const std::vector<Eigen::Vector3d> p_m = shakenGrid({3, 3, 2}, 0.3, 0.05);
    const GaussianProcessScales scales{{0.7, 0.5, 0.9}, 0.01, 0.001};
    const FieldFrame frame = scaledFrame(FieldFrame::around(p_m, 3, 1.0), scales);
    const Eigen::VectorXd noise_m2 = Eigen::VectorXd::LinSpaced(18, 1e-7, 4e-6);
    const RadialField field(RadialKernel::kMatern32, 0.0, frame, p_m,
                            {Eigen::MatrixXd::Zero(18, 3), Eigen::MatrixXd::Zero(4, 3)});
    const auto posterior = posteriorOf(field, scales, noise_m2);
    QVERIFY(posterior);
    Eigen::MatrixXd k = covarianceMatrix(RadialKernel::kMatern32, frame, scales, p_m, noise_m2);
    completeSymmetric(k);
    const Eigen::MatrixXd inverse = k.inverse();
    const Eigen::MatrixXd h = frame.tail(p_m);
    for (const Eigen::Vector3d& at_m : randomPoints(10)) {
      const Eigen::VectorXd to_m2 = 1e-4 * field.kernelValues(at_m);
      const Eigen::VectorXd gap = frame.tail(std::span(&at_m, 1)).row(0).transpose() - h.transpose() * inverse * to_m2;
      const double expected_m2 =
          1e-4 - to_m2.dot(inverse * to_m2) + gap.dot((h.transpose() * inverse * h).inverse() * gap);
      FT_VERIFY_MATCH(near(varianceOf_m2(*posterior, field, scales, at_m), expected_m2, 1e-9 * (1e-4 + expected_m2)));
    }
  }

  void likelihoodIsThatOfItsDefinition() {
    const std::vector<Eigen::Vector3d> p_m = shakenGrid({3, 3, 2}, 0.3, 0.05);
    Eigen::MatrixXd y(18, 3);
    for (Eigen::Index i = 0; i < 18; ++i)
      y.row(i) = 0.01 * Eigen::RowVector3d(std::sin(double(i)), std::cos(2.0 * double(i)), std::sin(3.0 * double(i)));
    const Eigen::VectorXd noise_m2 = Eigen::VectorXd::LinSpaced(18, 1e-7, 4e-6);
    const FieldFrame frame = FieldFrame::around(p_m, 3, 1.0);
    const auto likelihood = RestrictedLikelihood::of(RadialKernel::kMatern52, frame, p_m, y, noise_m2);
    QVERIFY(likelihood);
    const auto byDefinition = [&](const RestrictedLikelihood::Parameters& parameters) {
      const GaussianProcessScales scales = scalesOf(parameters);
      Eigen::MatrixXd k = covarianceMatrix(RadialKernel::kMatern52, scaledFrame(frame, scales), scales, p_m, noise_m2);
      completeSymmetric(k);
      const Eigen::MatrixXd h = frame.tail(p_m), inverse = k.inverse();
      const Eigen::MatrixXd hkh = h.transpose() * inverse * h;
      const Eigen::MatrixXd p = inverse - inverse * h * hkh.inverse() * h.transpose() * inverse;
      return 3.0 * (std::log(k.determinant()) + std::log(hkh.determinant()) -
                    std::log((h.transpose() * h).determinant())) +
             (y.transpose() * p * y).trace();
    };
    for (const RestrictedLikelihood::Parameters& parameters :
         {RestrictedLikelihood::Parameters{-0.5, -0.2, 0.1, -4.0, -6.0}, {-1.0, 0.5, 0.0, -5.0, -5.0}}) {
      const double expected = byDefinition(parameters);
      FT_VERIFY_MATCH(near(likelihood->evaluate(parameters, nullptr).value(), expected, 1e-7 * std::abs(expected)));
    }
  }

  void likelihoodsSlopeIsThatOfDifferences_data() {
    QTest::addColumn<int>("kernel");
    QTest::addColumn<int>("dimension");
    QTest::newRow("5/2 in a volume") << static_cast<int>(RadialKernel::kMatern52) << 3;
    QTest::newRow("3/2 in a volume") << static_cast<int>(RadialKernel::kMatern32) << 3;
    QTest::newRow("5/2 in a plane") << static_cast<int>(RadialKernel::kMatern52) << 2;
  }
  void likelihoodsSlopeIsThatOfDifferences() {
    QFETCH(int, kernel);
    QFETCH(int, dimension);
    const RestrictedLikelihood likelihood = someLikelihood(static_cast<RadialKernel>(kernel), dimension);
    const RestrictedLikelihood::Parameters at = {-0.4, -0.9, 0.2, -4.3, -6.5};
    RestrictedLikelihood::Parameters slope{};
    QVERIFY(likelihood.evaluate(at, slope.data()));
    for (std::size_t k = 0; k < at.size(); ++k) {
      RestrictedLikelihood::Parameters above = at, below = at;
      above[k] += 1e-5;
      below[k] -= 1e-5;
      const double expected =
          (likelihood.evaluate(above, nullptr).value() - likelihood.evaluate(below, nullptr).value()) / 2e-5;
      FT_VERIFY_MATCH(near(slope[k], expected, 1e-5 * (1.0 + std::abs(expected))));
    }
    if (dimension == 2) QCOMPARE(slope[2], 0.0);
  }

  void findsTheNoiseThatWasPutIn() {
    // A field as smooth as the kernel assumes, and noise of 1 mm that the table says nothing about.
    RandomGeometry random(12);
    const std::vector<Eigen::Vector3d> p_m = shakenGrid({7, 7, 6}, 0.2, 0.03);
    const FitData clean = fitDataOf(p_m, [](const Eigen::Vector3d& p) -> Eigen::Vector3d {
      return 0.02 *
             Eigen::Vector3d(std::sin(3.0 * p.x() + p.y()), std::cos(2.5 * p.y() - p.z()), std::sin(2.0 * p.z()));
    });
    FitData noisy = clean;
    for (Eigen::Vector3d& truth_m : noisy.p_true_m)
      truth_m += 0.001 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    const auto model = fitPosition("gaussian_process", noisy);
    FT_VERIFY_OK(model);
    const double nugget_m = (*model)->parameters().at("nugget_sd_m").get<double>();
    FT_VERIFY_MATCH(near(nugget_m, 0.001, 1.5e-4));
    noisy.jig_sd_m = 0.001;
    const auto told = fitPosition("gaussian_process", noisy);
    FT_VERIFY_OK(told);
    const double left_m = (*told)->parameters().at("nugget_sd_m").get<double>();
    QVERIFY2(left_m < 5e-4, qPrintable(QString::number(left_m)));
  }

  void statedUncertaintyHoldsItsError() {
    RandomGeometry random(12);
    const std::vector<Eigen::Vector3d> p_m = shakenGrid({6, 6, 5}, 0.2, 0.03);
    const Displacement field_m = [](const Eigen::Vector3d& p) -> Eigen::Vector3d {
      return 0.01 *
             Eigen::Vector3d(std::sin(3.0 * p.x() + p.y()), std::cos(2.5 * p.y() - p.z()), std::sin(3.0 * p.z()));
    };
    FitData data = fitDataOf(p_m, field_m);
    data.jig_sd_m = 0.002;
    for (Eigen::Vector3d& truth_m : data.p_true_m)
      truth_m += data.jig_sd_m * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    const auto model = fitPosition("gaussian_process", data);
    FT_VERIFY_OK(model);
    double error_squares = 0.0, stated_squares = 0.0;
    for (int i = 0; i < 400; ++i) {
      const Eigen::Vector3d at_m(random.between(0.4, 1.4), random.between(-0.3, 0.7), random.between(-0.2, 0.6));
      error_squares += ((*model)->displacement_m(at_m) - field_m(at_m)).squaredNorm();
      stated_squares += std::pow((*model)->uncertainty_m(at_m).value(), 2);
    }
    const double ratio = std::sqrt(error_squares / stated_squares);
    QVERIFY2(ratio > 0.6 && ratio < 1.5, qPrintable(QString::number(ratio)));
    QVERIFY((*model)->uncertainty_m({9, 9, 9}).value() > 3.0 * (*model)->uncertainty_m({0.9, 0.2, 0.2}).value());
  }

  void tunesOnAPartOfManyPlacesAndSaysSo() {
    const FitData data = fitDataOf(shakenGrid({6, 6, 6}, 0.2, 0.03), [](const Eigen::Vector3d& p) {
      return Eigen::Vector3d(0.01 * p.x() * p.x(), 0.02 * std::sin(p.y()), 0.01 * p.z() * p.x());
    });
    const auto model = fitPosition("gaussian_process", data, {{"tuning_places", "80"}});
    FT_VERIFY_OK(model);
    FT_VERIFY_MATCH(holdsAll((*model)->note(), {"80 of 216 places"}));
    QCOMPARE((*model)->parameters().at("centers_m").size(), std::size_t{216});
  }
};

FIELDTRUE_TEST(GaussianProcessTest)
#include "gaussian_process_test.moc"
