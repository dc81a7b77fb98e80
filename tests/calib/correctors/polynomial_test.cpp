#include <Eigen/Dense>
#include <QTest>
#include <cmath>

#include "calib/correctors/polynomial/polynomial_field.h"
#include "tests/calib/correctors/fit_fixtures.h"
#include "tests/support/matchers.h"
#include "tests/support/test_main.h"

using namespace fieldtrue;
using namespace fieldtrue::correctors;
using namespace fieldtrue::testing;

namespace {

/// A field with every monomial up to a degree, coefficients made by hand: c = 0.02 sin(1 + 3 s + 5 t + 7 u + axis).
Eigen::Vector3d fullField_m(const Eigen::Vector3d& p_m, int degree) {
  Eigen::Vector3d sum_m = Eigen::Vector3d::Zero();
  for (int s = 0; s <= degree; ++s)
    for (int t = 0; s + t <= degree; ++t)
      for (int u = 0; s + t + u <= degree; ++u)
        for (int axis = 0; axis < 3; ++axis)
          sum_m[axis] += 0.02 * std::sin(1.0 + 3 * s + 5 * t + 7 * u + axis) * std::pow(p_m.x(), s) *
                         std::pow(p_m.y(), t) * std::pow(p_m.z(), u);
  return sum_m;
}

}  // namespace

class PolynomialTest : public QObject {
  Q_OBJECT
 private slots:
  void countsTermsAsTheSurveyDoes() {
    // (r+1)(r+2)(r+3)/6 and, in a plane, (r+1)(r+2)/2.
    const int in_volume[] = {1, 4, 10, 20, 35, 56, 84};
    const int in_plane[] = {1, 3, 6, 10, 15, 21, 28};
    for (int degree = 0; degree <= 6; ++degree) {
      QCOMPARE(PolynomialField::termCount(3, degree), in_volume[degree]);
      QCOMPARE(PolynomialField::termCount(2, degree), in_plane[degree]);
    }
  }

  void recoversAFieldOfItsDegree_data() {
    QTest::addColumn<int>("degree");
    for (int degree = 1; degree <= 6; ++degree) QTest::addRow("degree %d", degree) << degree;
  }
  void recoversAFieldOfItsDegree() {
    QFETCH(int, degree);
    const auto field_m = [degree](const Eigen::Vector3d& p_m) { return fullField_m(p_m, degree); };
    const auto model = fitPosition("polynomial", fitDataOf(shakenGrid({7, 7, 7}, 0.2, 0.02), field_m),
                                   {{"degree", std::to_string(degree)}});
    FT_VERIFY_OK(model);
    for (const Eigen::Vector3d& p_m : randomPoints(300))
      FT_VERIFY_MATCH(near((*model)->displacement_m(p_m), field_m(p_m), 1e-8));
  }

  void needsAsManyPlacesAsTerms_data() {
    QTest::addColumn<int>("degree");
    QTest::addColumn<int>("places");
    QTest::addColumn<int>("dimension");
    QTest::addColumn<QByteArray>("expected");
    QTest::newRow("degree 4 in a volume")
        << 4 << 27 << 3 << QByteArray("Polynomial of degree 4 needs at least 35 places, got 27");
    QTest::newRow("degree 1 in a volume")
        << 1 << 3 << 3 << QByteArray("Polynomial of degree 1 needs at least 4 places, got 3");
    QTest::newRow("degree 2 in a plane") << 2 << 5 << 2
                                         << QByteArray(
                                                "Polynomial of degree 2 in a plane needs at least 6 places, got 5");
  }
  void needsAsManyPlacesAsTerms() {
    QFETCH(int, degree);
    QFETCH(int, places);
    QFETCH(int, dimension);
    QFETCH(QByteArray, expected);
    std::vector<Eigen::Vector3d> points_m = shakenGrid({3, 3, 3}, 0.2, 0.02);
    points_m.resize(static_cast<std::size_t>(places));
    FitData data = fitDataOf(points_m, [](const Eigen::Vector3d&) { return Eigen::Vector3d::Zero(); });
    data.dimension = dimension;
    const auto model = fitPosition("polynomial", data, {{"degree", std::to_string(degree)}});
    QVERIFY(!model);
    QCOMPARE(model.error().code, ErrorCode::kTooFewNodes);
    QCOMPARE(QByteArray::fromStdString(model.error().message), expected);
  }

  void visitsOfAPlaceCountOnce() {
    // Three places visited nine times each are three places.
    FitData data;
    for (int place = 0; place < 3; ++place)
      for (int visit = 0; visit < 9; ++visit) {
        const Eigen::Vector3d p_true_m(0.1 * place, 0.1 * place * place, 0.05 * place);
        data.p_true_m.push_back(p_true_m);
        data.p_tracked_m.push_back(p_true_m + 0.001 * Eigen::Vector3d(std::sin(visit), std::cos(visit), visit * 0.1));
        data.node.push_back(place);
      }
    const auto model = fitPosition("affine", data);
    QVERIFY(!model);
    QCOMPARE(QByteArray::fromStdString(model.error().message), QByteArray("Affine fit needs at least 4 places, got 3"));
  }

  void gridWithTooFewLevelsIsRefused() {
    // x^3 on the three levels of an exact grid is a combination of 1, x, x^2.
    FitData data =
        fitDataOf(shakenGrid({3, 6, 6}, 0.2, 0.0), [](const Eigen::Vector3d& p) { return Eigen::Vector3d(0.1 * p); });
    const auto refused = [&](const QList<QByteArray>& words) {
      const auto model = fitPosition("polynomial", data, {{"degree", "3"}});
      QVERIFY(!model);
      QCOMPARE(model.error().code, ErrorCode::kDegenerate);
      FT_VERIFY_MATCH(holdsAll(model.error().message, words));
    };
    refused({"degree 3 needs 4 levels", "there are 3: use degree=2"});
    FT_VERIFY_OK(fitPosition("polynomial", data, {{"degree", "2"}}));
    data.index.clear();
    refused({"20 terms", "only 19", "lower degree"});
  }

  void poorlyDeterminedTermsAreSaid() {
    // Three levels that only a millimetre of shake tells from degenerate ones.
    FitData data =
        fitDataOf(shakenGrid({3, 6, 6}, 0.2, 1e-4), [](const Eigen::Vector3d& p) { return Eigen::Vector3d(0.1 * p); });
    data.index.clear();
    const auto model = fitPosition("polynomial", data, {{"degree", "3"}});
    FT_VERIFY_OK(model);
    FT_VERIFY_MATCH(holdsAll((*model)->note(), {"poorly determined"}));
  }

  void fitsInTheirPlaneWhenPlacesAreFlat() {
    // A tilted plane; the error depends on the two coordinates u, v in it, and has all three components.
    const Eigen::Quaterniond tilt = rotationFromVector({0.4, -0.3, 0.2});
    const Eigen::Vector3d center_m(0.2, 0.1, 0.5);
    const auto field_m = [&](const Eigen::Vector3d& p_m) {
      const Eigen::Vector3d local = tilt.conjugate() * (p_m - center_m);
      return Eigen::Vector3d(0.01 + 0.1 * local.x() * local.y(), -0.05 * local.x() * local.x(), 0.03 * local.y());
    };
    std::vector<Eigen::Vector3d> points_m;
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 5; ++j) points_m.push_back(center_m + tilt * Eigen::Vector3d(0.1 * i, 0.12 * j, 0.0));
    FitData data = fitDataOf(points_m, field_m);
    data.dimension = 2;
    const auto model = fitPosition("polynomial", data, {{"degree", "2"}});
    FT_VERIFY_OK(model);
    FT_VERIFY_MATCH(holdsAll((*model)->note(), {"one plane", "fitted in the plane"}));
    for (const double u : {0.03, 0.21, 0.44})
      for (const double v : {0.02, 0.3}) {
        const Eigen::Vector3d p_m = center_m + tilt * Eigen::Vector3d(u, v, 0.0);
        FT_VERIFY_MATCH(near((*model)->displacement_m(p_m), field_m(p_m), 1e-12));
      }
  }

  void uncertaintyIsTheTextbookPredictionError() {
    // Affine fit of n noisy points: s^2 = SSR / (n - 4); SD of a prediction s sqrt(1 + x^T (X^T X)^-1 x), here by
    // normal equations on raw coordinates, over all three axes.
    std::mt19937_64 generator(3);
    std::normal_distribution<double> noise_m(0.0, 0.002);
    FitData data = fitDataOf(shakenGrid({4, 4, 4}, 0.2, 0.01), [&](const Eigen::Vector3d& p) {
      return Eigen::Vector3d(0.02 * p.x() + noise_m(generator), noise_m(generator), noise_m(generator));
    });
    const auto model = fitPosition("affine", data);
    FT_VERIFY_OK(model);
    const auto n = static_cast<Eigen::Index>(data.size());
    Eigen::MatrixXd X(n, 4);
    Eigen::MatrixXd D(n, 3);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto row = static_cast<std::size_t>(i);
      X.row(i) << 1.0, data.p_tracked_m[row].transpose();
      D.row(i) = (data.p_true_m[row] - data.p_tracked_m[row]).transpose();
    }
    const Eigen::MatrixXd inverse = (X.transpose() * X).inverse();
    const double variance_m2 = (D - X * (inverse * X.transpose() * D)).squaredNorm() / static_cast<double>(n - 4);
    for (const Eigen::Vector3d& p_m : randomPoints(20)) {
      const Eigen::Vector4d x(1.0, p_m.x(), p_m.y(), p_m.z());
      const double expected_m = std::sqrt(variance_m2 * (1.0 + x.dot(inverse * x)));
      QVERIFY((*model)->uncertainty_m(p_m).has_value());
      FT_VERIFY_MATCH(near(*(*model)->uncertainty_m(p_m), expected_m, 1e-9));
    }
  }

  void aFitWithoutResidualClaimsNoUncertainty() {
    std::vector<Eigen::Vector3d> points_m = {{0, 0, 0}, {0.3, 0, 0}, {0, 0.3, 0}, {0, 0, 0.3}};
    const auto model =
        fitPosition("affine", fitDataOf(points_m, [](const Eigen::Vector3d& p) { return Eigen::Vector3d(0.1 * p); }));
    FT_VERIFY_OK(model);
    QVERIFY(!(*model)->uncertainty_m({0.1, 0.1, 0.1}));
  }
};

FIELDTRUE_TEST(PolynomialTest)
#include "polynomial_test.moc"
